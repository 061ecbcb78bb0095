// Served tiles as bytes: what goes to robots and viewers, and what the store keeps of them.
#ifndef STRATA_CORE_CODEC_SURFACE_TILE_CODEC_H_
#define STRATA_CORE_CODEC_SURFACE_TILE_CODEC_H_

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/mls/surface_tile.h"

namespace strata {

inline constexpr std::uint16_t kSurfaceTileVersion = 4;

// The tile in the format of FORMAT.md, envelope included. A pure function of the tile, and
// *EncodeSurfaceTile(*DecodeSurfaceTile(bytes)) == bytes. What a reader gets back:
//   key, version, cell, traversability, class_id, confidence, vertical()   exactly
//   colour    within 2 of 255 a channel; known or not exactly
//   z_m       within 1/1024 m (0.98 mm): a multiple of 1/512 m; |z| ≤ 32,767 m
//   depth_m   the same, but never 0 when it was not: a depth below 1/1024 m becomes 1/512 m
//   sigma_m   within 4.8 %, from 60 nm to 0.99 km (clamped outside)
//   cost      where traversable 1 + cost within 6 % (clamped at 5e12); elsewhere within a
//             factor 1.19; 0 and infinity exactly; of undersides 0
// Not a number becomes 0. row_begin is not looked at. RESOURCE_EXHAUSTED, naming the tile and the
// bound, beyond kMaxTilePatches. REQUIRES: surfaces sorted by (cell, z). Thread-safe.
absl::StatusOr<std::string> EncodeSurfaceTile(const SurfaceTile& tile);

// DATA_LOSS for bytes that are not an intact tile, UNIMPLEMENTED for those of a later version.
// Never allocates more than 100 bytes × kMaxTilePatches. Thread-safe.
absl::StatusOr<SurfaceTile> DecodeSurfaceTile(absl::string_view bytes);

}  // namespace strata

#endif  // STRATA_CORE_CODEC_SURFACE_TILE_CODEC_H_
