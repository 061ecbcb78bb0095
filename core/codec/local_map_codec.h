// A local map as bytes: what remains of a scan in a map that drops points, and what a robot sends
// in place of points.
#ifndef STRATA_CORE_CODEC_LOCAL_MAP_CODEC_H_
#define STRATA_CORE_CODEC_LOCAL_MAP_CODEC_H_

#include <cstddef>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/mls/mls_map.h"

namespace strata {

inline constexpr std::size_t kMaxLocalMapPatches = std::size_t{1} << 24;

// Every tile as core/codec writes it, its length (32 bits, little-endian) in front. Exact.
// INVALID_ARGUMENT beyond `max_patches`: what is written can be read.
absl::StatusOr<std::string> EncodeLocalMap(const MlsMap& map,
                                           std::size_t max_patches = kMaxLocalMapPatches);
// DATA_LOSS for anything else. RESOURCE_EXHAUSTED beyond kMaxLocalMapPatches, before more is
// decoded than one tile too many.
absl::StatusOr<MlsMap> DecodeLocalMap(absl::string_view bytes, const MlsParameters& parameters);

}  // namespace strata

#endif  // STRATA_CORE_CODEC_LOCAL_MAP_CODEC_H_
