#include "proto/translate/geometry.h"

#include <cmath>
#include <cstdint>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

#include "core/common/status.h"

namespace strata::translate {
namespace {

using RowMajor6d = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;

constexpr double kQuaternionNormTolerance = 1e-3;
// The range of google.protobuf.Timestamp.
constexpr std::int64_t kMinSeconds = -62135596800;
constexpr std::int64_t kMaxSeconds = 253402300799;

absl::StatusOr<Eigen::Quaterniond> UnitQuaternion(absl::string_view what, const v1::Pose& pose) {
  if (!pose.has_rotation()) return Eigen::Quaterniond::Identity();
  const v1::Quaternion& q = pose.rotation();
  const Eigen::Quaterniond rotation(q.w(), q.x(), q.y(), q.z());
  const double norm = rotation.norm();
  // The negated comparison also catches NaN.
  if (!(std::abs(norm - 1.0) <= kQuaternionNormTolerance)) {
    return absl::InvalidArgumentError(
        absl::StrCat(what, ".rotation: norm ", norm, " is not 1 to ", kQuaternionNormTolerance));
  }
  return rotation.normalized();
}

}  // namespace

v1::Vector2 ToProto(const Eigen::Vector2d& v) {
  v1::Vector2 proto;
  proto.set_x(v.x());
  proto.set_y(v.y());
  return proto;
}

v1::Vector3 ToProto(const Eigen::Vector3d& v) {
  v1::Vector3 proto;
  proto.set_x(v.x());
  proto.set_y(v.y());
  proto.set_z(v.z());
  return proto;
}

v1::Pose ToProto(const Pose& T) {
  v1::Pose proto;
  *proto.mutable_translation() = ToProto(Eigen::Vector3d(T.translation()));
  const Eigen::Quaterniond q(T.linear());
  v1::Quaternion& rotation = *proto.mutable_rotation();
  rotation.set_x(q.x());
  rotation.set_y(q.y());
  rotation.set_z(q.z());
  rotation.set_w(q.w());
  return proto;
}

v1::Box2 ToProto(const Eigen::AlignedBox2d& box) {
  v1::Box2 proto;
  *proto.mutable_min() = ToProto(box.min());
  *proto.mutable_max() = ToProto(box.max());
  return proto;
}

v1::Box3 ToProto(const Eigen::AlignedBox3d& box) {
  v1::Box3 proto;
  *proto.mutable_min() = ToProto(box.min());
  *proto.mutable_max() = ToProto(box.max());
  return proto;
}

google::protobuf::Timestamp ToProto(absl::Time time) {
  google::protobuf::Timestamp proto;
  const timespec parts = absl::ToTimespec(time);
  proto.set_seconds(parts.tv_sec);
  proto.set_nanos(static_cast<std::int32_t>(parts.tv_nsec));
  return proto;
}

google::protobuf::RepeatedField<double> ToProto(const Matrix6d& matrix) {
  const RowMajor6d rows = matrix;
  return {rows.data(), rows.data() + rows.size()};
}

absl::StatusOr<Eigen::Vector2d> FromProto(absl::string_view what, const v1::Vector2& v) {
  const Eigen::Vector2d result(v.x(), v.y());
  if (result.allFinite()) return result;
  return absl::InvalidArgumentError(
      absl::StrCat(what, ": (", v.x(), ", ", v.y(), ") is not finite"));
}

absl::StatusOr<Eigen::Vector3d> FromProto(absl::string_view what, const v1::Vector3& v) {
  const Eigen::Vector3d result(v.x(), v.y(), v.z());
  if (result.allFinite()) return result;
  return absl::InvalidArgumentError(
      absl::StrCat(what, ": (", v.x(), ", ", v.y(), ", ", v.z(), ") is not finite"));
}

absl::StatusOr<Pose> FromProto(absl::string_view what, const v1::Pose& pose) {
  STRATA_ASSIGN_OR_RETURN(const Eigen::Vector3d translation,
                          FromProto(absl::StrCat(what, ".translation"), pose.translation()));
  STRATA_ASSIGN_OR_RETURN(const Eigen::Quaterniond rotation, UnitQuaternion(what, pose));
  const Pose T = MakePose(rotation, translation);
  STRATA_RETURN_IF_ERROR(Annotate(ValidatePose(T), what));
  return T;
}

absl::StatusOr<Eigen::AlignedBox2d> FromProto(absl::string_view what, const v1::Box2& box) {
  STRATA_ASSIGN_OR_RETURN(const Eigen::Vector2d min,
                          FromProto(absl::StrCat(what, ".min"), box.min()));
  STRATA_ASSIGN_OR_RETURN(const Eigen::Vector2d max,
                          FromProto(absl::StrCat(what, ".max"), box.max()));
  if ((min.array() <= max.array()).all()) return Eigen::AlignedBox2d(min, max);
  return absl::InvalidArgumentError(absl::StrCat(
      what, ": min (", min.x(), ", ", min.y(), ") is above max (", max.x(), ", ", max.y(), ")"));
}

absl::StatusOr<Eigen::AlignedBox3d> FromProto(absl::string_view what, const v1::Box3& box) {
  STRATA_ASSIGN_OR_RETURN(const Eigen::Vector3d min,
                          FromProto(absl::StrCat(what, ".min"), box.min()));
  STRATA_ASSIGN_OR_RETURN(const Eigen::Vector3d max,
                          FromProto(absl::StrCat(what, ".max"), box.max()));
  if ((min.array() <= max.array()).all()) return Eigen::AlignedBox3d(min, max);
  return absl::InvalidArgumentError(absl::StrCat(what, ": a number of min is above that of max"));
}

absl::StatusOr<absl::Time> FromProto(absl::string_view what,
                                     const google::protobuf::Timestamp& time) {
  if (time.seconds() < kMinSeconds || time.seconds() > kMaxSeconds || time.nanos() < 0 ||
      time.nanos() > 999'999'999) {
    return absl::InvalidArgumentError(absl::StrCat(what,
                                                   ": ",
                                                   time.seconds(),
                                                   " s and ",
                                                   time.nanos(),
                                                   " ns are not within the years 1 to 9999"));
  }
  return absl::FromUnixSeconds(time.seconds()) + absl::Nanoseconds(time.nanos());
}

absl::StatusOr<Matrix6d> FromProto(absl::string_view what,
                                   const google::protobuf::RepeatedField<double>& numbers) {
  if (numbers.size() == RowMajor6d::SizeAtCompileTime) {
    const Matrix6d matrix = Eigen::Map<const RowMajor6d>(numbers.data());
    if (matrix.allFinite()) return matrix;
  }
  return absl::InvalidArgumentError(
      absl::StrCat(what, ": ", numbers.size(), " numbers, not 36 finite ones"));
}

}  // namespace strata::translate
