// Lower bounds of what is left of a path, as a search asks for them.
#ifndef STRATA_CORE_PLANNING_SEARCH_BOUNDS_H_
#define STRATA_CORE_PLANNING_SEARCH_BOUNDS_H_

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "core/mls/tile_key.h"
#include "core/planning/corridor.h"
#include "core/planning/landmarks.h"
#include "core/planning/move_cost.h"
#include "core/planning/search_space.h"

namespace strata {

// The bound of where no search needs to go.
inline constexpr std::uint32_t kNoUse = 0xFFFFFFFFU;

// Cost of the shortest way over cells without danger; consistent, since a move of any length costs
// at least as much.
struct OctileBound {
  static constexpr bool kByNumber = false;  // whether it reads the number of a patch
  static constexpr bool kMayWeigh = true;   // whether a large search may weigh it

  CellIndex goal;

  void Enter(int /*slot*/, const SearchSpace::Slot& /*s*/) {}
  std::uint32_t operator()(std::int32_t x, std::int32_t y, std::uint32_t /*number*/) const {
    const auto dx = static_cast<std::uint32_t>(std::abs(x - goal.x));
    const auto dy = static_cast<std::uint32_t>(std::abs(y - goal.y));
    return kCostPerCell * (std::max(dx, dy) - std::min(dx, dy)) +
           kCostPerDiagonal * std::min(dx, dy);
  }
  // The bound for a tile that is not at hand.
  std::uint32_t Outside(CellIndex cell) const { return (*this)(cell.x, cell.y, 0); }
};

// What a Corridor tells of a place.
class CorridorTiles {
 public:
  explicit CorridorTiles(const Corridor& corridor) : corridor_(&corridor) {}

  void Enter(int /*slot*/, const SearchSpace::Slot& s) { tile_ = corridor_->Find(s.key); }
  const Corridor::Tile* entered() const { return tile_; }
  const Corridor::Tile* At(CellIndex cell) const { return corridor_->Find(TileOfCell(cell)); }

 private:
  const Corridor* corridor_;
  const Corridor::Tile* tile_ = nullptr;
};

// Nothing but the corridor is of use, all of it in the order of costs: however long the way, a
// search then goes on in few tiles at a time.
class CorridorBound : public CorridorTiles {
 public:
  static constexpr bool kByNumber = false;
  static constexpr bool kMayWeigh = false;

  using CorridorTiles::CorridorTiles;

  std::uint32_t operator()(std::int32_t x, std::int32_t y, std::uint32_t /*number*/) const {
    return In(entered(), {x, y});
  }
  std::uint32_t Outside(CellIndex cell) const { return In(At(cell), cell); }

 private:
  static std::uint32_t In(const Corridor::Tile* tile, CellIndex cell) {
    return tile != nullptr && tile->inside.test(Corridor::BlockOf(cell)) ? 0 : kNoUse;
  }
};

// For a search below Corridor::limit().
class BlockBound : public CorridorTiles {
 public:
  static constexpr bool kByNumber = false;
  static constexpr bool kMayWeigh = false;

  BlockBound(const Corridor& corridor, const OctileBound& octile)
      : CorridorTiles(corridor), octile_(octile) {}

  std::uint32_t operator()(std::int32_t x, std::int32_t y, std::uint32_t /*number*/) const {
    return In(entered(), {x, y});
  }
  std::uint32_t Outside(CellIndex cell) const { return In(At(cell), cell); }

 private:
  std::uint32_t In(const Corridor::Tile* tile, CellIndex cell) const {
    if (tile == nullptr) return kNoUse;
    return std::max(octile_.Outside(cell), tile->costs[Corridor::BlockOf(cell)]);
  }

  OctileBound octile_;
};

struct NoBound {
  static constexpr bool kByNumber = false;
  static constexpr bool kMayWeigh = true;

  void Enter(int /*slot*/, const SearchSpace::Slot& /*s*/) {}
  std::uint32_t operator()(std::int32_t /*x*/, std::int32_t /*y*/, std::uint32_t /*number*/) const {
    return 0;
  }
  std::uint32_t Outside(CellIndex /*cell*/) const { return 0; }
};

// |d(landmark, patch) − d(landmark, goal)| never exceeds the cost between patch and goal. Of all
// landmarks the few that say most about the way from start to goal are asked.
class LandmarkBound {
 public:
  static constexpr bool kByNumber = true;
  static constexpr bool kMayWeigh = true;

  // REQUIRES: Measured(), for start and goal.
  LandmarkBound(SearchSpace& space, const Landmarks& landmarks, PatchId start, PatchId goal);

  static bool Measured(SearchSpace& space, const Landmarks& landmarks, PatchId patch);

  void Enter(int slot, const SearchSpace::Slot& s) {
    if (static_cast<std::size_t>(slot) >= of_slot_.size()) of_slot_.resize(slot + 1, nullptr);
    // Never nullptr: the start is connected to the landmarks, and so is what a search enters.
    if (of_slot_[slot] == nullptr) of_slot_[slot] = landmarks_.Tile(s.key);
    for (int i = 0; i < kAsked; ++i) {
      costs_[i] = of_slot_[slot] + static_cast<std::size_t>(s.size) * asked_[i];
    }
  }
  std::uint32_t operator()(std::int32_t x, std::int32_t y, std::uint32_t number) const {
    std::uint32_t bound = octile_(x, y, number);
    for (int i = 0; i < kAsked; ++i) {
      bound = std::max(bound, Apart(costs_[i][number], goal_costs_[i]));
    }
    return bound;
  }
  std::uint32_t Outside(CellIndex cell) const { return octile_.Outside(cell); }

 private:
  static constexpr int kAsked = 4;

  static std::uint32_t Apart(std::uint32_t a, std::uint32_t b) { return a > b ? a - b : b - a; }

  OctileBound octile_;
  const Landmarks& landmarks_;
  std::array<int, kAsked> asked_;
  std::array<std::uint32_t, kAsked> goal_costs_;
  std::vector<const std::uint32_t*> of_slot_;
  std::array<const std::uint32_t*, kAsked> costs_{};  // of the tile entered
};

}  // namespace strata

#endif  // STRATA_CORE_PLANNING_SEARCH_BOUNDS_H_
