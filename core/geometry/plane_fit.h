// Planes through points and through lines (thesis 2.6).
#ifndef STRATA_CORE_GEOMETRY_PLANE_FIT_H_
#define STRATA_CORE_GEOMETRY_PLANE_FIT_H_

#include <span>

#include "absl/status/statusor.h"
#include <Eigen/Core>

#include "core/geometry/primitives.h"

namespace strata {

struct PointsPlaneFit {
  Plane plane;           // Canonical(); contains `mean`
  Eigen::Vector3d mean;  // weighted
  // Eigenvalues of the points' weighted covariance, ascending [m²]; the first is the normal's.
  Eigen::Vector3d eigenvalues;
  double mean_squared_residual_m2 = 0.0;  // weighted mean of the squared distances to the plane
};

// The plane that minimises the (weighted) mean squared distance (2.18–2.23). `weights` is empty or
// has one number ≥ 0 a point.
// INVALID_ARGUMENT for fewer than three points, numbers that are not finite, weights that do not
// fit or sum to 0, and points on one line (second eigenvalue below 1e-12 of the third).
absl::StatusOr<PointsPlaneFit> FitPlaneToPoints(std::span<const Eigen::Vector3d> points,
                                                std::span<const double> weights = {});

struct LinesPlaneFit {
  Plane plane;            // Canonical(); contains `point`
  Eigen::Vector3d point;  // nearest to all lines in the mean square (2.32), or mean of the points
  Eigen::Vector3d singular_values;  // of the stacked directions, descending
  bool from_points = false;         // the lines were nearly parallel
};

// The plane whose normal is most orthogonal to all directions, through the point nearest to all
// lines (2.24–2.32). When the ratio of the two largest singular values of the directions is below
// `min_direction_ratio`, the lines are nearly parallel (two lines: below an angle of twice its
// arctangent) and say too little about either: the plane is then fitted to `points`, what was
// measured on the lines (their edgels), or without any to the two points origin ± direction of each
// line.
// INVALID_ARGUMENT for fewer than two lines, numbers that are not finite, or a degenerate fit to
// the points.
absl::StatusOr<LinesPlaneFit> FitPlaneToLines(std::span<const Line> lines,
                                              std::span<const Eigen::Vector3d> points = {},
                                              double min_direction_ratio = 0.1);

}  // namespace strata

#endif  // STRATA_CORE_GEOMETRY_PLANE_FIT_H_
