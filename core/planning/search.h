// Shortest paths over the patches of a SearchSpace: A* and, without a goal, Dijkstra's algorithm.
#ifndef STRATA_CORE_PLANNING_SEARCH_H_
#define STRATA_CORE_PLANNING_SEARCH_H_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"

#include "core/common/cache_budget.h"
#include "core/common/stop.h"
#include "core/planning/bucket_queue.h"
#include "core/planning/search_space.h"

namespace strata {

class Landmarks;

// What a search knows of a patch.
struct SearchNode {
  std::uint32_t cost = 0;   // from the start
  std::uint32_t stamp = 0;  // generation << 4 | closed << 3 | direction it was reached by
};

// Memory of searches, kept between them: nodes of an earlier search are told by their generation
// and never cleared. One search at a time.
class SearchWorkspace {
 public:
  // Takes its nodes from `budget`, if that is not nullptr.
  explicit SearchWorkspace(std::shared_ptr<CacheBudget> budget = nullptr)
      : budget_(std::move(budget)) {}
  ~SearchWorkspace();
  SearchWorkspace(const SearchWorkspace&) = delete;
  SearchWorkspace& operator=(const SearchWorkspace&) = delete;

  // Starts anew, with a queue of buckets of 2^bucket_shift.
  void Begin(int bucket_shift);
  // Nodes of a slot, at least `size` of them; where the budget has none left, some that mean
  // nothing, and the search is full().
  SearchNode* Nodes(int slot, std::uint32_t size);
  // nullptr if the search has not been in a slot of that size; nodes are kept from search to
  // search, so an earlier one's slot of the same number may be smaller.
  const SearchNode* NodesIfAny(int slot, std::uint32_t size) const;
  bool Reached(const SearchNode& node) const { return node.stamp >> 4 == generation_; }
  std::uint32_t Stamp(int direction) const {
    return generation_ << 4 | static_cast<std::uint32_t>(direction);
  }
  // The search must end.
  bool full() const { return full_; }
  BucketQueue& queue() { return queue_; }
  const std::shared_ptr<CacheBudget>& budget() const { return budget_; }
  // Of the nodes.
  std::size_t memory_bytes() const;

 private:
  std::uint32_t generation_ = 0;
  const std::shared_ptr<CacheBudget> budget_;
  std::vector<std::vector<SearchNode>> nodes_;  // per slot
  std::vector<SearchNode> spare_;               // for whom there is no memory
  bool full_ = false;
  BucketQueue queue_;
};

struct SearchOutcome {
  // kLimit: of what may be expanded, or of memory (SearchWorkspace::full()).
  enum class End : std::uint8_t { kFound, kExhausted, kLimit };
  End end = End::kExhausted;
  std::uint64_t expanded = 0;
  std::uint32_t cost = 0;        // of the path
  std::vector<PatchId> path;     // start to goal
  PatchId dearest = kNoPatchId;  // the patch expanded that was the most expensive to reach
};

// The cheapest path from `start` to `goal`, both places where the robot can stand. `landmarks`
// (optional) must fit the space's source and profile; costs of classes only add to what they know.
// CANCELLED and DEADLINE_EXCEEDED by `stop`; errors of the source.
absl::StatusOr<SearchOutcome> FindPath(SearchSpace& space,
                                       PatchId start,
                                       PatchId goal,
                                       const Landmarks* landmarks,
                                       std::uint64_t max_expanded,
                                       SearchWorkspace& workspace,
                                       const Stop& stop);

// Costs from `start` to everything that can be reached, left in `workspace`; returns the patch that
// is the most expensive to reach.
absl::StatusOr<PatchId> ReachAll(SearchSpace& space,
                                 PatchId start,
                                 SearchWorkspace& workspace,
                                 const Stop& stop);

}  // namespace strata

#endif  // STRATA_CORE_PLANNING_SEARCH_H_
