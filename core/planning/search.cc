#include "core/planning/search.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

#include "core/common/status.h"
#include "core/common/stop.h"
#include "core/mls/tile_key.h"
#include "core/planning/bucket_queue.h"
#include "core/planning/corridor.h"
#include "core/planning/ground/ground_window.h"
#include "core/planning/move_cost.h"
#include "core/planning/patch_index.h"
#include "core/planning/prepared_tile.h"
#include "core/planning/search_bounds.h"
#include "core/planning/search_space.h"
#include "core/planning/search_workspace.h"

namespace strata {
namespace {

constexpr std::uint64_t kExpansionsPerLook = 4096;  // at the clock
// Buckets of 1/64 of a cell, measured: wide ones keep the ring in the processor's cache, but expand
// again what a bad order within a bucket made too dear; the tighter the bound, the more that is.
constexpr int kBucketShift = 5;
constexpr std::uint32_t kMaxCost = kAnyCost;
// How far a search goes on in a tile that it comes back to, beyond what the others have come to, as
// to come back again would cost more.
constexpr std::uint32_t kPatience = 32 * kCostPerCell;
constexpr std::uint32_t kLargeSlack = 100;  // large searches may cost 1/100 more than the cheapest
// How many times as long as the straight way one may be that a corridor is looked for.
constexpr std::uint32_t kMostDetour = 4;
// What is queued is looked through once it is more: most of it waits for a turn at which its patch
// has been expanded long before.
constexpr std::size_t kMostQueued = std::size_t{1} << 20;
// No move costs less: along an axis, along a diagonal.
constexpr std::array<std::uint32_t, 2> kLeastCost = {kCostPerCell, kCostPerDiagonal};

// `kByClass`: moves cost by the classes of both ends too; otherwise nobody asks for classes.
template <typename Bound, bool kByClass>
class Search {
 public:
  Search(SearchSpace& space, SearchWorkspace& workspace, Bound bound, const Stop& stop)
      : space_(space),
        step_costs_(space.step_costs()),
        workspace_(workspace),
        bound_(bound),
        stop_(stop) {}

  // Expands until `goal` (kNoPatchId: nothing) is settled or nothing is left of what may lie on a
  // path that costs less than `below`. The workspace has begun.
  absl::StatusOr<SearchOutcome> Run(PatchId start,
                                    PatchId goal,
                                    std::uint64_t max_expanded,
                                    std::uint32_t below = kMaxCost) {
    start_ = start;
    goal_ = goal;
    goal_cost_ = below;
    max_expanded_ = max_expanded;
    const int slot = space_.SlotOf(start);
    STRATA_RETURN_IF_ERROR(TakeIn(space_.slots()[slot].key));
    if (outcome_.end != SearchOutcome::End::kFull) {
      EnterSlot(slot);
      large_ = workspace_.IsLarge(Remaining(start - base_) / kCostPerCell);
      Relax(start - base_, 0, 0);
      STRATA_RETURN_IF_ERROR(ExpandAll());
    }
    if (outcome_.end != SearchOutcome::End::kExhausted) return outcome_;
    outcome_.dearest = dearest_;
    if (goal_cost_ < below) {
      outcome_.end = SearchOutcome::End::kFound;
      STRATA_RETURN_IF_ERROR(Backtrack());
    } else if (workspace_.budget() != nullptr) {
      while (!workspace_.at_hand().empty()) Park(workspace_.at_hand().back());
    }
    workspace_.EndSearch();
    return std::move(outcome_);
  }

 private:
  absl::Status ExpandAll() {
    BucketQueue& queue = workspace_.queue();
    while (!queue.empty() && outcome_.end == SearchOutcome::End::kExhausted) {
      if (queue.size() > most_queued_) {
        queue.Keep([this](std::uint32_t value) { return IsLeft(value); });
        most_queued_ = std::max(kMostQueued, 2 * queue.size());
        continue;
      }
      const PatchId patch = queue.Pop();
      if (goal_cost_ <= queue.lower_bound()) break;
      if (patch >= kFirstAwaited) {
        STRATA_RETURN_IF_ERROR(TakeInAwaited(awaited_[patch - kFirstAwaited]));
      } else if (workspace_.AtHand(space_.SlotOf(patch))) {
        STRATA_RETURN_IF_ERROR(ExpandOne(patch));
      }
    }
    return space_.status();
  }

  // Whether a value of the queue stands for a tile, or for a patch at hand that is not expanded.
  bool IsLeft(std::uint32_t value) {
    if (value >= kFirstAwaited) return true;
    const int slot = space_.SlotOf(value);
    if (!workspace_.AtHand(slot)) return false;
    const PatchId base = space_.slots()[slot].base;
    return (workspace_.member(slot).states[value - base] & kClosed) == 0;
  }

  absl::Status ExpandOne(PatchId patch) {
    if (!Expand(patch)) return absl::OkStatus();
    ++outcome_.expanded;
    if (outcome_.expanded >= max_expanded_) outcome_.end = SearchOutcome::End::kLimit;
    return outcome_.expanded % kExpansionsPerLook == 0 ? stop_.status() : absl::OkStatus();
  }

  // A tile whose turn it is, unless it came or was left for a later turn since.
  absl::Status TakeInAwaited(const TileKey& key) {
    const int slot = space_.SlotIfAny(key);
    if (slot >= 0 && workspace_.AtHand(slot)) return absl::OkStatus();
    const std::uint32_t lowest = workspace_.parked()[key].lowest;
    if (lowest >> kBucketShift > workspace_.queue().lower_bound() >> kBucketShift) {
      return absl::OkStatus();
    }
    return TakeIn(key);
  }

  // Takes a tile in, with what is known of it; kFull if there is no memory.
  absl::Status TakeIn(const TileKey& key) {
    STRATA_RETURN_IF_ERROR(stop_.status());
    const int slot = space_.SlotOf(key);
    STRATA_RETURN_IF_ERROR(space_.status());
    ParkedTile& parked = ParkedOf(key);
    parked.lowest = kMaxCost;
    if (slot < 0) return absl::OkStatus();
    const std::shared_ptr<const PreparedTile> tile = space_.At(slot).tile;
    STRATA_RETURN_IF_ERROR(space_.status());
    while (!workspace_.HasRoomFor(*tile)) {
      large_ = true;
      Park(workspace_.LongestUnused());
      if (workspace_.AccountParked()) continue;
      outcome_.end = SearchOutcome::End::kFull;
      return absl::OkStatus();
    }
    STRATA_RETURN_IF_ERROR(workspace_.Admit(slot, tile, stop_));
    slot_ = -1;  // members may have moved
    EnterSlot(slot);
    return SearchAgain(parked);
  }

  // Goes on from the costs at the border of the tile entered, up to where the search has come. What
  // was reached in it is reached again, at no higher cost: the ways back stay ways back.
  absl::Status SearchAgain(ParkedTile& parked) {
    std::vector<std::pair<std::uint32_t, std::uint32_t>> order;  // total, place
    const auto take = [&](const TileEntry& entry, std::uint32_t cost, std::uint32_t place) {
      const std::uint32_t remaining = Remaining(place);
      if (cost >= costs_[place] || remaining == kNoUse) return;
      costs_[place] = cost;
      states_[place] = entry.direction;
      if (base_ + place == goal_) goal_cost_ = std::min(goal_cost_, cost);
      order.emplace_back(cost + remaining, place);
    };
    for (const TileEntry& entry : parked.known) {
      const std::uint32_t place = index_->Place(entry.cell, entry.level);
      if (entry.cost != kMaxCost && place != PatchIndex::kNone) take(entry, entry.cost, place);
    }
    for (const TileEntry& entry : parked.offers) {
      const std::uint32_t place = index_->Place(entry.cell, entry.level);
      if (place == PatchIndex::kNone) continue;
      const std::uint8_t to = ClassOf(place);
      if (kByClass && space_.classes().Forbidden(to)) continue;
      take(entry, entry.cost + MoveBetween(entry.class_id, to, entry.move), place);
    }
    parked.offers = {};
    std::sort(order.begin(), order.end());
    again_slot_ = slot_;
    again_directions_ = std::move(parked.directions);
    again_end_ = workspace_.queue().lower_bound() + (again_directions_.empty() ? 0 : kPatience);
    again_.Clear(kBucketShift);
    for (const auto& [total, place] : order) Enqueue(total, place);
    while (!again_.empty() && outcome_.end == SearchOutcome::End::kExhausted) {
      STRATA_RETURN_IF_ERROR(ExpandOne(again_.Pop()));
    }
    again_slot_ = -1;
    return absl::OkStatus();
  }

  // Keeps of a tile at hand what is needed to go on in it later, and lets go of it.
  void Park(int slot) {
    EnterSlot(slot);
    ParkedTile& parked = ParkedOf(tile_->key);
    parked.directions.assign((index_->size() + 1) / 2, ParkedTile::kNoDirections);
    index_->ForEach([&](std::uint32_t place, std::uint32_t number) {
      if (costs_[place] == kUnreached) return;
      parked.SetDirection(number, states_[place] & 7U);
      if ((states_[place] & kClosed) != 0) return;
      parked.lowest = std::min(parked.lowest, costs_[place] + Remaining(place));
    });
    ParkBorder(parked);
    Await(parked);
    workspace_.Dismiss(slot);
    slot_ = -1;
  }

  // Has the tile taken in when its turn comes.
  void Await(ParkedTile& parked) {
    if (parked.lowest >= std::min(goal_cost_, kMaxCost)) return;
    workspace_.queue().Push(parked.lowest, kFirstAwaited + parked.awaited);
  }
  // What is known of a tile that is not at hand.
  ParkedTile& ParkedOf(const TileKey& key) {
    ParkedTile& parked = workspace_.parked()[key];
    if (parked.awaited == ParkedTile::kNotAwaited) {
      parked.awaited = static_cast<std::uint32_t>(awaited_.size());
      awaited_.push_back(key);
    }
    return parked;
  }

  void ParkBorder(ParkedTile& parked) {
    parked.known.clear();
    std::uint32_t last = PatchIndex::kNone;
    for (const FarMove& move : tile_->far_moves) {
      if (move.place == last) continue;
      last = move.place;
      Know(parked, last);
    }
    if (start_ >= base_ && start_ - base_ < index_->places()) Know(parked, start_ - base_);
    std::sort(parked.known.begin(), parked.known.end(), BeforeInTile);
    parked.known.shrink_to_fit();
  }

  // Classes forbid places that nobody has reached: they are known, too, to be refused.
  void Know(ParkedTile& parked, std::uint32_t place) {
    const bool reached = costs_[place] != kUnreached;
    if (!reached && !kByClass) return;
    parked.known.push_back({.cost = reached ? costs_[place] : kMaxCost,
                            .cell = index_->CellOf(place),
                            .level = static_cast<std::uint8_t>(index_->LevelOf(place)),
                            .direction = static_cast<std::uint8_t>(states_[place] & 7U),
                            .class_id = ClassOf(place)});
  }

  static bool BeforeInTile(const TileEntry& a, const TileEntry& b) {
    return a.cell != b.cell ? a.cell < b.cell : a.level < b.level;
  }

  // Whether a way into a tile that is not at hand may be of use; then `total` is what a path by it
  // costs at least.
  bool MayHelp(const TileEntry& entry,
               CellIndex cell,
               const ParkedTile& parked,
               std::uint32_t* total) const {
    const auto known =
        std::lower_bound(parked.known.begin(), parked.known.end(), entry, BeforeInTile);
    std::uint32_t cost = entry.cost + MoveBetween(entry.class_id, 0, entry.move);
    if (known != parked.known.end() && !BeforeInTile(entry, *known)) {
      if (kByClass && space_.classes().Forbidden(known->class_id)) return false;
      cost = entry.cost + MoveBetween(entry.class_id, known->class_id, entry.move);
      if (cost >= known->cost) return false;
    }
    const std::uint32_t remaining = bound_.Outside(cell);
    if (remaining == kNoUse) return false;
    *total = cost + Weighted(remaining);
    return *total < goal_cost_ && *total < kMaxCost;
  }

  void EnterSlot(int slot) {
    if (slot == slot_) return;
    slot_ = slot;
    const SearchSpace::Slot& s = space_.slots()[slot];
    SearchWorkspace::Member& member = workspace_.member(slot);
    tile_ = member.tile.get();
    index_ = &tile_->standing;
    member.last_used = ++uses_;
    base_ = s.base;
    x0_ = s.x0;
    y0_ = s.y0;
    costs_ = member.costs.data();
    states_ = member.states.data();
    bound_.Enter(slot, s);
  }

  // Offers a way to a patch of the slot entered.
  void Relax(std::uint32_t place, std::uint32_t cost, int direction) {
    if (cost >= costs_[place]) return;
    const std::uint32_t remaining = Remaining(place);
    if (remaining == kNoUse) return;
    costs_[place] = cost;
    states_[place] = static_cast<std::uint8_t>(direction);
    if (base_ + place == goal_) goal_cost_ = std::min(goal_cost_, cost);
    Enqueue(cost + remaining, place);
  }

  void Enqueue(std::uint32_t total, std::uint32_t place) {
    const bool again = slot_ == again_slot_;
    if (again && WasReached(place)) {
      again_.Push(total, base_ + place);
      return;
    }
    if (total >= goal_cost_ || total >= kMaxCost) return;
    (again && total < again_end_ ? again_ : workspace_.queue()).Push(total, base_ + place);
  }
  // Before the tile that is searched again was parked.
  bool WasReached(std::uint32_t place) const {
    return !again_directions_.empty() &&
           ParkedTile::DirectionOf(again_directions_, index_->Number(place)) !=
               ParkedTile::kUnreached;
  }

  std::uint32_t Remaining(std::uint32_t place) const {
    const std::uint16_t cell = index_->CellOf(place);
    const CellIndex at = {x0_ + (cell & (kTileCells - 1)), y0_ + (cell >> kTileShift)};
    const std::uint32_t bound = bound_(at.x, at.y);
    return large_ && bound != kNoUse ? Weighted(bound) : bound;
  }
  // What is left out for g + 1.01 h ≥ goal lies on no path of less than goal / 1.01.
  static std::uint32_t Weighted(std::uint32_t bound) {
    return Bound::kMayWeigh ? bound + bound / kLargeSlack : bound;
  }

  // False if the patch was expanded before.
  bool Expand(PatchId patch) {
    EnterSlot(space_.SlotOf(patch));
    const std::uint32_t place = patch - base_;
    const std::uint8_t state = states_[place];
    if ((state & kClosed) != 0) return false;
    states_[place] = state | kClosed;
    const std::uint32_t cost = costs_[place];
    if (cost >= dearest_cost_) {
      dearest_cost_ = cost;
      dearest_ = patch;
    }
    const std::uint8_t own_class = ClassOf(place);
    const std::uint32_t number = index_->Number(place);
    const unsigned moves = tile_->patches[number].moves;
    // Not back to where it was reached from.
    for (unsigned left = cost == 0 ? moves : moves & ~Back(state); left != 0; left &= left - 1) {
      const int k = std::countr_zero(left);
      int cells = 0;
      const std::uint32_t to = tile_->Target(place, number, k, &cells);
      // Most are behind.
      if (costs_[to] <= cost + kLeastCost[k & 1]) continue;
      const std::uint32_t move = tile_->Cost(step_costs_, number, index_->Number(to), k, cells);
      RelaxMove(own_class, to, cost, move, k);
    }
    if (moves != kAllMoves && tile_->HasFarMoves(place)) ExpandFar(place, cost, own_class);
    return true;
  }
  static unsigned Back(std::uint8_t state) { return 1U << ((state & 7U) ^ 4U); }

  // Offers a way to a patch of the slot entered by a move from a patch of class `from`.
  void RelaxMove(
      std::uint8_t from, std::uint32_t place, std::uint32_t cost, std::uint32_t move, int k) {
    if constexpr (kByClass) {
      const std::uint8_t to = ClassOf(place);
      if (space_.classes().Forbidden(to)) return;
      move = space_.classes().Scaled(move, from, to);
    }
    Relax(place, cost + move, k);
  }
  std::uint8_t ClassOf(std::uint32_t place) const {
    return kByClass ? tile_->ClassOf(index_->Number(place)) : std::uint8_t{0};
  }
  std::uint32_t MoveBetween(std::uint8_t from, std::uint8_t to, std::uint32_t move) const {
    return kByClass ? space_.classes().Scaled(move, from, to) : move;
  }

  void ExpandFar(std::uint32_t place, std::uint32_t cost, std::uint8_t own_class) {
    const int slot = slot_;
    const std::vector<FarMove>& moves = tile_->far_moves;
    const std::uint16_t cell = index_->CellOf(place);
    const CellIndex from = {x0_ + (cell & (kTileCells - 1)), y0_ + (cell >> kTileShift)};
    for (std::size_t i = tile_->FirstFarMove(place); i < moves.size(); ++i) {
      const FarMove& move = moves[i];
      if (move.place != place) return;
      const int k = move.direction;
      const CellIndex to = {from.x + move.cells * kStepX[k], from.y + move.cells * kStepY[k]};
      const TileEntry entry = {.cost = cost,
                               .move = move.cost,
                               .cell = CellInTile(to),
                               .level = move.level,
                               .direction = move.direction,
                               .class_id = own_class};
      if (EnterTile(to, entry)) {
        const std::uint32_t there = index_->Place(entry.cell, entry.level);
        if (there != PatchIndex::kNone) {
          RelaxMove(own_class, there, cost, move.cost, k);
        }
      }
      EnterSlot(slot);
    }
  }

  // Enters the tile of a cell that a move leads to, if it is at hand; else the tile is told of the
  // way.
  bool EnterTile(CellIndex cell, const TileEntry& entry) {
    const TileKey key = TileOfCell(cell);
    const int slot = space_.SlotIfAny(key);
    if (slot >= 0 && workspace_.AtHand(slot)) {
      EnterSlot(slot);
      return true;
    }
    ParkedTile& parked = ParkedOf(key);
    std::uint32_t total = 0;
    if (!MayHelp(entry, cell, parked, &total)) return false;
    parked.offers.push_back(entry);
    if (total < parked.lowest) {
      parked.lowest = total;
      Await(parked);
    }
    return false;
  }

  // Moves are symmetric: back by the opposite of the direction a patch was reached by.
  absl::Status Backtrack() {
    std::vector<PatchId>& path = outcome_.path;
    path = {goal_};
    while (path.back() != start_) {
      if (path.size() % kExpansionsPerLook == 0) STRATA_RETURN_IF_ERROR(stop_.status());
      const int slot = space_.SlotOf(path.back());
      const SearchSpace::Slot& s = space_.At(slot);
      STRATA_RETURN_IF_ERROR(space_.status());
      const int direction = workspace_.DirectionOf(slot, *s.tile, path.back() - s.base);
      std::uint32_t cost = 0;
      int cells = 0;
      const PatchId back = space_.Follow(path.back(), direction ^ 4, &cost, &cells);
      STRATA_RETURN_IF_ERROR(space_.status());
      // Whatever bytes a tile was made from.
      if (back == kNoPatchId || path.size() > outcome_.expanded) {
        return absl::DataLossError(absl::StrCat(
            "prepared tile ", s.key.ToString(), ": a move does not lead back; rebuild the map"));
      }
      path.push_back(back);
      outcome_.cost += cost;
    }
    std::reverse(path.begin(), path.end());
    return absl::OkStatus();
  }

  static constexpr std::uint32_t kUnreached = SearchWorkspace::Member::kUnreached;
  static constexpr std::uint8_t kClosed = SearchWorkspace::Member::kClosed;
  static constexpr unsigned kAllMoves = 0xFF;
  // From here on the queue's values are tiles.
  static constexpr std::uint32_t kFirstAwaited = kMaxPatchIds;

  SearchSpace& space_;
  const StepCosts& step_costs_;
  SearchWorkspace& workspace_;
  Bound bound_;
  const Stop& stop_;
  SearchOutcome outcome_;
  std::uint64_t max_expanded_ = 0;
  PatchId start_ = kNoPatchId;
  PatchId goal_ = kNoPatchId;
  std::uint32_t goal_cost_ = kMaxCost;
  bool large_ = false;            // more than what may be at hand
  std::vector<TileKey> awaited_;  // by ParkedTile::awaited
  // The queue of the tile that is searched again, emptied before the rest of the search goes on.
  BucketQueue again_;
  std::size_t most_queued_ = kMostQueued;
  int again_slot_ = -1;
  std::uint32_t again_end_ = 0;
  std::vector<std::uint8_t> again_directions_;  // ParkedTile::directions
  PatchId dearest_ = kNoPatchId;
  std::uint32_t dearest_cost_ = 0;
  // The slot entered.
  int slot_ = -1;
  std::uint64_t uses_ = 0;
  const PreparedTile* tile_ = nullptr;
  const PatchIndex* index_ = nullptr;  // of its patches
  PatchId base_ = 0;
  std::int32_t x0_ = 0;
  std::int32_t y0_ = 0;
  std::uint32_t* costs_ = nullptr;
  std::uint8_t* states_ = nullptr;
};

template <typename Bound>
absl::StatusOr<SearchOutcome> RunSearch(SearchSpace& space,
                                        SearchWorkspace& workspace,
                                        const Bound& bound,
                                        PatchId start,
                                        PatchId goal,
                                        std::uint64_t max_expanded,
                                        const Stop& stop,
                                        std::uint32_t below = kMaxCost) {
  if (space.classes().plain()) {
    return Search<Bound, false>(space, workspace, bound, stop)
        .Run(start, goal, max_expanded, below);
  }
  return Search<Bound, true>(space, workspace, bound, stop).Run(start, goal, max_expanded, below);
}

// A path, or none, that costs at most 1 % more than the cheapest: that of a corridor, unless
// another one is cheaper by more. kFull where that cannot be told.
absl::StatusOr<SearchOutcome> FindBelow(SearchSpace& space,
                                        const Corridor& corridor,
                                        PatchId start,
                                        PatchId goal,
                                        std::uint64_t max_expanded,
                                        SearchWorkspace& workspace,
                                        const Stop& stop) {
  SearchOutcome none;
  none.end = SearchOutcome::End::kFull;
  STRATA_ASSIGN_OR_RETURN(SearchOutcome found,
                          RunSearch(space,
                                    workspace,
                                    CorridorBound(corridor),
                                    start,
                                    goal,
                                    max_expanded,
                                    stop,
                                    corridor.limit()));
  none.expanded = found.expanded;
  if (found.end == SearchOutcome::End::kLimit) return found;
  if (found.end != SearchOutcome::End::kFound) return none;
  const std::uint32_t below = found.cost - found.cost / (kLargeSlack + 1);
  if (below <= corridor.least_cost()) return found;
  STRATA_RETURN_IF_ERROR(workspace.BeginLarge(kBucketShift, stop));
  STRATA_ASSIGN_OR_RETURN(SearchOutcome better,
                          RunSearch(space,
                                    workspace,
                                    BlockBound(corridor, {space.CellOfPatch(goal)}),
                                    start,
                                    goal,
                                    max_expanded - found.expanded,
                                    stop,
                                    below));
  better.expanded += found.expanded;
  if (better.end != SearchOutcome::End::kExhausted) return better;
  found.expanded = better.expanded;
  return found;
}

// The same for a way that may be long; kFull also where no corridor leads along it.
absl::StatusOr<SearchOutcome> FindInCorridor(SearchSpace& space,
                                             PatchId start,
                                             PatchId goal,
                                             std::uint64_t max_expanded,
                                             SearchWorkspace& workspace,
                                             const Stop& stop) {
  SearchOutcome none;
  none.end = SearchOutcome::End::kFull;
  const CellIndex from = space.CellOfPatch(start);
  const CellIndex to = space.CellOfPatch(goal);
  if (!space.IsKept(TileOfCell(from)) || !space.IsKept(TileOfCell(to))) return none;
  STRATA_RETURN_IF_ERROR(workspace.BeginLarge(kBucketShift, stop));
  STRATA_ASSIGN_OR_RETURN(
      const std::optional<Corridor> corridor,
      Corridor::Find([&space](const TileKey& key) { return space.KeptDangers(key); },
                     from,
                     to,
                     space.checks().GapCells(1),
                     workspace.large_share(),
                     stop));
  if (!corridor.has_value() || !workspace.IsLarge(corridor->least_cost() / kCostPerCell)) {
    return none;
  }
  return FindBelow(space, *corridor, start, goal, max_expanded, workspace, stop);
}

}  // namespace

absl::StatusOr<SearchOutcome> FindPath(SearchSpace& space,
                                       PatchId start,
                                       PatchId goal,
                                       std::uint64_t max_expanded,
                                       SearchWorkspace& workspace,
                                       const Stop& stop) {
  const OctileBound bound{space.CellOfPatch(goal)};
  SearchOutcome first;
  const std::uint64_t cells = bound.Outside(space.CellOfPatch(start)) / kCostPerCell;
  if (workspace.IsLarge(kMostDetour * cells)) {
    STRATA_ASSIGN_OR_RETURN(first,
                            FindInCorridor(space, start, goal, max_expanded, workspace, stop));
    if (first.end != SearchOutcome::End::kFull) return first;
  }
  STRATA_RETURN_IF_ERROR(workspace.Begin(kBucketShift, stop));
  STRATA_ASSIGN_OR_RETURN(
      SearchOutcome outcome,
      RunSearch(space, workspace, bound, start, goal, max_expanded - first.expanded, stop));
  outcome.expanded += first.expanded;
  return outcome;
}

absl::StatusOr<PatchId> ReachAll(SearchSpace& space,
                                 PatchId start,
                                 SearchWorkspace& workspace,
                                 const Stop& stop,
                                 std::uint32_t below) {
  STRATA_RETURN_IF_ERROR(workspace.Begin(kBucketShift, stop));
  STRATA_ASSIGN_OR_RETURN(
      const SearchOutcome outcome,
      RunSearch(space, workspace, NoBound{}, start, kNoPatchId, UINT64_MAX, stop, below));
  return outcome.dearest;
}

}  // namespace strata
