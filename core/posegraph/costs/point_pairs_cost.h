// Corresponding points of two scans (thesis 7.17) as seven pairs that weigh the same as all of
// them. Internal to core/posegraph, not installed.
#ifndef STRATA_CORE_POSEGRAPH_COSTS_POINT_PAIRS_COST_H_
#define STRATA_CORE_POSEGRAPH_COSTS_POINT_PAIRS_COST_H_

#include <Eigen/Core>
#include <ceres/sized_cost_function.h>

#include "core/geometry/pose.h"
#include "core/posegraph/pose_graph.h"

namespace strata {

// Six pairs of directions that stand for the scatter and the pair of means, all times the square
// root of their weight: Σ w |T_i a − T_j b|² = Σ |R_i a − R_j b|² + |weight · (t_i − t_j) + R_i a −
// R_j b|² of the means.
struct PointPairs {
  Eigen::Matrix<double, 3, 7> a, b;  // the last column is the means
  double weight = 0.0;               // square root of Σ w
  double least = 0.0;                // the cost at the best relative pose of these pairs alone
};

// REQUIRES: `moments` positive semidefinite with the homogeneous rows alike.
PointPairs SummarisePairs(const PairMoments& moments);

double PointPairsChi2(const PointPairs& pairs, const Pose& T_i, const Pose& T_j);

// weight · factor · the pairs' cost, of two pose blocks.
class PointPairsCost final : public ceres::SizedCostFunction<21, 7, 7> {
 public:
  // `pairs` outlives this; `weight` is read whenever this is evaluated.
  PointPairsCost(const PointPairs& pairs, double factor, const double* weight);
  bool Evaluate(double const* const* blocks, double* residuals, double** jacobians) const override;

 private:
  const PointPairs& pairs_;
  const double factor_;
  const double* const weight_;
};

}  // namespace strata

#endif  // STRATA_CORE_POSEGRAPH_COSTS_POINT_PAIRS_COST_H_
