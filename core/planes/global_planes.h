// Planes that several scans see: the hyper-edges of the pose network (thesis 7.4).
#ifndef STRATA_CORE_PLANES_GLOBAL_PLANES_H_
#define STRATA_CORE_PLANES_GLOBAL_PLANES_H_

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
};

enum class GlobalPlaneKind : std::uint8_t {
  kWall,   // of patches, the normal within 15° of horizontal
  kFloor,  // of patches, the normal within 15° of vertical: floors, ceilings
  kSlope,  // of patches, in between: roofs, ramps
  kEdges,  // of edges: windows of a storey, eaves, ridges
};

struct GlobalPlane {
  // What one scan has in the plane.
  struct Support {
    std::size_t scan = 0;     // index into what was given
    Eigen::Matrix4d moments;  // Σ p̃p̃ᵀ/σ² in the scan frame, see GlobalPlaneOptions
    double weight = 0.0;      // area [m²] of the patches, or length [m] of the edges
    double rms_m = 0.0;       // of the distance to `plane` at the given poses
  };
  GlobalPlaneKind kind = GlobalPlaneKind::kWall;
  Plane plane;                    // in the map; of patches, the normal points to the seen side
  std::vector<Support> supports;  // at least two, one a scan, ascending
  double support_value = 0.0;     // sum of the weights (5.2.3)
};

// How much a support says. Its points err together (calibration, motion, waves of the surface), so
// it is worth one independent measurement for every `independent_area_m2` of a patch or
// `independent_length_m` of an edge, at most `max_measurements`, each with the variance
// max(rms, sigma_floor_m)² + s², where rms is the feature's own and s that of the plane's supports
// about it: what disagrees pulls less.
struct GlobalPlaneOptions {
  // Of a scan's pose relative to the others that see a plane: what the gates of 3σ allow for beside
  // the spread of the features. Larger finds more planes and joins more that are none; in
  // [0, 10] and [0, 0.3].
  double pose_sigma_m = 0.05;
  double pose_sigma_rad = 0.01;
  // Two patches are one surface only if so much of the smaller one lies on the other; in [0, 1].
  double min_overlap = 0.2;
  // No support lies farther from where a plane was begun: what is flat here may bend there; in
  // [1, 1000].
  double max_extent_m = 40.0;
  double sigma_floor_m = 0.01;        // in [1e-4, 1]
  double independent_area_m2 = 0.25;  // in [1e-4, 100]
  double independent_length_m = 0.5;  // in [1e-3, 100]
  double max_measurements = 50.0;     // in [1, 1e6]
  // Planes of edges: half the width of the corridor in which an edge must lie entirely; at least
  // this much length of edges in all; in [0.001, 1], [0.1, 1e4].
  double corridor_m = 0.05;
  double min_edge_support_m = 12.0;
  int hypotheses = 4000;   // pairs of edges tried; in [0, 1000000]
  std::uint64_t seed = 1;  // of the pairs

  // INVALID_ARGUMENT naming every field out of its range.
  absl::Status Validate() const;
};

// The planes with supports from at least two scans. Patches: grown from patch to overlapping patch
// of the same facing side while offset and tilt pass the gates; of two surfaces of one scan that
// are not one plane by that scan's own accuracy at most one supports a plane; supports that do not
// fit the plane of all others leave. Edges: RANSAC over pairs of edges by length, corridor, hill
// climbing (5.2.3). A patch or edge supports at most one plane of its kind. Order: patches' planes
// by falling support value, then edges'. `options` must be valid and poses finite. A pure function,
// thread-safe.
std::vector<GlobalPlane> FindGlobalPlanes(std::span<const PosedPlanes> scans,
                                          const GlobalPlaneOptions& options = {});

}  // namespace strata

#endif  // STRATA_CORE_PLANES_GLOBAL_PLANES_H_
