// The planes and directions that scans share, from round to round of an alignment.
// Internal to core/posegraph, not installed.
#ifndef STRATA_CORE_POSEGRAPH_ALIGNMENT_SHARED_SURFACES_H_
#define STRATA_CORE_POSEGRAPH_ALIGNMENT_SHARED_SURFACES_H_

#include <cstddef>
#include <optional>
#include <vector>

#include "absl/status/status.h"

#include "core/geometry/pose.h"
#include "core/geometry/primitives.h"
#include "core/planes/shared_directions.h"
#include "core/planes/shared_planes.h"
#include "core/posegraph/alignment/alignment.h"
#include "core/posegraph/pose_graph.h"

namespace strata {

// Must not outlive what it was made of. One thread at a time.
class SharedSurfaces {
 public:
  SharedSurfaces(const AlignmentProblem& problem,
                 AlignmentSource& source,
                 const AlignmentOptions& options)
      : problem_(problem), source_(source), options_(options) {}

  // At these poses, unless what was found still holds.
  absl::Status Find(const std::vector<Pose>& T_map_scan, ForEach for_each);
  // Their terms at the poses of `graph`, instead of those that it has.
  void AddTo(PoseGraphProblem& graph) const;
  // Nodes of different numbers know nothing of each other. A few walls in common would let them
  // slide along these, as far as their tilts are wrong: each part gets its own planes. Whether any
  // plane was of two parts.
  bool Split(const std::vector<std::size_t>& parts);
  // Where the planes are after a solution of a graph that they were added to.
  void Keep(const std::vector<Plane>& planes);
  // What a round moved and turned poses by.
  void Moved(double max_shift_m, double max_turn_rad);

  // Whether poses have settled so far that the search may allow for much less.
  bool MayNarrow() const;
  const std::vector<SharedPlane>& planes() const { return planes_; }
  std::size_t directions() const { return directions_.size(); }

 private:
  struct Motion {
    double shift_m = 0.0, turn_rad = 0.0;
  };
  bool Hold() const;
  // So many σ of what the search allowed for.
  bool IsWithin(const Motion& motion, double sigmas) const;
  SharedPlaneOptions GatesOfNow() const;

  const AlignmentProblem& problem_;
  AlignmentSource& source_;
  const AlignmentOptions& options_;
  std::optional<Motion> last_;  // of the round before
  std::vector<SharedPlane> planes_;
  std::vector<SharedDirection> directions_;
  SharedPlaneOptions gates_;  // that they were found by
  bool stays_ = false;        // poses have moved as little since as makes no other planes
};

}  // namespace strata

#endif  // STRATA_CORE_POSEGRAPH_ALIGNMENT_SHARED_SURFACES_H_
