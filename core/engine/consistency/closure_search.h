// Looks for loops to close: places seen twice that nothing in the graph says are the same.
#ifndef STRATA_CORE_ENGINE_CONSISTENCY_CLOSURE_SEARCH_H_
#define STRATA_CORE_ENGINE_CONSISTENCY_CLOSURE_SEARCH_H_

#include <cstddef>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

#include "core/engine/consistency/graph_world.h"
#include "core/engine/consistency/optimize_settings.h"
#include "core/engine/map/job_context.h"
#include "core/engine/scans/scan_views.h"

namespace strata {

// Two scans of one place.
struct FoundClosure {
  std::size_t i = 0, j = 0;  // nodes
  Pose T_i_j = Pose::Identity();
  Matrix6d information = Matrix6d::Identity();
  double confidence = 0.0;  // PlaceMatch::confidence
  std::string note;         // how it was found, for people
};

struct ClosureSearch {
  std::vector<FoundClosure> closures;  // believed
  std::vector<Pose> T_map_scan;        // with the closures closed, where alignment begins
  std::size_t tried = 0;
  std::size_t matched = 0;  // of them, as places; `closures` of these agree with each other and all
};

// Candidates by the uncertainty of relative poses and by what places look like; each verified by
// registration, and all by the graph and by each other. Closing one moves the poses, which makes
// others likely: so until none is found any more. Only pairs with a node from `first_new` on.
absl::StatusOr<ClosureSearch> SearchClosures(const GraphWorld& world,
                                             ScanViews& views,
                                             std::size_t first_new,
                                             const OptimizeSettings& settings,
                                             int threads,
                                             JobContext& context);

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_CONSISTENCY_CLOSURE_SEARCH_H_
