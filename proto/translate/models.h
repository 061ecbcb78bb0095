// Models of maps between the core's words and the wire's. ToProto never fails; FromProto answers
// INVALID_ARGUMENT naming the field.
#ifndef STRATA_PROTO_TRANSLATE_MODELS_H_
#define STRATA_PROTO_TRANSLATE_MODELS_H_

#include "absl/status/statusor.h"

#include "core/world/plane_model.h"
#include "strata/v1/models.pb.h"

namespace strata::translate {

v1::ModelPlane ToProto(const ModelPlane& plane);
v1::PlaneModel ToProto(const PlaneModelInfo& info);

absl::StatusOr<ModelPlane> FromProto(const v1::ModelPlane& proto);
absl::StatusOr<PlaneModelInfo> FromProto(const v1::PlaneModel& proto);

}  // namespace strata::translate

#endif  // STRATA_PROTO_TRANSLATE_MODELS_H_
