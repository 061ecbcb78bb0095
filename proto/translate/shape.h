// Shapes and what they touch, between the core's words and the wire's.
#ifndef STRATA_PROTO_TRANSLATE_SHAPE_H_
#define STRATA_PROTO_TRANSLATE_SHAPE_H_

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/world/shape.h"
#include "strata/v1/planning.pb.h"

namespace strata::translate {

v1::CheckShapeRequest ToProto(absl::string_view map, const ShapeQuery& query);
v1::CheckShapeResponse ToProto(const ShapeCheck& check);

// INVALID_ARGUMENT of ValidateShapeQuery.
absl::StatusOr<ShapeQuery> FromProto(const v1::CheckShapeRequest& request);
absl::StatusOr<ShapeCheck> FromProto(const v1::CheckShapeResponse& check);

}  // namespace strata::translate

#endif  // STRATA_PROTO_TRANSLATE_SHAPE_H_
