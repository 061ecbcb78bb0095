// A local map as stored bytes: what remains of a scan in a map that drops points.
#ifndef STRATA_CORE_ENGINE_LOCAL_MAP_CODEC_H_
#define STRATA_CORE_ENGINE_LOCAL_MAP_CODEC_H_

#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/mls/mls_map.h"

namespace strata {

// Every tile as core/codec writes it, its length (32 bits, little-endian) in front. Exact.
std::string EncodeLocalMap(const MlsMap& map);
// DATA_LOSS for anything else.
absl::StatusOr<MlsMap> DecodeLocalMap(absl::string_view bytes, const MlsParameters& parameters);

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_LOCAL_MAP_CODEC_H_
