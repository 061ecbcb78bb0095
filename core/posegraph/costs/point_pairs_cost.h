// Corresponding points of two scans (thesis 7.17) as seven pairs that weigh the same as all of
// them. Internal to core/posegraph, not installed.
#ifndef STRATA_CORE_POSEGRAPH_COSTS_POINT_PAIRS_COST_H_
#define STRATA_CORE_POSEGRAPH_COSTS_POINT_PAIRS_COST_H_

#include <Eigen/Core>

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

double PointPairsCost(const PointPairs& pairs, const Pose& T_i, const Pose& T_j);

struct PointPairsDerivatives {
  double cost = 0.0;
  // Gauss–Newton blocks and JᵀΩe, by right-hand steps on T_i and T_j.
  Matrix6d ii, ij, jj;
  Vector6d gradient_i, gradient_j;
};
PointPairsDerivatives DifferentiatePointPairs(const PointPairs& pairs,
                                              const Pose& T_i,
                                              const Pose& T_j);

}  // namespace strata

#endif  // STRATA_CORE_POSEGRAPH_COSTS_POINT_PAIRS_COST_H_
