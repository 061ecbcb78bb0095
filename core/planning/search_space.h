// The graph of patches as one query sees it: tiles are prepared when the search first touches them.
#ifndef STRATA_CORE_PLANNING_SEARCH_SPACE_H_
#define STRATA_CORE_PLANNING_SEARCH_SPACE_H_

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <vector>

#include "absl/container/inlined_vector.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include <Eigen/Core>

#include "core/common/hash_map.h"
#include "core/common/stop.h"
#include "core/mls/tile_key.h"
#include "core/planning/class_factors.h"
#include "core/planning/ground/profile_checks.h"
#include "core/planning/least_dangers.h"
#include "core/planning/move_cost.h"
#include "core/planning/prepared_tile.h"
#include "core/planning/tile_cache.h"
#include "core/planning/tile_source.h"

namespace strata {

// A surface in a query: places of one tile (PreparedTile) are contiguous.
using PatchId = std::uint32_t;
inline constexpr PatchId kNoPatchId = 0xFFFFFFFFU;
inline constexpr PatchId kMaxPatchIds = 0xFF000000U;  // all others are below

// For the thread of one query. After the first error of the source, or once `stop` stops while a
// tile is asked for, status() holds it and lookups find nothing. However far a query goes, it holds
// only the tiles it touched last, 1/32 of the cache's budget; others are had from the cache, or
// prepared, again.
class SearchSpace {
 public:
  struct Slot {
    TileKey key;
    std::shared_ptr<const PreparedTile> tile;  // nullptr while it is let go
    PatchId base = 0;
    std::uint32_t places = 0;
    std::uint32_t size = 0;  // patches where the robot can stand
    std::int32_t x0 = 0;     // map cell of the tile's corner
    std::int32_t y0 = 0;
  };

  SearchSpace(TileCache& cache,
              TileSource& source,
              const ProfileChecks& checks,
              const ClassFactors& classes = {},
              const Stop& stop = {})
      : cache_(cache),
        source_(source),
        checks_(checks),
        step_costs_(checks.cell_size_m, checks.step_m),
        classes_(classes),
        stop_(stop) {}

  const absl::Status& status() const { return status_; }
  const ProfileChecks& checks() const { return checks_; }
  const StepCosts& step_costs() const { return step_costs_; }
  const ClassFactors& classes() const { return classes_; }
  TileSource& source() const { return source_; }
  const std::vector<Slot>& slots() const { return slots_; }
  // With its tile; of a tile that cannot be had again, one nobody can stand on. Until another slot
  // is asked for: whoever needs the tile longer keeps `tile`.
  const Slot& At(int slot);
  // As TileCache has them.
  absl::StatusOr<std::shared_ptr<const LeastDangers>> KeptDangers(const TileKey& key);
  bool IsKept(const TileKey& key) { return cache_.IsKept(source_, key, checks_); }
  PatchId end() const { return static_cast<PatchId>(page_slot_.size()) << kPageShift; }

  // Number of the slot of a tile, prepared now if need be; -1 where the map has nothing.
  int SlotOf(const TileKey& key);
  // The same of a tile that was asked for before; else -1.
  int SlotIfAny(const TileKey& key) const {
    const auto found = slot_of_.find(key);
    return found == slot_of_.end() ? -1 : found->second;
  }
  int SlotOf(PatchId patch) const { return page_slot_[patch >> kPageShift]; }
  const Slot& SlotOfPatch(PatchId patch) { return At(SlotOf(patch)); }

  // Surfaces of a cell, lowest first.
  using Column = absl::InlinedVector<PatchId, 4>;
  Column FindCell(CellIndex cell);

  // True if the ground allows it, whatever classes cost.
  bool HasMove(PatchId patch, int direction);
  // Where a move in `direction` leads and what it costs; kNoPatchId if there is none, or if it
  // leads to a forbidden class.
  PatchId Follow(PatchId patch, int direction, std::uint32_t* cost, int* cells);
  // The same whatever classes cost.
  PatchId FollowGround(PatchId patch, int direction, std::uint32_t* cost, int* cells);

  CellIndex CellOfPatch(PatchId patch);
  float Height(PatchId patch);
  // To 1/16,000 of 1 + it; < 0: the robot cannot stand there, or its class is forbidden.
  float Danger(PatchId patch);
  std::uint8_t ClassOf(PatchId patch);
  // By what its class multiplies costs.
  double ClassFactor(PatchId patch) { return classes_.Factor(ClassOf(patch)); }
  // Lower bound of the distance to the nearest edge [m].
  float EdgeDistance(PatchId patch);
  // Centre of the cell at the surface.
  Eigen::Vector3d Position(PatchId patch);

 private:
  static constexpr int kPageShift = 12;

  static CellIndex CellIn(const Slot& slot, std::uint32_t place) {
    // Nothing is known of a tile that cannot be had again.
    const std::uint16_t cell = place < slot.tile->places() ? slot.tile->CellOf(place) : 0;
    return {slot.x0 + (cell & (kTileCells - 1)), slot.y0 + (cell >> kTileShift)};
  }
  // Where a far move from cell `from` leads; kNoPatchId if its tile cannot be had.
  PatchId Resolve(CellIndex from, const FarMove& move);
  bool HasRoomFor(const PreparedTile& tile) const;
  absl::StatusOr<std::shared_ptr<const PreparedTile>> Fetch(const TileKey& key);
  std::shared_ptr<const PreparedTile> TileAgain(const Slot& slot);
  // Keeps the tile of a slot at hand, and lets go of those that came first.
  void Hold(int slot, std::shared_ptr<const PreparedTile> tile);

  TileCache& cache_;
  TileSource& source_;
  const ProfileChecks& checks_;
  const StepCosts step_costs_;
  const ClassFactors classes_;
  const Stop stop_;
  absl::Status status_;
  std::vector<Slot> slots_;
  std::deque<int> held_;  // slots with a tile, the first to come first
  std::size_t held_bytes_ = 0;
  std::vector<std::uint16_t> page_slot_;  // of each page of patch numbers
  HashMap<TileKey, int> slot_of_;
};

}  // namespace strata

#endif  // STRATA_CORE_PLANNING_SEARCH_SPACE_H_
