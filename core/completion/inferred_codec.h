// What was inferred of entities, as stored bytes.
#ifndef STRATA_CORE_COMPLETION_INFERRED_CODEC_H_
#define STRATA_CORE_COMPLETION_INFERRED_CODEC_H_

#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/world/things/inferred.h"

namespace strata {

// Little-endian numbers, points to a tenth of a millimetre, in the envelope of core/codec.
std::string EncodeInferredInfo(const InferredInfo& info);
// REQUIRES: at most kMostInferredPoints points.
std::string EncodeInferredPart(const InferredPart& part);

// DATA_LOSS for damaged bytes, and for numbers that are not finite or out of range; nothing is
// allocated before it is known to be there.
absl::StatusOr<InferredInfo> DecodeInferredInfo(absl::string_view bytes);
absl::StatusOr<InferredPart> DecodeInferredPart(absl::string_view bytes);

}  // namespace strata

#endif  // STRATA_CORE_COMPLETION_INFERRED_CODEC_H_
