// Plane detectors of PCL and CGAL, behind a door of our own: their headers take long to compile.
#ifndef STRATA_TESTS_BENCH_PLANE_PEERS_H_
#define STRATA_TESTS_BENCH_PLANE_PEERS_H_

#include "tests/bench/planes/plane_baselines.h"
#include "tests/bench/planes/plane_cases.h"

namespace strata::bench {

// SACSegmentation by RANSAC, 1000 iterations, plane after plane out of what is left, as in PCL's
// tutorial, until one has less than min_points; the tutorial stops at 30 % of the points, which
// leaves the small faces.
PointGroups PclSacPlanes(const PlaneCase& input);

// NormalEstimation over 30 neighbours and RegionGrowing with the numbers of PCL's tutorial: 30
// neighbours, 3°, curvature 1.
PointGroups PclGrownPlanes(const PlaneCase& input);
// The same where noise is as high as here: 8°, curvature 0.05 (the class's own).
PointGroups PclGrownPlanesTuned(const PlaneCase& input);

// pca_estimate_normals over 24 neighbours and Efficient_RANSAC of planes: near_m, min_points,
// probability 0.05 and normals within 0.9 as by default, points farther apart than 5 near_m are not
// one shape.
PointGroups CgalRansacPlanes(const PlaneCase& input);

}  // namespace strata::bench

#endif  // STRATA_TESTS_BENCH_PLANE_PEERS_H_
