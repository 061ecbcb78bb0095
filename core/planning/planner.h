// Paths for robots over the surfaces of a map (thesis 6.2.2): which level is which, what a robot of
// some size can take, and what the safest short way is.
//
// A patch (its top, that of a vertical one too) is a state. A robot may stand on it if
//   - slope and roughness of the local plane hold (core/planning/ground/ground_fit.h),
//   - no edge of its level (core/planning/ground/ground_checks.h: obstacle, step, drop, too little
//     clearance, unknown ground wider than max_gap) comes within its radius.
// It moves to the eight neighbouring cells over steps of at most max_step, and over up to max_gap
// of unobserved cells between fitting rims. Where a robot may stand and move grows with max_step,
// max_slope and max_gap, and as radius and height shrink (see ground_checks.h). A move of length l
// costs l · (1 + danger), the mean of both ends' danger (core/planning/ground/profile_checks.h),
// plus kGapDanger over unobserved ground. A query may bring costs of classes: a move is then
// multiplied by the mean factor of both ends' classes, and forbidden classes are no place to stand;
// what bounds costs without classes stays a lower bound, and nothing is prepared anew. Where a
// source has what was inferred, robots are kept out of that as well; `inferred` of queries is for
// whoever makes sources.
//
// What is prepared, per tile and profile, when a query first touches a tile, and kept while it fits
// the cache: heights, dangers and which moves there are, 6 bytes a patch to stand on and some 3 of
// all else; what a move costs is computed when a search comes by.
// A preparation is a pure function of the tile and its eight neighbours and is keyed by their
// versions: unchanged tiles are prepared once, changed ones never used stale.
#ifndef STRATA_CORE_PLANNING_PLANNER_H_
#define STRATA_CORE_PLANNING_PLANNER_H_

#include <cstddef>
#include <cstdint>
#include <memory>

#include "absl/status/statusor.h"

#include "core/common/cache_budget.h"
#include "core/common/stop.h"
#include "core/planning/ground/rows.h"
#include "core/planning/tile_cache.h"
#include "core/planning/tile_source.h"
#include "core/planning/viewpoints.h"
#include "core/world/exploration.h"
#include "core/world/plan.h"
#include "core/world/robot_profile.h"

namespace strata {

struct PlannerOptions {
  double cell_size_m = 0.1;  // of the map
  // Memory for prepared tiles and searches, maybe shared with other caches. A query that needs
  // more, for the tiles that it has left (20 to 50 kB each), ends with PlanReason::kSearchLimit.
  std::shared_ptr<CacheBudget> budget = std::make_shared<CacheBudget>(std::size_t{1} << 30);
  ParallelLoop loop = {};  // what tiles are prepared by
  int preparations = 1;    // tiles that are prepared at a time, each up to some 50 MB
};

// Plans in one map, in any of its epochs. Thread-safe; queries run in their callers' threads.
class Planner {
 public:
  explicit Planner(const PlannerOptions& options);

  // A path, or why there is none; both are OK. The path is the cheapest where a ninth of the
  // budget holds the tiles that the search touches (with 160 MiB 56 of one level) and the way is
  // not so long that it surely will not (58,000 cells; straight, or over blocks where the map keeps
  // tiles); else it costs at most 1 % more (core/planning/search.h). Where others search, it waits
  // for its share of the memory. Sensors do not see the ground they stand over: a start or goal
  // where the robot cannot stand moves to the nearest place on the same level, at most radius +
  // max_gap away (core/planning/endpoint.h); the path begins or ends there and the message says so
  // ("start moved 0.32 m to ..."). Fills all of PlanResult but `epoch`.
  //   INVALID_ARGUMENT    query not finite or beyond the map's range, profile or class costs out of
  //                       range
  //   CANCELLED, DEADLINE_EXCEEDED   by `stop`
  //   errors of `source`
  absl::StatusOr<PlanResult> Plan(TileSource& source, const PlanQuery& query, const Stop& stop);

  // Whether a path holds by the rules above; both are OK. A path just planned always does. Fills
  // all of PathCheck but what is of an epoch; `known` of the query is ignored.
  //   INVALID_ARGUMENT    no waypoint or more than kMaxWaypoints, one that is not finite or beyond
  //                       the map's range, a path over more than kMaxPathTiles, profile or class
  //                       costs out of range
  //   CANCELLED, DEADLINE_EXCEEDED   by `stop`
  //   errors of `source`
  absl::StatusOr<PathCheck> Check(TileSource& source, const PathQuery& query, const Stop& stop);

  // Where to look next; Planner's own of ExploreResult are all fields but `epoch`. Errors of
  // ChooseViews (core/planning/viewpoints.h).
  absl::StatusOr<ExploreResult> Explore(TileSource& source,
                                        const ExploreQuery& query,
                                        SpaceOf space_of,
                                        const Stop& stop);

  // Prepared tiles, for others that ask what a robot can do.
  TileCache& cache() { return cache_; }
  TileCache::Statistics cache_statistics() const { return cache_.statistics(); }

 private:
  const PlannerOptions options_;
  TileCache cache_;
};

}  // namespace strata

#endif  // STRATA_CORE_PLANNING_PLANNER_H_
