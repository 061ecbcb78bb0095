// Which cells of a tile hold how many surfaces, and which surfaces lie beside each other.
#ifndef STRATA_CORE_CODEC_OCCUPANCY_H_
#define STRATA_CORE_CODEC_OCCUPANCY_H_

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

#include "core/codec/bytes.h"

namespace strata {

// Most surfaces of one tile; bounds what a decoder allocates (32 bytes each).
inline constexpr std::size_t kMaxTilePatches = std::size_t{1} << 22;

// Appends the cells of a tile's surfaces (ascending, a cell once for each surface).
void PutCells(std::string& out, std::span<const std::uint16_t> cells);
// DATA_LOSS if damaged or more than `max_surfaces`, before more memory is taken than those need.
absl::StatusOr<std::vector<std::uint16_t>> TakeCells(ByteReader& reader,
                                                     std::size_t max_surfaces = kMaxTilePatches);

// Surfaces of the same layer (how many lie below in the cell), or the highest below it, in the
// cells to the left (x − 1) and up (y − 1) and beside that (x − 1, y − 1) and (x + 1, y − 1):
// indices of what comes before in order, or kNone.
struct SurfacesBeside {
  static constexpr std::uint32_t kNone = 0xFFFFFFFF;
  std::uint32_t left = kNone, up = kNone, up_left = kNone, up_right = kNone;
};
std::vector<SurfacesBeside> FindNeighbours(std::span<const std::uint16_t> cells);

}  // namespace strata

#endif  // STRATA_CORE_CODEC_OCCUPANCY_H_
