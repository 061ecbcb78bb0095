// What the things of a kind look like, from all that was seen of each of them (thesis 11.2.2), and
// what of one of them nobody has seen (11.2.3).
#ifndef STRATA_CORE_COMPLETION_PROTOTYPE_H_
#define STRATA_CORE_COMPLETION_PROTOTYPE_H_

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include <Eigen/Core>

#include "core/common/stop.h"
#include "core/completion/shape_view.h"

namespace strata {

// An upright plane that a shape is the mirror image of itself by: n · p = offset_m, n = (cos, sin,
// 0) of the heading. Frame of the kind.
struct MirrorPlane {
  double heading_rad = 0.0;
  double offset_m = 0.0;

  Eigen::Vector3d Image(const Eigen::Vector3d& p) const;
};

struct PrototypeVoxel {
  Eigen::Vector3i at;
  Eigen::Vector3d mean;       // of the points in it, frame of the kind [m]
  std::uint32_t hit_by = 0;   // things that were measured in it or next to it; 0: a mirror image
  std::uint32_t seen_by = 0;  // things of which it was seen: those, and those where it was empty
};

struct Prototype {
  double voxel_m = 0.05;
  std::vector<PrototypeVoxel> voxels;
  std::optional<MirrorPlane> mirror;  // if it is symmetric as far as it was seen
};

// The thesis takes all points of all things, and finds "some outliers on the window borders". Here
// a voxel counts if a fifth of those that could have seen it did, and two of them, where two
// could. What mirrors the rest without being contradicted by any ray is taken for symmetric, and
// completed: most of a row of parked cars are seen from one side. `views` have one voxel_m and
// box. INVALID_ARGUMENT without any; CANCELLED, DEADLINE_EXCEEDED.
absl::StatusOr<Prototype> BuildPrototype(std::span<const ShapeView> views, const Stop& stop);

// What a prototype adds to one thing of its kind.
struct Inference {
  std::vector<Eigen::Vector3d> points;  // where nobody looked; frame of the kind [m]
  std::uint64_t agreeing = 0;           // voxels of the prototype where the thing was measured
  std::uint64_t contradicting = 0;      // those that were seen empty
  std::uint64_t voxels = 0;             // of the prototype

  // Otherwise rays contradict a quarter as much as agrees: it is of another kind.
  bool IsOfKind() const { return 4 * contradicting <= agreeing; }
  // Otherwise less than a fifth of the shape was seen: a wall is a part of many houses.
  bool IsSeenEnough() const { return agreeing > 0 && 5 * agreeing >= voxels; }
};

// The thesis puts the prototype in place of every thing, what was measured of it included. Here
// measurements stay, and only that is added which no ray contradicts, and nothing to a thing that
// is not of the kind, or of which too little was seen to tell. `view` as the prototype's.
Inference InferHidden(const Prototype& prototype, const ShapeView& view);

}  // namespace strata

#endif  // STRATA_CORE_COMPLETION_PROTOTYPE_H_
