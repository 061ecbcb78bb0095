#include "client/cli/posegraph/constraint_residual.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "core/geometry/eigen_solvers.h"

namespace strata::cli {
namespace {

int RankOf(const Matrix6d& information) {
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(information, Eigen::EigenvaluesOnly);
  const double least = 1e-9 * std::max(eigen.eigenvalues().maxCoeff(), 1e-300);
  return static_cast<int>((eigen.eigenvalues().array() > least).count());
}

ConstraintResidual ResidualOf(const Constraint& constraint,
                              const Pose& T_map_i,
                              const Pose& T_map_j) {
  const Pose T_i_j = T_map_i.inverse() * T_map_j;
  const Pose step = constraint.T_i_j.inverse() * T_i_j;
  const Eigen::Quaterniond q(step.linear());
  Vector6d e;
  e << std::copysign(2.0, q.w()) * q.vec(), step.translation();
  ConstraintResidual residual;
  residual.constraint = &constraint;
  residual.T_map_i = constraint.is_prior() ? constraint.T_i_j : T_map_i;
  residual.T_map_j = T_map_j;
  residual.normalised_chi2 =
      e.dot(constraint.information * e) / std::max(RankOf(constraint.information), 1);
  residual.rotation_rad = RotationAngleRad(step);
  residual.translation_m = e.tail<3>().norm();
  return residual;
}

}  // namespace

std::vector<ConstraintResidual> ResidualsOf(const api::PoseGraphState& state) {
  std::map<ScanId, const Pose*> poses;
  for (const PoseNode& node : state.nodes) poses.emplace(node.id, &node.T_map_scan);
  const Pose map = Pose::Identity();
  std::vector<ConstraintResidual> residuals;
  for (const Constraint& constraint : state.constraints) {
    const auto i = poses.find(constraint.i);
    const auto j = poses.find(constraint.j);
    if (j == poses.end() || (i == poses.end() && !constraint.is_prior())) continue;
    residuals.push_back(
        ResidualOf(constraint, constraint.is_prior() ? map : *i->second, *j->second));
  }
  return residuals;
}

}  // namespace strata::cli
