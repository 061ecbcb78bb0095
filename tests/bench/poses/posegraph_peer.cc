#include "tests/bench/poses/posegraph_peer.h"

#include <cstddef>
#include <memory>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <ceres/ceres.h>

#include "core/posegraph/costs/relative_pose_cost.h"
#include "core/posegraph/solver/optimize_pose_graph.h"

namespace strata::bench {
namespace {

// sqrt(Ω) · [2 vec q(Δ), translation of Δ].
struct EdgeFunctor {
  explicit EdgeFunctor(const RelativePoseTerm& term)
      : t_i_j(term.T_i_j.translation()), q_i_j(term.T_i_j.linear()) {
    root = term.information.llt().matrixL().transpose();
  }
  template <typename T>
  bool operator()(const T* i, const T* j, T* residuals) const {
    const Eigen::Map<const Eigen::Quaternion<T>> q_i(i), q_j(j);
    const Eigen::Map<const Eigen::Matrix<T, 3, 1>> p_i(i + 4), p_j(j + 4);
    const Eigen::Quaternion<T> back = q_i_j.cast<T>().conjugate();
    const Eigen::Quaternion<T> q = back * (q_i.conjugate() * q_j);
    const Eigen::Matrix<T, 3, 1> t = back * (q_i.conjugate() * (p_j - p_i) - t_i_j.cast<T>());
    Eigen::Matrix<T, 6, 1> e;
    e.template head<3>() = (q.w() < T(0) ? T(-2) : T(2)) * q.vec();
    e.template tail<3>() = t;
    Eigen::Map<Eigen::Matrix<T, 6, 1>> out(residuals);
    out = root.cast<T>() * e;
    return true;
  }
  Eigen::Vector3d t_i_j;
  Eigen::Quaterniond q_i_j;
  Matrix6d root;
};

std::unique_ptr<ceres::CostFunction> AutomaticCostOf(const RelativePoseTerm& term) {
  return std::make_unique<ceres::AutoDiffCostFunction<EdgeFunctor, 6, 7, 7>>(new EdgeFunctor(term));
}

std::vector<PoseBlock> BlocksOf(const PoseGraphProblem& problem) {
  std::vector<PoseBlock> blocks;
  for (const Pose& T : problem.T_map_scan) blocks.push_back(PoseBlockOf(T));
  return blocks;
}

}  // namespace

PeerSolution SolveWithCeres(const PoseGraphProblem& problem) {
  std::vector<PoseBlock> blocks = BlocksOf(problem);
  ceres::Problem peer;
  for (const RelativePoseTerm& term : problem.relative) {
    peer.AddResidualBlock(
        AutomaticCostOf(term).release(), nullptr, blocks[term.i].data(), blocks[term.j].data());
  }
  // The problem takes it.
  auto* manifold =
      new ceres::ProductManifold<ceres::EigenQuaternionManifold, ceres::EuclideanManifold<3>>;
  for (PoseBlock& block : blocks) peer.SetManifold(block.data(), manifold);
  peer.SetParameterBlockConstant(blocks[0].data());
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.sparse_linear_algebra_library_type = ceres::SUITE_SPARSE;
  options.initial_trust_region_radius = 1e12;
  options.max_num_iterations = 200;
  options.function_tolerance = 1e-7;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &peer, &summary);

  PoseGraphProblem solved = problem;
  for (std::size_t n = 0; n < blocks.size(); ++n) {
    solved.T_map_scan[n] = PoseOf(blocks[n].data());
  }
  return {Chi2(solved), summary.num_linear_solves};
}

EdgeCosts::EdgeCosts(const PoseGraphProblem& problem, Kind kind) : blocks_(BlocksOf(problem)) {
  static const double kWeight = 1.0;
  for (const RelativePoseTerm& term : problem.relative) {
    if (kind == Kind::kOurs) {
      costs_.push_back(std::make_unique<RelativePoseCost>(term.T_i_j, term.information, &kWeight));
    } else {
      costs_.push_back(AutomaticCostOf(term));
    }
    ends_.emplace_back(term.i, term.j);
  }
}

double EdgeCosts::Evaluate() const {
  double sum = 0.0;
  Eigen::Matrix<double, 6, 1> residuals;
  Eigen::Matrix<double, 6, 7, Eigen::RowMajor> by_i, by_j;
  for (std::size_t k = 0; k < costs_.size(); ++k) {
    const double* blocks[] = {blocks_[ends_[k].first].data(), blocks_[ends_[k].second].data()};
    double* jacobians[] = {by_i.data(), by_j.data()};
    costs_[k]->Evaluate(blocks, residuals.data(), jacobians);
    sum += residuals.sum() + by_i.sum() + by_j.sum();
  }
  return sum;
}

}  // namespace strata::bench
