#include "core/planning/floors/floor_grid.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <map>
#include <memory>
#include <set>
#include <span>
#include <utility>

#include "absl/status/status.h"

#include "core/common/hash_map.h"
#include "core/common/status.h"
#include "core/mls/surface_tile.h"
#include "core/world/things/inferred_tile.h"

namespace strata {
namespace {

using BlockIndex = std::pair<std::int32_t, std::int32_t>;  // y, x
using Heights = std::array<float, 64>;                     // of the free cells; NaN elsewhere

constexpr int kSide = kFloorBlockCells;
constexpr int kWindow = 3 * kSide;
constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

// The heights of a floor, tile by tile.
absl::StatusOr<HashMap<BlockIndex, Heights>> HeightsOf(SearchSpace& space,
                                                       const std::vector<TileKey>& tiles,
                                                       const Pieces& pieces,
                                                       const std::vector<std::uint32_t>& floor,
                                                       const Stop& stop) {
  std::vector<bool> own(pieces.pieces.size(), false);
  for (const std::uint32_t piece : floor) own[piece] = true;
  HashMap<BlockIndex, Heights> heights;
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    STRATA_RETURN_IF_ERROR(stop.status());
    const int slot = space.SlotOf(tiles[i]);
    if (slot < 0) continue;
    const std::shared_ptr<const PreparedTile> tile = space.At(slot).tile;
    STRATA_RETURN_IF_ERROR(space.status());
    tile->standing.ForEach([&](std::uint32_t place, std::uint32_t number) {
      const std::uint32_t piece = pieces.piece_of[i][number];
      if (!own[piece]) return;
      const BlockIndex block = {pieces.pieces[piece].block_y, pieces.pieces[piece].block_x};
      const auto [at, added] = heights.try_emplace(block);
      if (added) at->second.fill(kNone);
      at->second[place % 64] = tile->HeightOf(number);
    });
  }
  return heights;
}

// The heights of the nearest free cells, at most `reach` cells away, for a block and those around.
class Around {
 public:
  Around(const HashMap<BlockIndex, Heights>& heights, BlockIndex block, int reach) {
    window_.fill(kNone);
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const auto found = heights.find({block.first + dy, block.second + dx});
        if (found == heights.end()) continue;
        for (int cell = 0; cell < 64; ++cell) {
          window_[((dy + 1) * kSide + cell / kSide) * kWindow + (dx + 1) * kSide + cell % kSide] =
              found->second[cell];
        }
      }
    }
    Spread(reach);
  }
  float At(int cell) const {
    return window_[(kSide + cell / kSide) * kWindow + kSide + cell % kSide];
  }

 private:
  void Spread(int reach) {
    std::vector<int> rim;
    for (int i = 0; i < kWindow * kWindow; ++i) {
      if (!std::isnan(window_[i])) rim.push_back(i);
    }
    for (int step = 0; step < reach; ++step) {
      std::vector<int> next;
      for (const int i : rim) {
        for (int direction = 0; direction < 8; ++direction) {
          const int x = i % kWindow + kStepX[direction];
          const int y = i / kWindow + kStepY[direction];
          if (x < 0 || y < 0 || x >= kWindow || y >= kWindow) continue;
          float& height = window_[y * kWindow + x];
          if (!std::isnan(height)) continue;
          height = window_[i];
          next.push_back(y * kWindow + x);
        }
      }
      rim = std::move(next);
    }
  }

  std::array<float, kWindow * kWindow> window_;
};

// What a cell that is not free is, beside a floor of this height.
void Classify(std::span<const Surface> surfaces,
              std::span<const InferredSpan> inferred,
              float height_m,
              const ProfileChecks& checks,
              std::uint64_t bit,
              FloorBlock& block) {
  const auto meets = [&](double bottom_m, float top_m) {
    return top_m > height_m + checks.step_m && bottom_m < height_m + checks.profile.height_m;
  };
  bool occupied = false;
  bool ground = false;
  for (const Surface& surface : surfaces) {
    occupied = occupied || meets(surface.bottom_m(), surface.z_m);
    ground = ground ||
             (surface.z_m <= height_m + checks.step_m && surface.z_m >= height_m - checks.step_m);
  }
  for (const InferredSpan& span : inferred) {
    occupied = occupied || meets(span.low_m, span.high_m);
  }
  if (occupied) {
    block.occupied |= bit;
  } else if (ground) {
    block.ground |= bit;
  }
}

}  // namespace

absl::StatusOr<std::vector<FloorBlock>> FloorGrid(SearchSpace& space,
                                                  const std::vector<TileKey>& tiles,
                                                  const Pieces& pieces,
                                                  const std::vector<std::uint32_t>& floor,
                                                  const Stop& stop) {
  STRATA_ASSIGN_OR_RETURN(const auto heights, HeightsOf(space, tiles, pieces, floor, stop));
  std::set<BlockIndex> touched;
  for (const auto& [block, height] : heights) {
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) touched.insert({block.first + dy, block.second + dx});
    }
  }
  const ProfileChecks& checks = space.checks();
  const int reach = std::min(
      kSide, static_cast<int>(std::ceil(checks.profile.radius_m / checks.cell_size_m)) + 2);
  std::map<TileKey, std::vector<BlockIndex>> by_tile;
  for (const auto& [y, x] : touched) {
    by_tile[TileOfCell({x * kSide, y * kSide})].push_back({y, x});
  }
  std::vector<FloorBlock> blocks;
  for (const auto& [key, of_tile] : by_tile) {
    STRATA_RETURN_IF_ERROR(stop.status());
    STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<const SurfaceTile> tile,
                            space.source().Load(key));
    const std::shared_ptr<const InferredTile> inferred = space.source().Inferred(key);
    if (tile == nullptr && inferred == nullptr) continue;
    for (const auto& [y, x] : of_tile) {
      const Around around(heights, {y, x}, reach);
      const auto own = heights.find({y, x});
      FloorBlock block = {x, y, 0, 0, 0};
      for (int cell = 0; cell < 64; ++cell) {
        const std::uint64_t bit = std::uint64_t{1} << cell;
        if (own != heights.end() && !std::isnan(own->second[cell])) {
          block.free |= bit;
        } else if (!std::isnan(around.At(cell))) {
          const CellIndex at = {x * kSide + cell % kSide, y * kSide + cell / kSide};
          const std::uint32_t in_tile = CellInTile(at);
          Classify(tile == nullptr ? std::span<const Surface>() : tile->Cell(in_tile),
                   inferred == nullptr ? std::span<const InferredSpan>()
                                       : inferred->Cells(in_tile, in_tile + 1),
                   around.At(cell),
                   checks,
                   bit,
                   block);
        }
      }
      if ((block.free | block.occupied | block.ground) != 0) blocks.push_back(block);
    }
  }
  std::sort(blocks.begin(), blocks.end(), [](const FloorBlock& a, const FloorBlock& b) {
    return std::pair(a.y, a.x) < std::pair(b.y, b.x);
  });
  return blocks;
}

}  // namespace strata
