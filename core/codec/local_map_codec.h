// A local map as bytes: what remains of a scan in a map that drops points, and what a robot sends
// in place of points.
#ifndef STRATA_CORE_CODEC_LOCAL_MAP_CODEC_H_
#define STRATA_CORE_CODEC_LOCAL_MAP_CODEC_H_

#include <cstddef>
#include <limits>
#include <string>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/mls/mls_map.h"

namespace strata {

inline constexpr std::size_t kMaxLocalMapPatches = std::size_t{1} << 24;

// Every tile as core/codec writes it, its length (32 bits, little-endian) in front. Exact.
// INVALID_ARGUMENT beyond `max_patches`, and errors of EncodeMlsTile: what is written can be read.
absl::StatusOr<std::string> EncodeLocalMap(const MlsMap& map,
                                           std::size_t max_patches = kMaxLocalMapPatches);
// DATA_LOSS for anything else. RESOURCE_EXHAUSTED beyond kMaxLocalMapPatches, before more is
// decoded than one tile too many.
absl::StatusOr<MlsMap> DecodeLocalMap(absl::string_view bytes, const MlsParameters& parameters);

// What a local map of somebody else may take.
struct LocalMapBounds {
  std::size_t max_patches = kMaxLocalMapPatches;
  std::size_t max_tile_bytes = std::numeric_limits<std::size_t>::max();  // as DecodeMlsTileWithin
};
// One scan's: of a robot that sends the local map in place of points. 2 million surfaces are more
// than any scan makes, and what a server keeps of them stays below 100 MB.
inline constexpr LocalMapBounds kUploadedLocalMap{.max_patches = std::size_t{1} << 21,
                                                  .max_tile_bytes = std::size_t{16} << 20};

// Hands out the tiles in their order, holding one at a time; errors as above, and those of `visit`.
absl::Status VisitLocalMap(absl::string_view bytes,
                           const LocalMapBounds& bounds,
                           absl::FunctionRef<absl::Status(MlsTile)> visit);

}  // namespace strata

#endif  // STRATA_CORE_CODEC_LOCAL_MAP_CODEC_H_
