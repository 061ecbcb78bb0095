#include "core/planning/search.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/common/status.h"
#include "core/common/stop.h"
#include "core/mls/tile_key.h"
#include "core/planning/ground_window.h"
#include "core/planning/landmarks.h"
#include "core/planning/prepared_tile.h"
#include "core/planning/search_space.h"

namespace strata {
namespace {

constexpr std::uint64_t kExpansionsPerLook = 4096;  // at the clock
// Buckets of 1/64 of a cell, measured: wide ones keep the ring in the processor's cache, but expand
// again what a bad order within a bucket made too dear; the tighter the bound, the more that is.
constexpr int kBucketShift = 5;
constexpr std::uint32_t kMaxCost = 0xF0000000U;
// Beyond the cheapest that is left elsewhere: how far a search goes on with the tiles at hand, as a
// tile that it comes back to is searched again.
constexpr std::uint32_t kPatience = 128 * kCostPerCell;
constexpr std::uint32_t kLargeSlack = 100;  // large searches may cost 1/100 more than the cheapest
// Of the budget: what every search has at once, and what a large one waits for, the tiles that it
// parks included.
constexpr std::size_t kSmallShare = 32;
constexpr std::size_t kLargeSixteenths = 3;
// Of a patch at hand, however its tile's memory came about: a path must not depend on that.
constexpr std::size_t kPatchBytes = 45 + sizeof(SearchNode);

// Cost of the shortest way over cells without danger; consistent, since a move of any length costs
// at least as much.
struct OctileBound {
  CellIndex goal;

  void Enter(int /*slot*/, const SearchSpace::Slot& /*s*/) {}
  std::uint32_t operator()(std::int32_t x, std::int32_t y, std::uint32_t /*local*/) const {
    const auto dx = static_cast<std::uint32_t>(std::abs(x - goal.x));
    const auto dy = static_cast<std::uint32_t>(std::abs(y - goal.y));
    return kCostPerCell * (std::max(dx, dy) - std::min(dx, dy)) +
           kCostPerDiagonal * std::min(dx, dy);
  }
  // Of a tile that is not at hand.
  std::uint32_t Outside(CellIndex cell) const { return (*this)(cell.x, cell.y, 0); }
};

struct NoBound {
  void Enter(int /*slot*/, const SearchSpace::Slot& /*s*/) {}
  std::uint32_t operator()(std::int32_t /*x*/, std::int32_t /*y*/, std::uint32_t /*local*/) const {
    return 0;
  }
  std::uint32_t Outside(CellIndex /*cell*/) const { return 0; }
};

// |d(landmark, patch) − d(landmark, goal)| never exceeds the cost between patch and goal. Of all
// landmarks the few that say most about the way from start to goal are asked.
class LandmarkBound {
 public:
  // REQUIRES: Measured(), for start and goal.
  LandmarkBound(SearchSpace& space, const Landmarks& landmarks, PatchId start, PatchId goal)
      : octile_{space.CellOfPatch(goal)}, landmarks_(landmarks) {
    std::array<std::pair<std::uint32_t, int>, kMaxLandmarks> order;  // bound at the start, landmark
    for (int l = 0; l < landmarks.count(); ++l) {
      order[l] = {Apart(Cost(space, landmarks, start, l), Cost(space, landmarks, goal, l)), l};
    }
    std::sort(order.begin(), order.begin() + landmarks.count(), std::greater<>());
    for (int i = 0; i < kAsked; ++i) {
      asked_[i] = order[std::min(i, landmarks.count() - 1)].second;
      goal_costs_[i] = Cost(space, landmarks, goal, asked_[i]);
    }
  }

  static bool Measured(SearchSpace& space, const Landmarks& landmarks, PatchId patch) {
    return landmarks.Tile(space.slots()[space.SlotOf(patch)].key) != nullptr &&
           Cost(space, landmarks, patch, 0) != Landmarks::kUnreached;
  }

  void Enter(int slot, const SearchSpace::Slot& s) {
    if (static_cast<std::size_t>(slot) >= of_slot_.size()) of_slot_.resize(slot + 1, nullptr);
    // Never nullptr: the start is connected to the landmarks, and so is what a search enters.
    if (of_slot_[slot] == nullptr) of_slot_[slot] = landmarks_.Tile(s.key);
    for (int i = 0; i < kAsked; ++i) {
      costs_[i] = of_slot_[slot] + static_cast<std::size_t>(s.size) * asked_[i];
    }
  }
  std::uint32_t operator()(std::int32_t x, std::int32_t y, std::uint32_t local) const {
    std::uint32_t bound = octile_(x, y, local);
    for (int i = 0; i < kAsked; ++i) {
      bound = std::max(bound, Apart(costs_[i][local], goal_costs_[i]));
    }
    return bound;
  }
  std::uint32_t Outside(CellIndex cell) const { return octile_.Outside(cell); }

 private:
  static constexpr int kAsked = 4;

  static std::uint32_t Apart(std::uint32_t a, std::uint32_t b) { return a > b ? a - b : b - a; }
  static std::uint32_t Cost(SearchSpace& space, const Landmarks& landmarks, PatchId patch, int l) {
    const SearchSpace::Slot& slot = space.slots()[space.SlotOf(patch)];
    return landmarks.Tile(slot.key)[std::size_t{slot.size} * l + patch - slot.base];
  }

  OctileBound octile_;
  const Landmarks& landmarks_;
  std::array<int, kAsked> asked_;
  std::array<std::uint32_t, kAsked> goal_costs_;
  std::vector<const std::uint32_t*> of_slot_;
  std::array<const std::uint32_t*, kAsked> costs_{};  // of the tile entered
};

// `kByClass`: moves cost by the classes of both ends too; otherwise nobody asks for classes.
template <typename Bound, bool kByClass>
class Search {
 public:
  Search(SearchSpace& space, SearchWorkspace& workspace, Bound bound, const Stop& stop)
      : space_(space), workspace_(workspace), bound_(bound), stop_(stop) {}

  // Expands until `goal` (kNoPatchId: nothing) is settled or nothing is left.
  absl::StatusOr<SearchOutcome> Run(PatchId start, PatchId goal, std::uint64_t max_expanded) {
    STRATA_RETURN_IF_ERROR(workspace_.Begin(kBucketShift, stop_));
    start_ = start;
    goal_ = goal;
    if (!Join(space_.slots()[space_.SlotOf(start)].key)) return Failure();
    Relax(start - base_, 0, 0);
    if (start == goal) goal_cost_ = 0;
    while (true) {
      STRATA_RETURN_IF_ERROR(ExpandAtHand(max_expanded));
      if (outcome_.end == SearchOutcome::End::kLimit) return outcome_;
      if (workspace_.budget() == nullptr) break;
      Park();
      if (!workspace_.AccountParked()) {
        outcome_.end = SearchOutcome::End::kFull;
        return outcome_;
      }
      const TileKey* const next = MostPromising();
      if (next == nullptr) break;
      large_ = true;
      workspace_.queue().Clear(kBucketShift);
      if (!Join(TileKey(*next))) return Failure();
    }
    workspace_.EndSearch();
    outcome_.dearest = dearest_;
    if (goal_cost_ != kMaxCost) {
      outcome_.end = SearchOutcome::End::kFound;
      STRATA_RETURN_IF_ERROR(Backtrack());
    }
    return std::move(outcome_);
  }

 private:
  // Until nothing is left of the tiles at hand.
  absl::Status ExpandAtHand(std::uint64_t max_expanded) {
    BucketQueue& queue = workspace_.queue();
    while (!queue.empty()) {
      const PatchId patch = queue.Pop();
      if (std::min(goal_cost_, Elsewhere()) <= queue.lower_bound()) {
        if (!any_again_) break;
        if (!workspace_.member(space_.SlotOf(patch)).again) continue;
      }
      if (!Expand(patch)) continue;
      ++outcome_.expanded;
      if (outcome_.expanded % kExpansionsPerLook == 0) STRATA_RETURN_IF_ERROR(stop_.status());
      if (failed_) return Failure();
      if (outcome_.expanded >= max_expanded) {
        outcome_.end = SearchOutcome::End::kLimit;
        break;
      }
    }
    return space_.status();
  }

  // From which total cost on tiles that are not at hand are more promising. Tiles that are searched
  // again are so to the end.
  std::uint32_t Elsewhere() const {
    return lowest_parked_ < kMaxCost ? lowest_parked_ + kPatience : kMaxCost;
  }

  absl::Status Failure() const { return space_.status().ok() ? status_ : space_.status(); }

  // Takes a tile in, with what is known of it; false if that fails. Enters it.
  bool Join(const TileKey& key) {
    const int slot = space_.SlotOf(key);
    if (slot >= 0) {
      status_ = stop_.status();
      if (status_.ok()) status_ = workspace_.Admit(slot, space_.At(slot).tile, stop_);
    }
    failed_ = slot < 0 || !status_.ok() || !space_.status().ok();
    if (failed_) return false;
    const auto parked = workspace_.parked().find(key);
    if (parked == workspace_.parked().end()) {
      EnterSlot(slot);
      return true;
    }
    workspace_.member(slot).again = !parked->second.directions.empty();
    any_again_ = any_again_ || workspace_.member(slot).again;
    EnterSlot(slot);
    TakeOffers(parked->second);
    return true;
  }

  // Goes on from the costs that a tile had when it was left, and from what was offered since.
  void TakeOffers(ParkedTile& parked) {
    std::vector<std::pair<std::uint32_t, std::uint32_t>> order;  // total, patch
    const auto take = [&](const TileEntry& entry, std::uint32_t cost, std::uint32_t patch) {
      SearchNode& node = nodes_[patch];
      if ((node.stamp & SearchNode::kReached) != 0 && cost >= node.cost) return;
      node = {cost, SearchNode::kReached | entry.direction};
      if (base_ + patch == goal_) goal_cost_ = std::min(goal_cost_, cost);
      order.emplace_back(cost + Remaining(patch), patch);
    };
    for (const TileEntry& entry : parked.known) {
      if (entry.cost != kMaxCost) take(entry, entry.cost, PatchOf(entry));
    }
    for (const TileEntry& entry : parked.offers) {
      const std::uint32_t patch = PatchOf(entry);
      const std::uint8_t to = tile_->ClassOf(patch);
      if (kByClass && space_.classes().Forbidden(to)) continue;
      take(entry, entry.cost + MoveBetween(entry.class_id, to, entry.move), patch);
    }
    parked.offers = {};
    parked.lowest = kMaxCost;
    lowest_parked_ = LowestParked();
    std::sort(order.begin(), order.end());
    for (const auto& [total, patch] : order) Enqueue(total, patch);
  }

  std::uint32_t PatchOf(const TileEntry& entry) const {
    std::uint32_t first = 0;
    std::uint32_t count = 0;
    tile_->FindCell(entry.cell, &first, &count);
    return first + entry.level;
  }

  // Keeps of the tiles at hand what is needed to go on in them later.
  void Park() {
    for (const int slot : workspace_.at_hand()) {
      EnterSlot(slot);
      ParkedTile& parked = workspace_.parked()[space_.slots()[slot].key];
      parked.directions.assign((tile_->size() + 1) / 2, 0);
      for (std::uint32_t patch = 0; patch < tile_->size(); ++patch) {
        const std::uint32_t stamp = nodes_[patch].stamp;
        if ((stamp & (SearchNode::kReached | SearchNode::kClosed)) == SearchNode::kReached) {
          parked.lowest = std::min(parked.lowest, nodes_[patch].cost + Remaining(patch));
        }
        const std::uint32_t direction =
            (stamp & SearchNode::kReached) != 0 ? stamp & 7U : ParkedTile::kUnreached;
        parked.directions[patch / 2] |= static_cast<std::uint8_t>(direction << (patch % 2 * 4));
      }
      ParkBorder(parked);
    }
    workspace_.Dismiss();
    lowest_parked_ = LowestParked();
    slot_ = -1;
    any_again_ = false;
  }

  void ParkBorder(ParkedTile& parked) {
    parked.known.clear();
    std::uint32_t last = PreparedTile::kNoPatch;
    for (const FarMove& move : tile_->far_moves) {
      if (move.patch == last) continue;
      last = move.patch;
      Know(parked, last);
    }
    if (start_ >= base_ && start_ - base_ < tile_->size()) Know(parked, start_ - base_);
    std::sort(parked.known.begin(), parked.known.end(), BeforeInTile);
    parked.known.shrink_to_fit();
  }

  // Classes forbid places that nobody has reached: they are known, too, to be refused.
  void Know(ParkedTile& parked, std::uint32_t patch) {
    const SearchNode& node = nodes_[patch];
    const bool reached = (node.stamp & SearchNode::kReached) != 0;
    if (!reached && !kByClass) return;
    std::uint32_t level = 0;
    while (level < patch && tile_->cell[patch - level - 1] == tile_->cell[patch]) ++level;
    parked.known.push_back({.cost = reached ? node.cost : kMaxCost,
                            .cell = tile_->cell[patch],
                            .level = static_cast<std::uint8_t>(level),
                            .direction = static_cast<std::uint8_t>(node.stamp & 7U),
                            .class_id = tile_->ClassOf(patch)});
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
    *total = cost + Weighted(bound_.Outside(cell));
    return *total < goal_cost_ && *total < kMaxCost;
  }

  // The tile with the cheapest offer or patch left to expand; nullptr if none can lead to a cheaper
  // path.
  const TileKey* MostPromising() const {
    const TileKey* best = nullptr;
    std::uint32_t lowest = goal_cost_;
    for (const auto& [key, parked] : workspace_.parked()) {
      if (parked.lowest > lowest || (parked.lowest == lowest && (best == nullptr || *best < key))) {
        continue;
      }
      best = &key;
      lowest = parked.lowest;
    }
    return best;
  }
  std::uint32_t LowestParked() const {
    std::uint32_t lowest = kMaxCost;
    for (const auto& [key, parked] : workspace_.parked()) lowest = std::min(lowest, parked.lowest);
    return lowest;
  }

  void EnterSlot(int slot) {
    if (slot == slot_) return;
    slot_ = slot;
    const SearchSpace::Slot& s = space_.slots()[slot];
    SearchWorkspace::Member& member = workspace_.member(slot);
    tile_ = member.tile.get();
    again_ = member.again;
    base_ = s.base;
    x0_ = s.x0;
    y0_ = s.y0;
    nodes_ = member.nodes.data();
    bound_.Enter(slot, s);
  }

  // Offers a way to patch `local` of the slot entered.
  void Relax(std::uint32_t local, std::uint32_t cost, int direction) {
    SearchNode& node = nodes_[local];
    if ((node.stamp & SearchNode::kReached) != 0 && cost >= node.cost) return;
    node.cost = cost;
    node.stamp = SearchNode::kReached | static_cast<std::uint32_t>(direction);
    if (base_ + local == goal_) goal_cost_ = std::min(goal_cost_, cost);
    Enqueue(cost + Remaining(local), local);
  }

  // A tile that is searched again is so as a whole: what was reached in it is reached again, at no
  // higher cost, and the ways back stay ways back.
  void Enqueue(std::uint32_t total, std::uint32_t local) {
    if ((total >= goal_cost_ && !again_) || total >= kMaxCost) return;
    workspace_.queue().Push(total, base_ + local);
    __builtin_prefetch(&tile_->moves[local]);  // what expanding it reads first
  }

  std::uint32_t Remaining(std::uint32_t local) const {
    const std::uint16_t cell = tile_->cell[local];
    const std::uint32_t bound =
        bound_(x0_ + (cell & (kTileCells - 1)), y0_ + (cell >> kTileShift), local);
    return large_ ? Weighted(bound) : bound;
  }
  // What is left out for g + 1.01 h ≥ goal lies on no path of less than goal / 1.01.
  static std::uint32_t Weighted(std::uint32_t bound) { return bound + bound / kLargeSlack; }

  // False if the patch was expanded before.
  bool Expand(PatchId patch) {
    EnterSlot(space_.SlotOf(patch));
    const std::uint32_t local = patch - base_;
    SearchNode& node = nodes_[local];
    if ((node.stamp & SearchNode::kClosed) != 0) return false;
    node.stamp |= SearchNode::kClosed;
    if (node.cost >= dearest_cost_) {
      dearest_cost_ = node.cost;
      dearest_ = patch;
    }
    const std::uint32_t cost = node.cost;
    const std::array<Move, 8>& moves = tile_->moves[local];
    const std::uint8_t own_class = kByClass ? tile_->ClassOf(local) : std::uint8_t{0};
    unsigned far = 0;
    for (int k = 0; k < 8; ++k) {
      const Move move = moves[k];
      if (move.cost == Move::kNone) continue;
      if (move.cost == Move::kFar) {
        far |= 1U << k;
        continue;
      }
      RelaxMove(own_class, local + move.delta, cost, move.cost, k);
    }
    if (far != 0) ExpandFar(local, cost, far);
    return true;
  }

  // Offers a way to patch `local` of the slot entered by a move from a patch of class `from`.
  void RelaxMove(
      std::uint8_t from, std::uint32_t local, std::uint32_t cost, std::uint32_t move, int k) {
    if constexpr (kByClass) {
      const std::uint8_t to = tile_->ClassOf(local);
      if (space_.classes().Forbidden(to)) return;
      move = space_.classes().Scaled(move, from, to);
    }
    Relax(local, cost + move, k);
  }
  std::uint32_t MoveBetween(std::uint8_t from, std::uint8_t to, std::uint32_t move) const {
    return kByClass ? space_.classes().Scaled(move, from, to) : move;
  }

  void ExpandFar(std::uint32_t local, std::uint32_t cost, unsigned directions) {
    const PreparedTile& tile = *tile_;
    const std::uint8_t own_class = kByClass ? tile.ClassOf(local) : std::uint8_t{0};
    const std::uint16_t cell = tile.cell[local];
    const CellIndex from = {x0_ + (cell & (kTileCells - 1)), y0_ + (cell >> kTileShift)};
    for (int k = 0; k < 8; ++k) {
      if ((directions >> k & 1U) == 0) continue;
      const FarMove& move = tile.Far(local, k);
      const CellIndex to = {from.x + move.cells * kStepX[k], from.y + move.cells * kStepY[k]};
      const TileEntry entry = {.cost = cost,
                               .move = move.cost,
                               .cell = CellInTile(to),
                               .level = move.level,
                               .direction = static_cast<std::uint8_t>(k),
                               .class_id = own_class};
      if (EnterTile(to, entry)) RelaxMove(own_class, PatchOf(entry), cost, move.cost, k);
      if (failed_) return;
    }
  }

  // Enters the tile of a cell that a move leads to, if it is at hand or is taken in for it; else
  // the tile is told of the way.
  bool EnterTile(CellIndex cell, const TileEntry& entry) {
    const TileKey key = TileOfCell(cell);
    const int slot = space_.SlotIfAny(key);
    if (slot >= 0 && workspace_.AtHand(slot)) {
      EnterSlot(slot);
      return true;
    }
    ParkedTile& parked = workspace_.parked()[key];
    std::uint32_t total = 0;
    if (!MayHelp(entry, cell, parked, &total)) return false;
    if (workspace_.HasRoom()) return Join(key);
    parked.offers.push_back(entry);
    parked.lowest = std::min(parked.lowest, total);
    lowest_parked_ = std::min(lowest_parked_, total);
    return false;
  }

  // Moves are symmetric: back by the opposite of the direction a patch was reached by.
  absl::Status Backtrack() {
    std::vector<PatchId>& path = outcome_.path;
    path = {goal_};
    while (path.back() != start_) {
      if (path.size() % kExpansionsPerLook == 0) STRATA_RETURN_IF_ERROR(stop_.status());
      const int slot = space_.SlotOf(path.back());
      const SearchSpace::Slot& s = space_.slots()[slot];
      const int direction = workspace_.DirectionOf(s, slot, path.back() - s.base);
      std::uint32_t cost = 0;
      int cells = 0;
      path.push_back(space_.Follow(path.back(), direction ^ 4, &cost, &cells));
      STRATA_RETURN_IF_ERROR(space_.status());
      outcome_.cost += cost;
    }
    std::reverse(path.begin(), path.end());
    return absl::OkStatus();
  }

  SearchSpace& space_;
  SearchWorkspace& workspace_;
  Bound bound_;
  const Stop& stop_;
  SearchOutcome outcome_;
  absl::Status status_;
  bool failed_ = false;  // a tile could not be had
  PatchId start_ = kNoPatchId;
  PatchId goal_ = kNoPatchId;
  std::uint32_t goal_cost_ = kMaxCost;
  std::uint32_t lowest_parked_ = kMaxCost;  // of what is left in tiles that are not at hand
  bool large_ = false;                      // more than what was at hand first
  bool any_again_ = false;                  // a tile at hand was there before
  PatchId dearest_ = kNoPatchId;
  std::uint32_t dearest_cost_ = 0;
  // The slot entered.
  int slot_ = -1;
  bool again_ = false;
  const PreparedTile* tile_ = nullptr;
  PatchId base_ = 0;
  std::int32_t x0_ = 0;
  std::int32_t y0_ = 0;
  SearchNode* nodes_ = nullptr;
};

template <typename Bound>
absl::StatusOr<SearchOutcome> RunSearch(SearchSpace& space,
                                        SearchWorkspace& workspace,
                                        const Bound& bound,
                                        PatchId start,
                                        PatchId goal,
                                        std::uint64_t max_expanded,
                                        const Stop& stop) {
  if (space.classes().plain()) {
    return Search<Bound, false>(space, workspace, bound, stop).Run(start, goal, max_expanded);
  }
  return Search<Bound, true>(space, workspace, bound, stop).Run(start, goal, max_expanded);
}

}  // namespace

absl::Status SearchWorkspace::Begin(int bucket_shift, const Stop& stop) {
  Dismiss();
  parked_.clear();
  AccountParked();
  queue_.Clear(bucket_shift);
  return budget_ == nullptr ? absl::OkStatus() : Exchange(budget_->max_bytes() / kSmallShare, stop);
}

// Whoever waits holds nothing: searches that wait for each other would wait for ever.
absl::Status SearchWorkspace::Exchange(std::size_t bytes, const Stop& stop) {
  budget_->Release(granted_);
  granted_ = 0;
  STRATA_RETURN_IF_ERROR(budget_->AwaitReserve(bytes, stop));
  granted_ = bytes;
  return absl::OkStatus();
}

absl::Status SearchWorkspace::Admit(int slot,
                                    std::shared_ptr<const PreparedTile> tile,
                                    const Stop& stop) {
  bytes_at_hand_ += tile->size() * kPatchBytes;
  if (budget_ != nullptr) {
    const std::size_t large = budget_->max_bytes() / 16 * kLargeSixteenths;
    if (bytes_at_hand_ > granted_ && granted_ < large) {
      STRATA_RETURN_IF_ERROR(Exchange(large, stop));
    }
  }
  if (static_cast<std::size_t>(slot) >= members_.size()) members_.resize(slot + 1);
  Member& member = members_[slot];
  if (!spare_.empty()) {
    member.nodes = std::move(spare_.back());
    spare_.pop_back();
  }
  member.nodes.assign(tile->size(), SearchNode{});
  member.tile = std::move(tile);
  at_hand_.push_back(slot);
  return absl::OkStatus();
}

void SearchWorkspace::Dismiss() {
  for (const int slot : at_hand_) {
    spare_.push_back(std::move(members_[slot].nodes));
    members_[slot] = {};
  }
  at_hand_.clear();
  bytes_at_hand_ = 0;
}

bool SearchWorkspace::AccountParked() {
  if (budget_ == nullptr) return true;
  std::size_t bytes = 0;
  for (const auto& [key, parked] : parked_) bytes += sizeof(parked) + parked.memory_bytes();
  // Some of it is in what large searches have.
  const std::size_t group = budget_->max_bytes() / 8;
  bytes -= std::min(bytes, granted_ > group ? granted_ - group : 0);
  if (bytes > granted_parked_) {
    if (!budget_->Reserve(bytes - granted_parked_)) return false;
  } else {
    budget_->Release(granted_parked_ - bytes);
  }
  granted_parked_ = bytes;
  return true;
}

void SearchWorkspace::EndSearch() {
  if (budget_ == nullptr) return;
  spare_ = {};
  queue_ = {};
  budget_->Release(granted_);
  granted_ = 0;
  AccountParked();
}

SearchWorkspace::~SearchWorkspace() {
  if (budget_ != nullptr) budget_->Release(granted_ + granted_parked_);
}

std::uint8_t SearchWorkspace::DirectionOf(const SearchSpace::Slot& slot,
                                          int number,
                                          std::uint32_t local) const {
  if (AtHand(number)) {
    const std::uint32_t stamp = members_[number].nodes[local].stamp;
    return (stamp & SearchNode::kReached) != 0 ? stamp & 7U : ParkedTile::kUnreached;
  }
  const auto found = parked_.find(slot.key);
  return found == parked_.end() || found->second.directions.empty()
             ? ParkedTile::kUnreached
             : found->second.DirectionOf(local);
}

absl::StatusOr<SearchOutcome> FindPath(SearchSpace& space,
                                       PatchId start,
                                       PatchId goal,
                                       const Landmarks* landmarks,
                                       std::uint64_t max_expanded,
                                       SearchWorkspace& workspace,
                                       const Stop& stop) {
  if (landmarks != nullptr && LandmarkBound::Measured(space, *landmarks, start) &&
      LandmarkBound::Measured(space, *landmarks, goal)) {
    const LandmarkBound bound(space, *landmarks, start, goal);
    return RunSearch(space, workspace, bound, start, goal, max_expanded, stop);
  }
  const OctileBound bound{space.CellOfPatch(goal)};
  return RunSearch(space, workspace, bound, start, goal, max_expanded, stop);
}

absl::StatusOr<PatchId> ReachAll(SearchSpace& space,
                                 PatchId start,
                                 SearchWorkspace& workspace,
                                 const Stop& stop) {
  STRATA_ASSIGN_OR_RETURN(
      const SearchOutcome outcome,
      RunSearch(space, workspace, NoBound{}, start, kNoPatchId, UINT64_MAX, stop));
  return outcome.dearest;
}

}  // namespace strata
