// The ground of a map in pieces: what floors are put together from.
#ifndef STRATA_CORE_PLANNING_FLOORS_PIECES_H_
#define STRATA_CORE_PLANNING_FLOORS_PIECES_H_

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"

#include "core/common/stop.h"
#include "core/mls/tile_key.h"
#include "core/planning/search_space.h"

namespace strata {

// Places to stand of one block of 8 × 8 cells, connected by moves within the block, of each cell
// one at most.
struct Piece {
  std::int32_t block_x = 0;
  std::int32_t block_y = 0;
  std::uint64_t cells = 0;  // as in FloorBlock
  std::uint32_t count = 0;
  float mean_x = 0.0F;  // cells from the block's lower left to the middle of the piece
  float mean_y = 0.0F;
  float mean_z = 0.0F;  // [m]
  float low_z = 0.0F;
  float high_z = 0.0F;
};

// Moves between two pieces, a < b.
struct Border {
  std::uint32_t a = 0;
  std::uint32_t b = 0;
  std::uint32_t moves = 0;
};

struct Pieces {
  std::vector<Piece> pieces;    // by tile, block, and the order they were found in
  std::vector<Border> borders;  // by (a, b)
  std::vector<std::vector<std::uint32_t>> piece_of;  // of each tile given, by number of the patch
};

// At most so many places to stand are made floors of: some 180 MB are needed then.
inline constexpr std::uint64_t kMaxFloorPatches = 10'000'000;

// Of the tiles `tiles`, sorted. Linear in the patches, 12 bytes each. RESOURCE_EXHAUSTED beyond
// kMaxFloorPatches; errors of the source and of `stop`.
absl::StatusOr<Pieces> CutIntoPieces(SearchSpace& space,
                                     const std::vector<TileKey>& tiles,
                                     const Stop& stop);

}  // namespace strata

#endif  // STRATA_CORE_PLANNING_FLOORS_PIECES_H_
