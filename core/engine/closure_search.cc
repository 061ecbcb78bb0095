#include "core/engine/closure_search.h"

namespace strata {

absl::StatusOr<ClosureSearch> SearchClosures(
    const GraphWorld& world, ScanViews&, const OptimizeSettings&, int, JobContext&) {
  ClosureSearch search;
  search.T_map_scan = world.Poses();
  return search;
}

}  // namespace strata
