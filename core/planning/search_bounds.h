// Lower bounds of what is left of a path, as a search asks for them.
#ifndef STRATA_CORE_PLANNING_SEARCH_BOUNDS_H_
#define STRATA_CORE_PLANNING_SEARCH_BOUNDS_H_

#include <algorithm>
#include <cstdint>
#include <cstdlib>

#include "core/mls/tile_key.h"
#include "core/planning/corridor.h"
#include "core/planning/move_cost.h"
#include "core/planning/search_space.h"

namespace strata {

// The bound of where no search needs to go.
inline constexpr std::uint32_t kNoUse = 0xFFFFFFFFU;

// Cost of the shortest way over cells without danger; consistent, since a move of any length costs
// at least as much.
struct OctileBound {
  static constexpr bool kMayWeigh = true;  // whether a large search may weigh it

  CellIndex goal;

  void Enter(int /*slot*/, const SearchSpace::Slot& /*s*/) {}
  std::uint32_t operator()(std::int32_t x, std::int32_t y) const {
    const auto dx = static_cast<std::uint32_t>(std::abs(x - goal.x));
    const auto dy = static_cast<std::uint32_t>(std::abs(y - goal.y));
    return kCostPerCell * (std::max(dx, dy) - std::min(dx, dy)) +
           kCostPerDiagonal * std::min(dx, dy);
  }
  // The bound for a tile that is not at hand.
  std::uint32_t Outside(CellIndex cell) const { return (*this)(cell.x, cell.y); }
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
  static constexpr bool kMayWeigh = false;

  using CorridorTiles::CorridorTiles;

  std::uint32_t operator()(std::int32_t x, std::int32_t y) const { return In(entered(), {x, y}); }
  std::uint32_t Outside(CellIndex cell) const { return In(At(cell), cell); }

 private:
  static std::uint32_t In(const Corridor::Tile* tile, CellIndex cell) {
    return tile != nullptr && tile->inside.test(Corridor::BlockOf(cell)) ? 0 : kNoUse;
  }
};

// For a search below Corridor::limit().
class BlockBound : public CorridorTiles {
 public:
  static constexpr bool kMayWeigh = false;

  BlockBound(const Corridor& corridor, const OctileBound& octile)
      : CorridorTiles(corridor), octile_(octile) {}

  std::uint32_t operator()(std::int32_t x, std::int32_t y) const { return In(entered(), {x, y}); }
  std::uint32_t Outside(CellIndex cell) const { return In(At(cell), cell); }

 private:
  std::uint32_t In(const Corridor::Tile* tile, CellIndex cell) const {
    if (tile == nullptr) return kNoUse;
    return std::max(octile_.Outside(cell), tile->costs[Corridor::BlockOf(cell)]);
  }

  OctileBound octile_;
};

struct NoBound {
  static constexpr bool kMayWeigh = true;

  void Enter(int /*slot*/, const SearchSpace::Slot& /*s*/) {}
  std::uint32_t operator()(std::int32_t /*x*/, std::int32_t /*y*/) const { return 0; }
  std::uint32_t Outside(CellIndex /*cell*/) const { return 0; }
};

}  // namespace strata

#endif  // STRATA_CORE_PLANNING_SEARCH_BOUNDS_H_
