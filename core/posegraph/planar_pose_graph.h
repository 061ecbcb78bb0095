// Pose graphs in the plane, as g2o's EDGE_SE2 and TORO's EDGE2 have them; the error is another than
// in space. The database has none: this is for files. Metres and radians.
#ifndef STRATA_CORE_POSEGRAPH_PLANAR_POSE_GRAPH_H_
#define STRATA_CORE_POSEGRAPH_PLANAR_POSE_GRAPH_H_

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "core/posegraph/convergence.h"

namespace strata {

// x, y, angle; T_a_b maps frame b into frame a as in space.
using PlanarPose = Eigen::Vector3d;

// Error [t, angle]: t = R_ijᵀ (R_iᵀ (t_j − t_i) − t_ij), angle = θ_j − θ_i − θ_ij in (−π, π].
struct PlanarRelativeTerm {
  std::size_t i = 0, j = 0;
  PlanarPose T_i_j = PlanarPose::Zero();
  Eigen::Matrix3d information = Eigen::Matrix3d::Identity();  // of the error
  bool may_be_false = false;                                  // a loop closure
};

struct PlanarPoseGraph {
  std::vector<PlanarPose> poses;  // T_map_robot, where to start from
  std::vector<bool> fixed;        // empty: none
  std::vector<PlanarRelativeTerm> relative;
};

struct PlanarOptions {
  ConvergenceOptions convergence;
  // As PoseGraphOptions::max_closure_chi2; the 99.9 % quantile for 3 degrees of freedom.
  double max_closure_chi2 = 16.266;
};

struct PlanarSolution {
  std::vector<PlanarPose> poses;  // angles in (−π, π]
  double chi2_before = 0.0;       // Σ eᵀΩe of all terms
  double chi2_after = 0.0;
  int iterations = 0;
  PoseGraphTermination termination = PoseGraphTermination::kConverged;
  std::vector<std::size_t> rejected;  // terms, ascending
};

}  // namespace strata

#endif  // STRATA_CORE_POSEGRAPH_PLANAR_POSE_GRAPH_H_
