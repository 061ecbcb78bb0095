// Notices, between two jobs, that the poses are worth making consistent again: a loop was closed.
#ifndef STRATA_CORE_ENGINE_CONSISTENCY_CLOSURE_WATCH_H_
#define STRATA_CORE_ENGINE_CONSISTENCY_CLOSURE_WATCH_H_

#include <cstddef>

#include "absl/status/statusor.h"

#include "core/common/stop.h"
#include "core/engine/consistency/graph_world.h"
#include "core/engine/map/job_context.h"
#include "core/engine/map/map_core.h"
#include "core/engine/map/snapshots.h"
#include "core/storage/storage.h"

namespace strata {

// Nodes from `first_new` on whose registration joined another pass by their place, another robot's
// or an earlier one of their own, where the scans before them on their trajectory had joined none.
std::size_t CountFreshContacts(const GraphWorld& world, std::size_t first_new);

// What was looked at.
struct SeenClosures {
  MapView view;
  ScanNumber scan = 0;  // this one and those before
};

// The scans that came in since the last look. One thread at a time: the job runner's.
class ClosureWatch {
 public:
  // Goes on from an earlier watch of the map.
  explicit ClosureWatch(MapCore& core, const SeenClosures& seen = {}) : core_(core), seen_(seen) {}

  // Whether there is anything to look at.
  bool HasNews() const { return core_.snapshots().current() != seen_.view; }
  // Verified closures that no job has had a chance to use: fresh contacts and matches of new scans
  // that the graph did not foresee. A look that fails, or is stopped, is repeated by the next.
  absl::StatusOr<std::size_t> Look(const Stop& stop);
  const SeenClosures& seen() const { return seen_; }

 private:
  MapCore& core_;
  SeenClosures seen_;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_CONSISTENCY_CLOSURE_WATCH_H_
