// Where a long way most likely leads, and what it costs at least: measured over blocks instead of
// patches, in a hundredth of the time.
//
// Corners of blocks are joined along the sides and diagonals of the blocks, at no more than moves
// over such a block cost; a side is as cheap as the cheaper of the two blocks that have it. Let
// what is left to the goal be linear between two corners. Of two places on the rim of a block, u
// and v, it then differs by no more than a way through the block costs that leads from u to v: what
// u has of its two corners is carried to what v has of its own, as much as fits along the diagonal,
// and that adds up to the octile distance of u and v. A way goes from rim to rim: none is cheaper.
#ifndef STRATA_CORE_PLANNING_CORRIDOR_H_
#define STRATA_CORE_PLANNING_CORRIDOR_H_

#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

#include "absl/functional/function_ref.h"
#include "absl/status/statusor.h"

#include "core/common/hash_map.h"
#include "core/common/stop.h"
#include "core/mls/tile_key.h"
#include "core/planning/least_dangers.h"
#include "core/planning/patch_index.h"

namespace strata {

class Corridor {
 public:
  // What is known of a tile, block by block.
  struct Tile {
    std::bitset<PatchIndex::kBlocks> inside;  // along the cheapest way over blocks
    std::array<std::uint32_t, PatchIndex::kBlocks> costs = {};  // from there to the goal at least
  };
  // Of any tile, those that the map does not have included.
  using DangersOf =
      absl::FunctionRef<absl::StatusOr<std::shared_ptr<const LeastDangers>>(const TileKey&)>;

  // `gap_cells`: of ProfileChecks, along a diagonal. nullopt where there is no way, or where
  // `max_bytes` are not enough to tell. Errors are those of `dangers_of` and `stop`.
  static absl::StatusOr<std::optional<Corridor>> Find(DangersOf dangers_of,
                                                      CellIndex start,
                                                      CellIndex goal,
                                                      int gap_cells,
                                                      std::size_t max_bytes,
                                                      const Stop& stop);

  // No way from the start to the goal costs less.
  std::uint32_t least_cost() const { return least_cost_; }
  // Ways over tiles that Find() knows nothing of cost at least this.
  std::uint32_t limit() const { return limit_; }
  // nullptr where nothing is known.
  const Tile* Find(const TileKey& key) const {
    const auto found = tiles_.find(key);
    return found == tiles_.end() ? nullptr : &found->second;
  }
  static std::uint32_t BlockOf(CellIndex cell) {
    return PatchIndex::FirstSheetPlace(CellInTile(cell)) / 64;
  }

 private:
  friend class BlockSearch;

  std::uint32_t least_cost_ = 0;
  std::uint32_t limit_ = 0;
  HashMap<TileKey, Tile> tiles_;
};

}  // namespace strata

#endif  // STRATA_CORE_PLANNING_CORRIDOR_H_
