// A plane model as stored bytes.
#ifndef STRATA_CORE_PLANES_MODELS_PLANE_MODEL_CODEC_H_
#define STRATA_CORE_PLANES_MODELS_PLANE_MODEL_CODEC_H_

#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/world/plane_model.h"

namespace strata {

// Little-endian numbers, doubles as their bits, in the envelope of core/codec. A plane without a
// colour is what readers of version 1 know.
std::string EncodePlaneModelInfo(const PlaneModelInfo& info);
std::string EncodeModelPlane(const ModelPlane& plane);

// DATA_LOSS for damaged bytes and for what no plane model is: numbers that are not finite or out of
// range, normals that are no unit vectors, rings of less than three points.
absl::StatusOr<PlaneModelInfo> DecodePlaneModelInfo(absl::string_view bytes);
absl::StatusOr<ModelPlane> DecodeModelPlane(absl::string_view bytes);

}  // namespace strata

#endif  // STRATA_CORE_PLANES_MODELS_PLANE_MODEL_CODEC_H_
