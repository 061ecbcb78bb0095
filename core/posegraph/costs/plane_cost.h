// The distances of points of a scan to a plane that moves too (thesis 7.19).
// Internal to core/posegraph, not installed.
#ifndef STRATA_CORE_POSEGRAPH_COSTS_PLANE_COST_H_
#define STRATA_CORE_POSEGRAPH_COSTS_PLANE_COST_H_

#include <array>

#include <Eigen/Core>
#include <ceres/sized_cost_function.h>

#include "core/geometry/pose.h"
#include "core/geometry/primitives.h"
#include "core/posegraph/pose_graph.h"

namespace strata {

// A plane as the solver holds it: its unit normal n and its height, n · (x − centre) = height,
// about a centre near its points: far from the map's origin, turning n · x = d would move it far
// away.
using PlaneBlock = std::array<double, 4>;

PlaneBlock PlaneBlockOf(const Plane& plane_map, const Eigen::Vector3d& centre);
Plane PlaneOf(const PlaneBlock& block, const Eigen::Vector3d& centre);

// Three directions that stand for the scatter of a view's points and their mean, all times the
// square root of their weight.
struct PlaneView {
  Eigen::Matrix<double, 3, 4> points;  // the last column is the mean
  double weight = 0.0;                 // square root of Σ w
};
// REQUIRES: `moments` positive semidefinite.
PlaneView SummariseView(const PointMoments& moments);

// Distances of the view's four points. The sum of their squares is that of all points.
Eigen::Vector4d PlaneViewDistances(const PlaneView& view,
                                   const Pose& T,
                                   const double* plane_block,
                                   const Eigen::Vector3d& centre);

// factor · Σ w d² of a pose block and a plane block.
class PlaneViewCost final : public ceres::SizedCostFunction<4, 7, 4> {
 public:
  // `view` and `centre` outlive this.
  PlaneViewCost(const PlaneView& view, const Eigen::Vector3d& centre, double factor);
  bool Evaluate(double const* const* blocks, double* residuals, double** jacobians) const override;

 private:
  const PlaneView& view_;
  const Eigen::Vector3d& centre_;
  const double root_;  // of the factor
};

}  // namespace strata

#endif  // STRATA_CORE_POSEGRAPH_COSTS_PLANE_COST_H_
