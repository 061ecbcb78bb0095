// Places, poses and times between the core's words and the wire's. ToProto never fails; FromProto
// answers INVALID_ARGUMENT beginning with `what`, the field's name.
#ifndef STRATA_PROTO_TRANSLATE_GEOMETRY_H_
#define STRATA_PROTO_TRANSLATE_GEOMETRY_H_

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "google/protobuf/repeated_field.h"
#include "google/protobuf/timestamp.pb.h"
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/geometry/pose.h"
#include "strata/v1/geometry.pb.h"

namespace strata::translate {

v1::Vector2 ToProto(const Eigen::Vector2d& v);
v1::Vector3 ToProto(const Eigen::Vector3d& v);
v1::Pose ToProto(const Pose& T);
v1::Box2 ToProto(const Eigen::AlignedBox2d& box);
v1::Box3 ToProto(const Eigen::AlignedBox3d& box);
google::protobuf::Timestamp ToProto(absl::Time time);
// Row by row.
google::protobuf::RepeatedField<double> ToProto(const Matrix6d& matrix);

absl::StatusOr<Eigen::Vector2d> FromProto(absl::string_view what, const v1::Vector2& v);
absl::StatusOr<Eigen::Vector3d> FromProto(absl::string_view what, const v1::Vector3& v);
// The rotation comes from the normalised quaternion; the translation's bound is checked too. The
// rotation of a pose that went through ToProto agrees with the first to rounding (1e-15), not to
// the bit.
absl::StatusOr<Pose> FromProto(absl::string_view what, const v1::Pose& pose);
absl::StatusOr<Eigen::AlignedBox2d> FromProto(absl::string_view what, const v1::Box2& box);
absl::StatusOr<Eigen::AlignedBox3d> FromProto(absl::string_view what, const v1::Box3& box);
absl::StatusOr<absl::Time> FromProto(absl::string_view what,
                                     const google::protobuf::Timestamp& time);
absl::StatusOr<Matrix6d> FromProto(absl::string_view what,
                                   const google::protobuf::RepeatedField<double>& numbers);

}  // namespace strata::translate

#endif  // STRATA_PROTO_TRANSLATE_GEOMETRY_H_
