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

constexpr std::uint32_t kClosed = 8;
constexpr std::uint64_t kExpansionsPerLook = 4096;  // at the clock
// Buckets of 1/64 of a cell, measured: wide ones keep the ring in the processor's cache, but expand
// again what a bad order within a bucket made too dear; the tighter the bound, the more that is.
constexpr int kBucketShift = 5;
constexpr std::uint32_t kMaxCost = 0xF0000000U;

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
};

struct NoBound {
  void Enter(int /*slot*/, const SearchSpace::Slot& /*s*/) {}
  std::uint32_t operator()(std::int32_t /*x*/, std::int32_t /*y*/, std::uint32_t /*local*/) const {
    return 0;
  }
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

  // Expands until `goal` (kNoPatchId: nothing) is settled or the queue is empty.
  absl::StatusOr<SearchOutcome> Run(PatchId start, PatchId goal, std::uint64_t max_expanded) {
    workspace_.Begin(kBucketShift);
    goal_ = goal;
    EnterSlot(space_.SlotOf(start));
    Relax(start - base_, 0, 0);
    if (start == goal) goal_cost_ = 0;
    BucketQueue& queue = workspace_.queue();
    SearchOutcome outcome;
    while (!queue.empty()) {
      const PatchId patch = queue.Pop();
      if (goal_cost_ <= queue.lower_bound()) break;
      if (!Expand(patch)) continue;
      ++outcome.expanded;
      if (outcome.expanded % kExpansionsPerLook == 0) STRATA_RETURN_IF_ERROR(stop_.status());
      if (outcome.expanded >= max_expanded || workspace_.full()) {
        outcome.end = SearchOutcome::End::kLimit;
        return outcome;
      }
    }
    STRATA_RETURN_IF_ERROR(space_.status());
    outcome.dearest = dearest_;
    if (goal_cost_ != kMaxCost) {
      outcome.end = SearchOutcome::End::kFound;
      outcome.cost = goal_cost_;
      outcome.path = Backtrack(start, goal);
      STRATA_RETURN_IF_ERROR(space_.status());
    }
    return outcome;
  }

 private:
  void EnterSlot(int slot) {
    if (slot == slot_) return;
    slot_ = slot;
    const SearchSpace::Slot& s = space_.At(slot);
    tile_ = s.tile;
    base_ = s.base;
    x0_ = s.x0;
    y0_ = s.y0;
    nodes_ = workspace_.Nodes(slot, tile_->size());
    bound_.Enter(slot, s);
  }

  // Offers a way to patch `local` of the slot entered.
  void Relax(std::uint32_t local, std::uint32_t cost, int direction) {
    SearchNode& node = nodes_[local];
    if (workspace_.Reached(node) && cost >= node.cost) return;
    node.cost = cost;
    node.stamp = workspace_.Stamp(direction);
    const PatchId patch = base_ + local;
    if (patch == goal_) goal_cost_ = cost;
    const std::uint32_t total = cost + Remaining(local);
    if (total >= goal_cost_ || total >= kMaxCost) return;
    workspace_.queue().Push(total, patch);
    __builtin_prefetch(&tile_->moves[local]);  // what expanding it reads first
  }

  std::uint32_t Remaining(std::uint32_t local) const {
    const std::uint16_t cell = tile_->cell[local];
    return bound_(x0_ + (cell & (kTileCells - 1)), y0_ + (cell >> kTileShift), local);
  }

  // False if the patch was expanded before.
  bool Expand(PatchId patch) {
    EnterSlot(space_.SlotOf(patch));
    const std::uint32_t local = patch - base_;
    SearchNode& node = nodes_[local];
    if ((node.stamp & kClosed) != 0) return false;
    node.stamp |= kClosed;
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

  void ExpandFar(std::uint32_t local, std::uint32_t cost, unsigned directions) {
    const std::shared_ptr<const PreparedTile> tile = tile_;
    const std::uint8_t own_class = kByClass ? tile->ClassOf(local) : std::uint8_t{0};
    const std::uint16_t cell = tile->cell[local];
    const CellIndex from = {x0_ + (cell & (kTileCells - 1)), y0_ + (cell >> kTileShift)};
    for (int k = 0; k < 8; ++k) {
      if ((directions >> k & 1U) == 0) continue;
      const FarMove& move = tile->Far(local, k);
      const PatchId target = space_.Resolve(from, move);
      if (target == kNoPatchId) continue;
      EnterSlot(space_.SlotOf(target));
      RelaxMove(own_class, target - base_, cost, move.cost, k);
    }
  }

  // Moves are symmetric: back by the opposite of the direction a patch was reached by.
  std::vector<PatchId> Backtrack(PatchId start, PatchId goal) {
    std::vector<PatchId> path = {goal};
    while (path.back() != start) {
      EnterSlot(space_.SlotOf(path.back()));
      const int direction = static_cast<int>(nodes_[path.back() - base_].stamp & 7U);
      std::uint32_t cost = 0;
      int cells = 0;
      path.push_back(space_.Follow(path.back(), direction ^ 4, &cost, &cells));
    }
    std::reverse(path.begin(), path.end());
    return path;
  }

  SearchSpace& space_;
  SearchWorkspace& workspace_;
  Bound bound_;
  const Stop& stop_;
  PatchId goal_ = kNoPatchId;
  std::uint32_t goal_cost_ = kMaxCost;
  PatchId dearest_ = kNoPatchId;
  std::uint32_t dearest_cost_ = 0;
  // The slot entered.
  int slot_ = -1;
  std::shared_ptr<const PreparedTile> tile_;
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

void SearchWorkspace::Begin(int bucket_shift) {
  // 28 bits of generations; then all memories are wiped once.
  if (++generation_ >= 1U << 28) {
    for (std::vector<SearchNode>& nodes : nodes_)
      std::fill(nodes.begin(), nodes.end(), SearchNode{});
    generation_ = 1;
  }
  full_ = false;
  queue_.Clear(bucket_shift);
}

SearchWorkspace::~SearchWorkspace() {
  if (budget_ != nullptr) budget_->Release(memory_bytes());
}

SearchNode* SearchWorkspace::Nodes(int slot, std::uint32_t size) {
  if (static_cast<std::size_t>(slot) >= nodes_.size()) nodes_.resize(slot + 1);
  std::vector<SearchNode>& nodes = nodes_[slot];
  if (nodes.size() >= size) return nodes.data();
  const std::size_t more = (size - nodes.capacity()) * sizeof(SearchNode);
  if (budget_ != nullptr && !budget_->Reserve(more)) {
    full_ = true;
    spare_.resize(std::max<std::size_t>(spare_.size(), size));
    return spare_.data();
  }
  nodes.reserve(size);  // not more
  nodes.resize(size);
  return nodes.data();
}

const SearchNode* SearchWorkspace::NodesIfAny(int slot, std::uint32_t size) const {
  return static_cast<std::size_t>(slot) < nodes_.size() && nodes_[slot].size() >= std::max(size, 1U)
             ? nodes_[slot].data()
             : nullptr;
}

std::size_t SearchWorkspace::memory_bytes() const {
  std::size_t bytes = 0;
  for (const std::vector<SearchNode>& nodes : nodes_)
    bytes += nodes.capacity() * sizeof(SearchNode);
  return bytes;
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
