// MLS tiles with all their statistics and layers as bytes: how local maps and the tiles of the
// global map are kept, and how a robot sends a ready local map.
#ifndef STRATA_CORE_CODEC_MLS_TILE_CODEC_H_
#define STRATA_CORE_CODEC_MLS_TILE_CODEC_H_

#include <cstddef>
#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/mls/mls_map.h"

namespace strata {

inline constexpr std::uint16_t kMlsTileVersion = 2;
inline constexpr std::size_t kMaxTileVotes = std::size_t{1} << 23;

// RESOURCE_EXHAUSTED, naming the tile and the bound, beyond kMaxTilePatches or kMaxTileVotes: what
// no decoder takes.
absl::Status CheckTileSize(const MlsTile& tile);

// The tile in the format of FORMAT.md, envelope included; *DecodeMlsTile(*EncodeMlsTile(tile)) ==
// tile, bit for bit. A pure function of the tile. row_begin is not looked at. RESOURCE_EXHAUSTED as
// CheckTileSize; INVALID_ARGUMENT naming what is wrong unless patches are in range, sorted by
// (cell, z_min) and disjoint within a cell, and layers as MlsTile says. Thread-safe.
absl::StatusOr<std::string> EncodeMlsTile(const MlsTile& tile);

// DATA_LOSS for bytes that are not an intact tile, UNIMPLEMENTED for those of a later version.
// Every tile it yields keeps the rules of MlsTile. Never allocates more than 150 bytes ×
// kMaxTilePatches. Thread-safe.
absl::StatusOr<MlsTile> DecodeMlsTile(absl::string_view bytes);
// The same, but a tile that would take more than about `max_bytes` of memory is refused with
// RESOURCE_EXHAUSTED or DATA_LOSS before it is decompressed.
absl::StatusOr<MlsTile> DecodeMlsTileWithin(std::size_t max_bytes, absl::string_view bytes);

}  // namespace strata

#endif  // STRATA_CORE_CODEC_MLS_TILE_CODEC_H_
