#include "core/planning/search.h"

#include <algorithm>
#include <cstdint>
#include <cstdlib>
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
// Widths of buckets, measured: wide ones stay in the processor's cache, but expand again what a bad
// order within a bucket made too dear; the tighter the bound, the more that is.
constexpr int kWideBuckets = 6;
constexpr int kNarrowBuckets = 2;
constexpr std::uint32_t kMaxCost = 0xF0000000U;

// Cost of the shortest way over cells without danger; consistent, since a move of any length costs
// at least as much.
struct OctileBound {
  static constexpr bool kKeep = false;  // as fast to compute as to read
  static constexpr int kBucketShift = kWideBuckets;
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
  static constexpr bool kKeep = false;
  static constexpr int kBucketShift = kWideBuckets;
  void Enter(int /*slot*/, const SearchSpace::Slot& /*s*/) {}
  std::uint32_t operator()(std::int32_t /*x*/, std::int32_t /*y*/, std::uint32_t /*local*/) const {
    return 0;
  }
};

// |d(landmark, patch) − d(landmark, goal)| never exceeds the cost between patch and goal.
class LandmarkBound {
 public:
  static constexpr bool kKeep = true;
  static constexpr int kBucketShift = kNarrowBuckets;

  LandmarkBound(CellIndex goal, const Landmarks& landmarks, const std::uint32_t* goal_costs)
      : octile_{goal}, landmarks_(landmarks), goal_costs_(goal_costs) {}

  void Enter(int slot, const SearchSpace::Slot& s) {
    if (static_cast<std::size_t>(slot) >= of_slot_.size()) of_slot_.resize(slot + 1, nullptr);
    if (of_slot_[slot] == nullptr) of_slot_[slot] = landmarks_.Tile(s.tile->key);
    costs_ = of_slot_[slot];
  }
  std::uint32_t operator()(std::int32_t x, std::int32_t y, std::uint32_t local) const {
    std::uint32_t bound = octile_(x, y, local);
    if (costs_ == nullptr) return bound;
    const int count = landmarks_.count();
    const std::uint32_t* costs = costs_ + static_cast<std::size_t>(local) * count;
    for (int l = 0; l < count; ++l) {
      const std::uint32_t a = costs[l];
      const std::uint32_t b = goal_costs_[l];
      if (a == Landmarks::kUnreached || b == Landmarks::kUnreached) continue;
      bound = std::max(bound, a > b ? a - b : b - a);
    }
    return bound;
  }

 private:
  OctileBound octile_;
  const Landmarks& landmarks_;
  const std::uint32_t* goal_costs_;
  std::vector<const std::uint32_t*> of_slot_;
  const std::uint32_t* costs_ = nullptr;  // of the tile entered
};

template <typename Bound>
class Search {
 public:
  Search(SearchSpace& space, SearchWorkspace& workspace, Bound bound, const Stop& stop)
      : space_(space), workspace_(workspace), bound_(bound), stop_(stop) {}

  // Expands until `goal` (kNoPatchId: nothing) is settled or the queue is empty.
  absl::StatusOr<SearchOutcome> Run(PatchId start, PatchId goal, std::uint64_t max_expanded) {
    workspace_.Begin(Bound::kBucketShift);
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
      if (outcome.expanded >= max_expanded) {
        outcome.end = SearchOutcome::End::kLimit;
        return outcome;
      }
    }
    STRATA_RETURN_IF_ERROR(space_.status());
    if (goal_cost_ != kMaxCost) {
      outcome.end = SearchOutcome::End::kFound;
      outcome.cost = goal_cost_;
      outcome.path = Backtrack(start, goal);
      STRATA_RETURN_IF_ERROR(space_.status());
    }
    return outcome;
  }

  PatchId dearest() const { return dearest_; }

 private:
  void EnterSlot(int slot) {
    if (slot == slot_) return;
    slot_ = slot;
    const SearchSpace::Slot& s = space_.slots()[slot];
    tile_ = s.tile.get();
    base_ = s.base;
    x0_ = s.x0;
    y0_ = s.y0;
    nodes_ = workspace_.Nodes(slot, tile_->size());
    if constexpr (Bound::kKeep) bounds_ = workspace_.Bounds(slot, tile_->size());
    bound_.Enter(slot, s);
  }

  // Offers a way to patch `local` of the slot entered.
  void Relax(std::uint32_t local, std::uint32_t cost, int direction) {
    SearchNode& node = nodes_[local];
    const bool reached = workspace_.Reached(node);
    if (reached && cost >= node.cost) return;
    if constexpr (Bound::kKeep) {
      if (!reached) bounds_[local] = Bounded(local);
    }
    node.cost = cost;
    node.stamp = workspace_.Stamp(direction);
    const PatchId patch = base_ + local;
    if (patch == goal_) goal_cost_ = cost;
    const std::uint32_t total = cost + Remaining(local);
    if (total >= goal_cost_ || total >= kMaxCost) return;
    workspace_.queue().Push(total, patch);
    __builtin_prefetch(&tile_->moves[local]);  // what expanding it reads first
  }

  std::uint32_t Bounded(std::uint32_t local) const {
    const std::uint16_t cell = tile_->cell[local];
    return bound_(x0_ + (cell & (kTileCells - 1)), y0_ + (cell >> kTileShift), local);
  }
  std::uint32_t Remaining(std::uint32_t local) const {
    if constexpr (Bound::kKeep) {
      return bounds_[local];
    } else {
      return Bounded(local);
    }
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
    unsigned far = 0;
    for (int k = 0; k < 8; ++k) {
      const Move move = moves[k];
      if (move.cost == Move::kNone) continue;
      if (move.cost == Move::kFar) {
        far |= 1U << k;
        continue;
      }
      Relax(local + move.delta, cost + move.cost, k);
    }
    if (far != 0) ExpandFar(local, cost, far);
    return true;
  }

  void ExpandFar(std::uint32_t local, std::uint32_t cost, unsigned directions) {
    const int own_slot = slot_;
    const PreparedTile& tile = *tile_;
    for (int k = 0; k < 8; ++k) {
      if ((directions >> k & 1U) == 0) continue;
      const FarMove& move = tile.Far(local, k);
      const PatchId target = space_.Resolve(space_.slots()[own_slot], move);
      if (target == kNoPatchId) continue;
      EnterSlot(space_.SlotOf(target));
      Relax(target - base_, cost + move.cost, k);
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
  const PreparedTile* tile_ = nullptr;
  PatchId base_ = 0;
  std::int32_t x0_ = 0;
  std::int32_t y0_ = 0;
  SearchNode* nodes_ = nullptr;
  std::uint32_t* bounds_ = nullptr;
};

}  // namespace

void SearchWorkspace::Begin(int bucket_shift) {
  // 28 bits of generations; then all memories are wiped once.
  if (++generation_ >= 1U << 28) {
    for (std::vector<SearchNode>& nodes : nodes_)
      std::fill(nodes.begin(), nodes.end(), SearchNode{});
    generation_ = 1;
  }
  queue_.Clear(bucket_shift);
}

SearchNode* SearchWorkspace::Nodes(int slot, std::uint32_t size) {
  if (static_cast<std::size_t>(slot) >= nodes_.size()) nodes_.resize(slot + 1);
  std::vector<SearchNode>& nodes = nodes_[slot];
  if (nodes.size() < size) nodes.resize(size);
  return nodes.data();
}

std::uint32_t* SearchWorkspace::Bounds(int slot, std::uint32_t size) {
  if (static_cast<std::size_t>(slot) >= bounds_.size()) bounds_.resize(slot + 1);
  std::vector<std::uint32_t>& bounds = bounds_[slot];
  if (bounds.size() < size) bounds.resize(size);
  return bounds.data();
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
  const CellIndex cell = space.CellOfPatch(goal);
  if (landmarks != nullptr) {
    const SearchSpace::Slot& slot = space.SlotOfPatch(goal);
    if (const std::uint32_t* costs = landmarks->Tile(slot.tile->key); costs != nullptr) {
      costs += static_cast<std::size_t>(goal - slot.base) * landmarks->count();
      return Search(space, workspace, LandmarkBound(cell, *landmarks, costs), stop)
          .Run(start, goal, max_expanded);
    }
  }
  return Search(space, workspace, OctileBound{cell}, stop).Run(start, goal, max_expanded);
}

absl::StatusOr<PatchId> ReachAll(SearchSpace& space,
                                 PatchId start,
                                 SearchWorkspace& workspace,
                                 const Stop& stop) {
  Search search(space, workspace, NoBound{}, stop);
  STRATA_RETURN_IF_ERROR(search.Run(start, kNoPatchId, UINT64_MAX).status());
  return search.dearest();
}

}  // namespace strata
