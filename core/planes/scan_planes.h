// What one scan says about planes: the flat surfaces and the straight edges it saw. The plain
// values that global constraints are made of (thesis 5.2, 7.4).
#ifndef STRATA_CORE_PLANES_SCAN_PLANES_H_
#define STRATA_CORE_PLANES_SCAN_PLANES_H_

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "core/geometry/primitives.h"

namespace strata {

// A straight edge of the scene: a border where the scan sees past a surface, or the crease between
// two flat surfaces.
struct EdgeFeature {
  // Along `line` from its lower to its higher end, at least two; the mean of what was measured in
  // each stretch.
  std::vector<Eigen::Vector3d> points;
  Line line;              // origin at the mean of `points`
  double length_m = 0.0;  // between the ends along the line
  double rms_m = 0.0;     // of the edgels' distance to the line; of a crease, of its two patches

  friend bool operator==(const EdgeFeature& a, const EdgeFeature& b) {
    return a.points == b.points && a.line.origin == b.line.origin &&
           a.line.direction == b.line.direction && a.length_m == b.length_m && a.rms_m == b.rms_m;
  }
};

// A flat, connected piece of surface.
struct PlanePatch {
  Plane plane;  // fitted to the points (2.6.1); its normal points towards the sensor
  // Σ w p̃p̃ᵀ over the points, p̃ = (x, y, z, 1). Every flat cell weighs as much as its area [m²],
  // however many points fell into it, so that moments(3, 3) = area_m2.
  Eigen::Matrix4d moments;
  Eigen::Vector3d centroid;  // mean of the points
  // The rectangle that holds the patch: centroid + a · axis_u + b · (normal × axis_u) with (a, b)
  // between the two corners. `axis_u` is the direction in which the points spread most.
  Eigen::Vector3d axis_u;
  Eigen::Vector2d extent_min, extent_max;
  // Where in the rectangle there is surface, in squares of `footprint_cell_m` from `extent_min` on:
  // bit j of number i stands for square (i, j) along (a, b). At most 32 × 32.
  double footprint_cell_m = 1.0;
  std::vector<std::uint32_t> footprint;
  double area_m2 = 0.0;  // of the flat cells it is made of, without the holes between them
  std::uint32_t point_count = 0;
  double rms_m = 0.0;  // of the points' distance to the plane
  // How much the surface is bent [1/m]: k_aa, k_ab, k_bb of z = ½ (k_aa a² + 2 k_ab a b + k_bb b²),
  // z along the normal. 0 where that is not sure.
  Eigen::Vector3d curvature = Eigen::Vector3d::Zero();

  friend bool operator==(const PlanePatch& a, const PlanePatch& b) {
    return a.plane.normal == b.plane.normal && a.plane.distance == b.plane.distance &&
           a.moments == b.moments && a.centroid == b.centroid && a.axis_u == b.axis_u &&
           a.extent_min == b.extent_min && a.extent_max == b.extent_max &&
           a.footprint_cell_m == b.footprint_cell_m && a.footprint == b.footprint &&
           a.area_m2 == b.area_m2 && a.point_count == b.point_count && a.rms_m == b.rms_m &&
           a.curvature == b.curvature;
  }
};

// In the scan frame. Patches by falling area, edges by falling length.
struct ScanPlanes {
  std::vector<PlanePatch> patches;
  std::vector<EdgeFeature> edges;

  friend bool operator==(const ScanPlanes&, const ScanPlanes&) = default;
};

}  // namespace strata

#endif  // STRATA_CORE_PLANES_SCAN_PLANES_H_
