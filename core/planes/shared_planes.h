// Planes that several scans see: the hyper-edges of the pose network (thesis 7.4).
#ifndef STRATA_CORE_PLANES_SHARED_PLANES_H_
#define STRATA_CORE_PLANES_SHARED_PLANES_H_

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include <Eigen/Core>

#include "core/geometry/pose.h"
#include "core/geometry/primitives.h"
#include "core/planes/scan_planes.h"

namespace strata {

struct PosedPlanes {
  const ScanPlanes* planes = nullptr;  // not null
  Pose T_map_scan = Pose::Identity();
  Eigen::Vector3d sensor_origin = Eigen::Vector3d::Zero();  // scan frame [m]
};

// A plane of the world and what scans have in it.
struct SharedPlane {
  struct View {
    std::size_t scan = 0;  // index into what was given
    // Σ p̃p̃ᵀ/σ² in the scan frame, see SharedPlaneOptions.
    Eigen::Matrix4d moments = Eigen::Matrix4d::Zero();
    double weight = 0.0;  // area [m²] of its patches, or length [m] of its edges
    double rms_m = 0.0;   // of their distance to `plane` at the given poses
  };
  Plane plane;                 // in the map; the normal points to where it was seen from
  bool from_edges = false;     // otherwise from patches
  std::vector<View> views;     // at least two, one a scan, by scan
  double support_value = 0.0;  // sum of the weights (5.2.3)
};

// How much a view says. Its points err together (calibration, motion, waves of the surface), so
// it is worth one independent measurement for every `independent_area_m2` of a patch or
// `independent_length_m` of an edge, at most `max_measurements`, each with the variance
// max(rms, sigma_floor_m)² + s², where rms is the feature's own and s that of the plane's views
// about it, or of a patch its own if that is more than twice as much: what disagrees pulls less.
// Where a plane of patches is most of eight scans and more say: what is far off from them has no
// say.
struct SharedPlaneOptions {
  // Error of a scan's pose relative to the others that see a plane: what the gates of 3σ allow for
  // beside the spread of the features. Larger finds more planes and joins more that are none; in
  // [0, 10] and [0, 0.3].
  double pose_sigma_m = 0.03;
  double pose_sigma_rad = 0.005;
  // Two patches are one surface only if so much of the smaller one lies on the other; in [0, 1].
  double min_overlap = 0.2;
  // Nothing lies farther from where a plane was begun: what is flat here may bend there; in
  // [1, 1000].
  double max_extent_m = 40.0;
  double sigma_floor_m = 0.01;        // in [1e-4, 1]
  double independent_area_m2 = 0.25;  // in [1e-4, 100]
  double independent_length_m = 0.5;  // in [1e-3, 100]
  double max_measurements = 5.0;      // in [1, 1e6]
  // Planes of edges: half the width of the corridor in which an edge must lie entirely; at least
  // this much length of edges in all; in [0.001, 1], [0.1, 1e4].
  double corridor_m = 0.05;
  double min_edge_support_m = 12.0;
  int hypotheses = 4000;   // pairs of edges tried; in [0, 1000000]
  std::uint64_t seed = 1;  // of the pairs

  // INVALID_ARGUMENT naming every field out of its range.
  absl::Status Validate() const;
};

// The planes with views from at least two scans. Patches: grown from patch to overlapping patch of
// the same facing side while offset and tilt pass the gates; of two surfaces of one scan that are
// not one plane by that scan's own accuracy at most one is in a plane; views that do not fit the
// plane of all others leave. Edges: RANSAC over pairs of edges by length, corridor, hill climbing
// (5.2.3); in a level plane all seen from one side and of more than one direction; those that are
// the border of a plane of patches are left out. A patch is in at most one plane. Order: patches'
// planes by falling support value, then edges'. `options` must be valid and poses finite. A pure
// function, thread-safe.
std::vector<SharedPlane> FindSharedPlanes(std::span<const PosedPlanes> scans,
                                          const SharedPlaneOptions& options = {});

}  // namespace strata

#endif  // STRATA_CORE_PLANES_SHARED_PLANES_H_
