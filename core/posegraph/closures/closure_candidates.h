// Which pairs of scans to try as loop closures: those that may show the same place though nothing
// near in the graph says so.
#ifndef STRATA_CORE_POSEGRAPH_CLOSURES_CLOSURE_CANDIDATES_H_
#define STRATA_CORE_POSEGRAPH_CLOSURES_CLOSURE_CANDIDATES_H_

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/geometry/pose.h"
#include "core/posegraph/closures/path_uncertainty.h"
#include "core/registration/place_descriptor.h"
#include "core/registration/place_match.h"

namespace strata {

// A scan as the current poses have it. Scans of one trajectory stand in the order of its way.
struct ClosureNode {
  Pose T_map_scan = Pose::Identity();
  std::uint32_t trajectory = 0;  // any number, the same for the scans of one robot's run
};

// Two scans that look alike, as a PlaceIndex says (similarity: a = i, b = j).
struct AlikePair {
  std::size_t i = 0, j = 0;
  PlaceSimilarity similarity;
};

enum class ClosureReason : std::uint8_t {
  kNear,   // the poses say they are near, or may be
  kAlike,  // they look alike
};

struct ClosureCandidate {
  std::size_t i = 0, j = 0;
  Pose T_i_j = Pose::Identity();  // of the current poses, whatever it is worth
  // How well the graph knows it (see PathUncertainty); infinite when nothing connects the two.
  double sigma_m = 0.0;
  double sigma_rad = 0.0;
  ClosureReason reason = ClosureReason::kNear;
  double score = 0.0;  // likely overlap × what a closure would tell; an order only
  // Where to look for j, in the frame of i: for MatchPlace with i's scan at the identity.
  std::vector<PlaceHypothesis> hypotheses;
};

struct ClosureCandidateOptions {
  DriftOptions drift;
  // Two scans nearer than this see the same place [m]; in [0.5, 200].
  double view_range_m = 12.0;
  // Pairs may be as much nearer or farther as this many σ; in [0, 10].
  double sigmas = 2.0;
  // Pairs joined by a path of fewer edges or less way say nothing new.
  int min_hops = 4;
  double min_way_m = 25.0;
  // Alike pairs with a greater distance are left out; in [0, 2].
  double max_alike_distance = 0.6;
  // One segment of way and another one give `per_segment` candidates of each reason.
  double segment_m = 10.0;  // in [0.1, 10000]
  int per_segment = 2;      // in [1, 1000]
  // The widest window that is searched around a guess: larger uncertainty leaves a pair to what
  // places look like. In [1, 200].
  double max_window_m = 25.0;
  int max_candidates = 500;  // in [1, 1000000]

  absl::Status Validate() const;
};

// Best first, i < j. `edges` are the relative poses in force, `alike` the pairs an index proposes
// (may be empty; of any two trajectories). A pure function; the graph is searched from at most
// 1000 nodes, so 20,000 poses take seconds. INVALID_ARGUMENT for invalid options, poses that are
// not finite, or pairs that name no nodes.
absl::StatusOr<std::vector<ClosureCandidate>> FindClosureCandidates(
    std::span<const ClosureNode> nodes,
    std::span<const GraphEdge> edges,
    std::span<const AlikePair> alike,
    const ClosureCandidateOptions& options = {});

}  // namespace strata

#endif  // STRATA_CORE_POSEGRAPH_CLOSURES_CLOSURE_CANDIDATES_H_
