// A pose graph as a problem of Ceres. Internal to core/posegraph, not installed.
#ifndef STRATA_CORE_POSEGRAPH_SOLVER_GRAPH_PROBLEM_H_
#define STRATA_CORE_POSEGRAPH_SOLVER_GRAPH_PROBLEM_H_

#include <cstddef>
#include <vector>

#include <Eigen/Core>
#include <ceres/manifold.h>
#include <ceres/problem.h>
#include <ceres/sphere_manifold.h>

#include "core/geometry/pose.h"
#include "core/geometry/primitives.h"
#include "core/posegraph/costs/direction_cost.h"
#include "core/posegraph/costs/plane_cost.h"
#include "core/posegraph/costs/pose_block.h"
#include "core/posegraph/pose_graph.h"
#include "core/posegraph/solver/manifolds.h"

namespace strata {

// Built once; the weights of its terms may change between minimisations.
class GraphProblem {
 public:
  // `graph` is valid and outlives this; `held` marks the nodes that do not move; the factors weigh
  // local (relative) and global terms (planes, directions,
  // priors).
  GraphProblem(const PoseGraphProblem& graph,
               const std::vector<bool>& held,
               double local_factor,
               double global_factor);
  GraphProblem(const GraphProblem&) = delete;
  GraphProblem& operator=(const GraphProblem&) = delete;

  ceres::Problem& problem() { return problem_; }
  // Moves all blocks back to where they were built.
  void Restart();
  // From now on the pose stays.
  void Hold(std::size_t node) { problem_.SetParameterBlockConstant(poses_[node].data()); }

  // What the terms count, 1 at first; by PoseGraphProblem::relative and ::priors.
  std::vector<double>& relative_weights() { return relative_weights_; }
  std::vector<double>& prior_weights() { return prior_weights_; }

  // Where the blocks are, without weights and factors.
  double RelativeChi2(std::size_t term) const;
  double ViewChi2(std::size_t plane, std::size_t view) const;
  double DirectionChi2(std::size_t direction, std::size_t view) const;
  double PriorChi2(std::size_t term) const;

  std::vector<Pose> poses() const;
  std::vector<Plane> planes() const;

 private:
  void AddNodes();
  void AddRelative(double factor);
  void AddPlanes(double factor);
  void AddDirections(double factor);
  void AddPriors(double factor);
  void Damp(double factor);
  Pose pose(std::size_t node) const { return PoseOf(poses_[node].data()); }

  const PoseGraphProblem& graph_;
  const std::vector<bool>& held_;
  std::vector<PoseBlock> poses_;
  std::vector<PlaneBlock> planes_;
  std::vector<Eigen::Vector3d> centres_;  // of the planes
  std::vector<std::vector<PlaneView>> views_;
  std::vector<DirectionBlock> directions_;
  std::vector<double> relative_weights_, prior_weights_;
  PoseManifold pose_manifold_;
  PlaneManifold plane_manifold_;
  ceres::SphereManifold<3> direction_manifold_;
  ceres::Problem problem_;
};

}  // namespace strata

#endif  // STRATA_CORE_POSEGRAPH_SOLVER_GRAPH_PROBLEM_H_
