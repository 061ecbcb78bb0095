// Which loop closures can be true together? The largest set of pairwise consistent ones (Mangelson,
// Dominic, Eustice, Vasudevan, "Pairwise Consistent Measurement Set Maximization", ICRA 2018): what
// is asked of closures before they enter a graph. Between trajectories nothing else can doubt the
// first one.
#ifndef STRATA_CORE_POSEGRAPH_CLOSURES_CLOSURE_CONSISTENCY_H_
#define STRATA_CORE_POSEGRAPH_CLOSURES_CLOSURE_CONSISTENCY_H_

#include <cstddef>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/geometry/pose.h"
#include "core/posegraph/closures/path_uncertainty.h"

namespace strata {

// A measured relative pose of two scans far apart in the graph.
struct Closure {
  std::size_t i = 0, j = 0;
  Pose T_i_j = Pose::Identity();
  double sigma_m = 0.1;     // of the match: root of the trace of its position's covariance; > 0
  double sigma_rad = 0.01;  // of its rotation's; > 0
};

// Whether poses agree with a closure: to 0.5 m and 0.05 rad. One that is farther off once a graph
// is optimised with it was none.
bool ClosureHolds(const Pose& T_i_j, const Pose& T_map_i, const Pose& T_map_j);

struct ClosureConsistencyOptions {
  DriftOptions drift;
  // Two closures and the graph between their ends make a loop. They are consistent if going round
  // comes back within this many σ of all that the loop is made of; (0, 100].
  double max_sigmas = 3.0;
  // Closures between parts that the graph does not connect otherwise are kept from this many scans
  // on both sides on: those of one scan, wherever it looks alike, agree with each other and say
  // nothing that could be checked; [1, 1000].
  int min_between_parts = 2;
  // These scans lie so far apart, on both sides [m]: the corners of a yard look alike from all
  // places that see nothing else. In [0, 1000].
  double min_spread_m = 5.0;

  absl::Status Validate() const;
};

struct ConsistentClosureSet {
  std::vector<std::size_t> kept;  // indices into the closures, ascending
  // For each closure, with how many others it is consistent among those that can be checked against
  // it.
  std::vector<int> support;
};

// `edges` are the relative poses in force, without the closures. Closures within one part of the
// graph must also agree with the graph itself, as far as its σ says; where they say another storey,
// as far as the graph errs elsewhere (docs/decisions/0258). Closures of two parts are
// checked against the others of the same two parts; where one agrees with what the frames of the
// parts say (SaidHypothesis), it is enough, and those that do not agree are none; where none does,
// those that agree but for up to 6 m of height are none: storeys look alike. The set is found
// by growing one from every closure, most consistent ones first: large, and the largest where there
// is little contradiction. Ties prefer what comes first. A pure function; some ms a closure for
// 20,000 poses. INVALID_ARGUMENT for invalid options, poses, σ, or closures and edges that name no
// nodes.
absl::StatusOr<ConsistentClosureSet> ConsistentClosures(
    std::span<const Pose> T_map_scan,
    std::span<const GraphEdge> edges,
    std::span<const Closure> closures,
    const ClosureConsistencyOptions& options = {});

}  // namespace strata

#endif  // STRATA_CORE_POSEGRAPH_CLOSURES_CLOSURE_CONSISTENCY_H_
