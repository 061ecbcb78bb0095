// Shortest paths over the patches of a SearchSpace: A* and, without a goal, Dijkstra's algorithm.
//
// A tile is taken in when the search comes to the first patch that moves into it have reached. A
// search that has room for all it takes in is plain A*, and its path the cheapest. A larger one
// parks the tile that it has not been in for longest: costs at the border and ways back stay. When
// something in a parked tile has its turn again, for it was left to expand or a cheaper way into
// the tile was found since, it is searched again from its border. The path then costs at most 1 %
// more than the cheapest.
//
// Between tiles that the map keeps prepared a way that is surely larger is measured over blocks
// first (corridor.h), then searched in the corridor around that, in the order of costs: few tiles
// are at hand at a time, each once. The path stands unless one may be cheaper by more than 1 %; a
// search for such a one goes only where blocks leave that open.
//
// What is found depends on the size of the budget and on what the map keeps, not on what caches
// hold.
#ifndef STRATA_CORE_PLANNING_SEARCH_H_
#define STRATA_CORE_PLANNING_SEARCH_H_

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"

#include "core/common/stop.h"
#include "core/planning/search_space.h"
#include "core/planning/search_workspace.h"

namespace strata {

struct SearchOutcome {
  // kLimit: of what may be expanded; kFull: of memory.
  enum class End : std::uint8_t { kFound, kExhausted, kLimit, kFull };
  End end = End::kExhausted;
  std::uint64_t expanded = 0;
  std::uint32_t cost = 0;        // of the path
  std::vector<PatchId> path;     // start to goal
  PatchId dearest = kNoPatchId;  // the patch expanded that was the most expensive to reach
};

// A path from `start` to `goal`, both places where the robot can stand.
// CANCELLED and DEADLINE_EXCEEDED by `stop`; errors of the source.
absl::StatusOr<SearchOutcome> FindPath(SearchSpace& space,
                                       PatchId start,
                                       PatchId goal,
                                       std::uint64_t max_expanded,
                                       SearchWorkspace& workspace,
                                       const Stop& stop);

// Above all costs.
inline constexpr std::uint32_t kAnyCost = 0xF0000000U;

// Costs from `start` to everything that can be reached for less than `below`, left in `workspace`,
// where others may have costs, too; returns the patch that is the most expensive to reach.
absl::StatusOr<PatchId> ReachAll(SearchSpace& space,
                                 PatchId start,
                                 SearchWorkspace& workspace,
                                 const Stop& stop,
                                 std::uint32_t below = kAnyCost);

// Calls visit(patch, cost) for all that is known in `workspace` to cost at most `most`.
template <typename Visit>
void ForEachReached(const SearchSpace& space,
                    SearchWorkspace& workspace,
                    std::uint32_t most,
                    const Visit& visit) {
  for (const int slot : workspace.at_hand()) {
    const SearchWorkspace::Member& member = workspace.member(slot);
    const PatchId base = space.slots()[slot].base;
    member.tile->standing.ForEach([&](std::uint32_t place, std::uint32_t /*number*/) {
      if (member.costs[place] <= most) visit(base + place, member.costs[place]);
    });
  }
}

}  // namespace strata

#endif  // STRATA_CORE_PLANNING_SEARCH_H_
