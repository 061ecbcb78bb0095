// Whether what an optimize job found may become an epoch by itself (thesis 7.4.3, Algorithm 4,
// which returns FAILURE where nothing settles).
#ifndef STRATA_CORE_ENGINE_CONSISTENCY_OPTIMIZE_VERDICT_H_
#define STRATA_CORE_ENGINE_CONSISTENCY_OPTIMIZE_VERDICT_H_

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"

#include "core/engine/consistency/graph_world.h"
#include "core/engine/scans/damaged_scans.h"
#include "core/engine/scans/scan_views.h"
#include "core/posegraph/alignment/alignment.h"

namespace strata {

struct OptimizeVerdict {
  // False: too little was measured to move scans by, or scans contradict each other or what else is
  // known of their places where they end up, or poses did not settle and a step is loose.
  bool is_sound = true;
  std::size_t steps = 0;  // from scan to scan along trajectories
  // Those whose two scans no match, closure or given constraint joins, on any way: the nodes from
  // and to which they lead.
  std::vector<std::pair<std::size_t, std::size_t>> loose_steps;
  // Of the others, those whose scans show nothing that would tell where they are along what they
  // see: open ground, a bare corridor. There it is the robot's word.
  std::vector<std::pair<std::size_t, std::size_t>> sliding_steps;
  // Pairs of scans near each other that something joins, along trajectories and across, spread over
  // the map; and those of them where one looked through much of what the other saw.
  std::size_t compared = 0;
  std::vector<std::pair<std::size_t, std::size_t>> contradicted_pairs;
  std::vector<std::string> at_odds;  // robots that most pairs of theirs speak against
  // Parts of the map that nothing joins to the largest, and no loose steps either: the first node
  // and how many there are.
  std::vector<std::pair<std::size_t, std::size_t>> apart;
  std::size_t priors = 0;  // absolute poses, and those that do not fit
  std::size_t priors_rejected = 0;
  std::string message;  // two sentences or three: what holds the scans, and what that means
};

// Planes that scans share are found at poses that are nearly right; a scan that nothing is matched
// to is drawn to whatever wall is near. Where more than a quarter of the steps is loose, or of the
// pairs contradicted, or more than half of those of a robot or of two, there is nothing that planes
// could be trusted with: recordings too sparse to overlap, poses of another recording, scans of two
// places under one name, robots joined where they are not. Where more than half of
// the absolute poses do not fit, scans or GPS are wrong as a whole, and a person has to say which.
// Damaged scans are left out.
absl::StatusOr<OptimizeVerdict> VerdictOn(const GraphWorld& world,
                                          ScanViews& views,
                                          const AlignmentResult& result,
                                          const DamagedScans& damaged);

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_CONSISTENCY_OPTIMIZE_VERDICT_H_
