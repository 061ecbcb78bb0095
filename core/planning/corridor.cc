#include "core/planning/corridor.h"

#include <algorithm>
#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/common/hash_map.h"
#include "core/common/status.h"
#include "core/common/stop.h"
#include "core/mls/tile_key.h"
#include "core/planning/bucket_queue.h"
#include "core/planning/ground/ground_window.h"
#include "core/planning/least_dangers.h"
#include "core/planning/move_cost.h"
#include "core/planning/prepared_tile.h"

namespace strata {
namespace {

constexpr int kBlockCells = 8;
constexpr int kRow = 32;  // blocks of a tile
// Blocks to either side of the cheapest way, measured: one is enough along streets.
constexpr int kHalfWidth = 2;
// What is not looked at costs more than the cheapest way by this part of it.
constexpr std::uint32_t kBeyondShare = 32;
// Costs of moves are rounded, each by half at most.
constexpr std::uint32_t kRounded = kBlockCells / 2;

std::uint32_t SideCost(std::uint16_t danger) {
  return static_cast<std::uint32_t>(kBlockCells * kCostPerCell * OnePlusDanger(danger)) - kRounded;
}
std::uint32_t DiagonalCost(std::uint16_t danger) {
  return static_cast<std::uint32_t>(std::uint64_t{SideCost(danger)} * kCostPerDiagonal /
                                    kCostPerCell);
}

// A corner of blocks, or the block that has it as its lower left one, of a tile by its number.
struct Corner {
  int tile = 0;
  int x = 0;
  int y = 0;

  std::size_t number() const { return static_cast<std::size_t>(y * kRow + x); }
  std::uint32_t value() const {
    return static_cast<std::uint32_t>(tile) << 10 | static_cast<std::uint32_t>(number());
  }
  static Corner Of(std::uint32_t value) {
    return {static_cast<int>(value >> 10), int(value & 31U), int(value >> 5 & 31U)};
  }
  friend bool operator==(const Corner&, const Corner&) = default;
};

}  // namespace

// A* from the goal over corners of blocks; tiles are asked for when it first touches them.
class BlockSearch {
 public:
  BlockSearch(Corridor::DangersOf dangers_of, CellIndex start, int gap_cells, std::size_t max_bytes)
      : dangers_of_(dangers_of), start_(start), most_tiles_(max_bytes / kTileBytes) {
    OpenCorners(gap_cells);
    queue_.Clear(kBucketShift);
  }

  absl::StatusOr<std::optional<Corridor>> Run(CellIndex goal, const Stop& stop) {
    for (const Corner& corner : CornersAround(goal)) Offer(corner, 0, kFromGoal);
    const std::array<Corner, 4> wanted = CornersAround(start_);
    std::optional<Corridor> corridor;
    std::uint32_t end = kUnreached;
    std::uint64_t expanded = 0;
    while (status_.ok() && !IsFull() && !queue_.empty() && queue_.lower_bound() <= end) {
      const Corner corner = Corner::Of(queue_.Pop());
      if (!corridor.has_value() &&
          std::find(wanted.begin(), wanted.end(), corner) != wanted.end()) {
        end = queue_.lower_bound() + queue_.lower_bound() / kBeyondShare;
        corridor.emplace().least_cost_ = LeastCost(wanted);
        MarkWay(corner, *corridor);
      }
      Expand(corner);
      if (++expanded % kExpansionsPerLook == 0) STRATA_RETURN_IF_ERROR(stop.status());
    }
    STRATA_RETURN_IF_ERROR(status_);
    if (corridor.has_value()) StoreCosts(*corridor);
    return corridor;
  }

 private:
  struct Tile {
    TileKey key;
    std::shared_ptr<const LeastDangers> dangers;
    std::array<std::uint32_t, PatchIndex::kBlocks> costs;
    std::array<std::uint8_t, PatchIndex::kBlocks> directions;  // that a corner was reached by
    std::bitset<PatchIndex::kBlocks> expanded;
    std::array<int, 9> around;  // numbers; -1: not asked for
  };
  static constexpr std::size_t kTileBytes =
      sizeof(Tile) + sizeof(LeastDangers) + sizeof(Corridor::Tile) + 256;
  static constexpr std::uint8_t kFromGoal = 8;
  static constexpr std::uint32_t kUnreached = 0xFFFFFFFFU;
  static constexpr std::uint32_t kFar = 0x80000000U;          // beyond all that costs may be
  static constexpr std::uint64_t kExpansionsPerLook = 16384;  // at the clock
  static constexpr int kBucketShift = 11;                     // narrower than any side costs

  // Moves over gaps between two tiles may lie over a third one that is at a corner of both.
  void OpenCorners(int gap_cells) {
    most_.fill(kClosedBlock);
    const int reach = (gap_cells + kBlockCells - 1) / kBlockCells;
    const auto near = [reach](int at) { return at < reach || at >= kRow - reach; };
    for (int y = 0; y < kRow; ++y) {
      for (int x = 0; x < kRow; ++x) {
        if (near(x) && near(y)) most_[y * kRow + x] = LeastGapDanger();
      }
    }
  }

  int TileAt(const TileKey& key) {
    const auto [found, inserted] = number_of_.try_emplace(key, static_cast<int>(tiles_.size()));
    if (!inserted) return found->second;
    Tile& tile = *tiles_.emplace_back(std::make_unique<Tile>());
    tile.key = key;
    tile.costs.fill(kUnreached);
    tile.around.fill(-1);
    absl::StatusOr<std::shared_ptr<const LeastDangers>> dangers = dangers_of_(key);
    if (!dangers.ok()) status_ = dangers.status();
    tile.dangers = dangers.ok() ? *std::move(dangers) : std::make_shared<const LeastDangers>();
    return found->second;
  }

  bool IsFull() const { return tiles_.size() > most_tiles_; }

  // For x and y that may be somewhat beyond the tile.
  Corner At(const Corner& from, int x, int y) {
    if (static_cast<unsigned>(x) < kRow && static_cast<unsigned>(y) < kRow) {
      return {from.tile, x, y};
    }
    const int dx = x < 0 ? -1 : x / kRow;
    const int dy = y < 0 ? -1 : y / kRow;
    int& known = tiles_[from.tile]->around[(dy + 1) * 3 + dx + 1];
    if (known < 0) {
      const TileKey& key = tiles_[from.tile]->key;
      known = TileAt({key.level, key.x + dx, key.y + dy});
    }
    return {known, x & (kRow - 1), y & (kRow - 1)};
  }
  Corner Next(const Corner& from, int direction) {
    return At(from, from.x + kStepX[direction], from.y + kStepY[direction]);
  }
  std::array<Corner, 4> CornersAround(CellIndex cell) {
    const int x = (cell.x & (kTileCells - 1)) / kBlockCells;
    const int y = (cell.y & (kTileCells - 1)) / kBlockCells;
    const Corner low = {TileAt(TileOfCell(cell)), x, y};
    return {low, At(low, x + 1, y), At(low, x, y + 1), At(low, x + 1, y + 1)};
  }

  std::uint16_t DangerOf(const Corner& block) const {
    return std::min((*tiles_[block.tile]->dangers)[block.number()], most_[block.number()]);
  }

  // No more than blocks without danger cost between a corner and the middle of a cell.
  std::uint32_t Octile(const Corner& corner, CellIndex to) const {
    const TileKey& key = tiles_[corner.tile]->key;
    const std::int64_t x = std::int64_t{key.x} * kTileCells + corner.x * kBlockCells;
    const std::int64_t y = std::int64_t{key.y} * kTileCells + corner.y * kBlockCells;
    // In half cells.
    const auto dx = static_cast<std::uint64_t>(std::abs(2 * (x - to.x) - 1));
    const auto dy = static_cast<std::uint64_t>(std::abs(2 * (y - to.y) - 1));
    const std::uint64_t aslant = std::min(dx, dy);
    const std::uint64_t straight = std::max(dx, dy) - aslant;
    return static_cast<std::uint32_t>((straight * SideCost(0) + aslant * DiagonalCost(0)) /
                                      (2 * kBlockCells));
  }

  void Offer(const Corner& corner, std::uint32_t cost, std::uint8_t direction) {
    Tile& tile = *tiles_[corner.tile];
    if (cost >= tile.costs[corner.number()]) return;
    tile.costs[corner.number()] = cost;
    tile.directions[corner.number()] = direction;
    tile.expanded.reset(corner.number());
    queue_.Push(cost + Octile(corner, start_), corner.value());
  }

  void Expand(const Corner& corner) {
    Tile& tile = *tiles_[corner.tile];
    if (tile.expanded.test(corner.number())) return;
    tile.expanded.set(corner.number());
    const std::uint32_t cost = tile.costs[corner.number()];
    // Of the blocks around, in the order of the diagonal directions 1, 3, 5, 7.
    std::array<std::uint16_t, 4> dangers;
    for (int i = 0; i < 4; ++i) {
      const int k = 2 * i + 1;
      dangers[i] = DangerOf(
          At(corner, corner.x + std::min(kStepX[k], 0), corner.y + std::min(kStepY[k], 0)));
    }
    for (int i = 0; i < 4; ++i) {
      const auto k = static_cast<std::uint8_t>(2 * i);
      const std::uint16_t side = std::min(dangers[i], dangers[(i + 3) % 4]);
      if (side != kClosedBlock) Offer(Next(corner, k), cost + SideCost(side), k);
      if (dangers[i] == kClosedBlock) continue;
      Offer(Next(corner, k + 1), cost + DiagonalCost(dangers[i]), k + 1);
    }
  }

  // From the rim of the start's block on, when the first of its corners has its turn: none has a
  // lower total, and a place on the rim costs no less than the cheapest of the corners.
  std::uint32_t LeastCost(const std::array<Corner, 4>& corners) const {
    constexpr std::uint32_t kOctileRounded = 1;
    std::uint32_t off = 0;
    for (const Corner& corner : corners) off = std::max(off, Octile(corner, start_));
    const std::uint32_t total = queue_.lower_bound();
    return total - std::min(total, off + kOctileRounded);
  }

  // To the goal.
  void MarkWay(Corner corner, Corridor& corridor) {
    while (true) {
      MarkAround(corner, corridor);
      const std::uint8_t direction = tiles_[corner.tile]->directions[corner.number()];
      if (direction == kFromGoal) return;
      corner = Next(corner, direction ^ 4);
    }
  }
  void MarkAround(const Corner& corner, Corridor& corridor) {
    for (int dy = -kHalfWidth - 1; dy <= kHalfWidth; ++dy) {
      for (int dx = -kHalfWidth - 1; dx <= kHalfWidth; ++dx) {
        const Corner block = At(corner, corner.x + dx, corner.y + dy);
        corridor.tiles_[tiles_[block.tile]->key].inside.set(block.number());
      }
    }
  }

  // Every way over what was not expanded costs at least `limit` in all.
  void StoreCosts(Corridor& corridor) {
    const std::uint32_t limit = queue_.empty() && !IsFull() ? kFar : queue_.lower_bound();
    corridor.limit_ = limit - std::min(limit, DiagonalCost(0));
    const std::size_t count = tiles_.size();
    for (std::size_t tile = 0; tile < count; ++tile) {
      Corridor::Tile& stored = corridor.tiles_[tiles_[tile]->key];
      for (int y = 0; y < kRow; ++y) {
        for (int x = 0; x < kRow; ++x) {
          const Corner low = {static_cast<int>(tile), x, y};
          std::uint32_t least = CostOf(low, limit);
          for (const auto& [dx, dy] : {std::pair(1, 0), std::pair(0, 1), std::pair(1, 1)}) {
            least = std::min(least, CostOf(At(low, x + dx, y + dy), limit));
          }
          stored.costs[low.number()] = least;
        }
      }
    }
  }
  std::uint32_t CostOf(const Corner& corner, std::uint32_t limit) const {
    const Tile& tile = *tiles_[corner.tile];
    if (tile.expanded.test(corner.number())) return tile.costs[corner.number()];
    return limit - std::min(limit, Octile(corner, start_));
  }

  const Corridor::DangersOf dangers_of_;
  const CellIndex start_;
  const std::size_t most_tiles_;
  absl::Status status_;
  LeastDangers most_{};  // of any tile
  std::vector<std::unique_ptr<Tile>> tiles_;
  HashMap<TileKey, int> number_of_;
  BucketQueue queue_;
};

absl::StatusOr<std::optional<Corridor>> Corridor::Find(DangersOf dangers_of,
                                                       CellIndex start,
                                                       CellIndex goal,
                                                       int gap_cells,
                                                       std::size_t max_bytes,
                                                       const Stop& stop) {
  return BlockSearch(dangers_of, start, gap_cells, max_bytes).Run(goal, stop);
}

}  // namespace strata
