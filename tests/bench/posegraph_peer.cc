#include "tests/bench/posegraph_peer.h"

#include <array>
#include <cstddef>
#include <memory>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <ceres/ceres.h>

namespace strata::bench {
namespace {

struct Node {
  Eigen::Vector3d t;
  Eigen::Quaterniond q;
};

std::vector<Node> NodesOf(const PoseGraphProblem& problem) {
  std::vector<Node> nodes;
  for (const Pose& T : problem.T_map_scan) {
    nodes.push_back({T.translation(), Eigen::Quaterniond(T.linear())});
  }
  return nodes;
}

// sqrt(Ω) · [2 vec q(Δ), translation of Δ].
struct EdgeFunctor {
  explicit EdgeFunctor(const RelativePoseTerm& term)
      : t_i_j(term.T_i_j.translation()), q_i_j(term.T_i_j.linear()) {
    root = term.information.llt().matrixL().transpose();
  }
  template <typename T>
  bool operator()(const T* ti, const T* qi, const T* tj, const T* qj, T* residuals) const {
    const Eigen::Map<const Eigen::Matrix<T, 3, 1>> p_i(ti), p_j(tj);
    const Eigen::Map<const Eigen::Quaternion<T>> q_i(qi), q_j(qj);
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

std::unique_ptr<ceres::CostFunction> CostOf(const RelativePoseTerm& term) {
  return std::make_unique<ceres::AutoDiffCostFunction<EdgeFunctor, 6, 3, 4, 3, 4>>(
      new EdgeFunctor(term));
}

}  // namespace

PeerSolution SolveWithCeres(const PoseGraphProblem& problem) {
  std::vector<Node> nodes = NodesOf(problem);
  ceres::Problem peer;
  for (const RelativePoseTerm& term : problem.relative) {
    Node& i = nodes[term.i];
    Node& j = nodes[term.j];
    peer.AddResidualBlock(CostOf(term).release(),
                          nullptr,
                          i.t.data(),
                          i.q.coeffs().data(),
                          j.t.data(),
                          j.q.coeffs().data());
  }
  auto* manifold = new ceres::EigenQuaternionManifold;  // the problem takes it
  for (Node& node : nodes) peer.SetManifold(node.q.coeffs().data(), manifold);
  peer.SetParameterBlockConstant(nodes[0].t.data());
  peer.SetParameterBlockConstant(nodes[0].q.coeffs().data());
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.sparse_linear_algebra_library_type = ceres::SUITE_SPARSE;
  options.max_num_iterations = 200;
  options.function_tolerance = 1e-7;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &peer, &summary);

  PoseGraphProblem solved = problem;
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    solved.T_map_scan[n] = MakePose(nodes[n].q, nodes[n].t);
  }
  return {Chi2(solved), static_cast<int>(summary.iterations.size()) - 1};
}

struct PeerEdges::Impl {
  std::vector<Node> nodes;
  std::vector<std::unique_ptr<ceres::CostFunction>> costs;
  std::vector<std::array<std::size_t, 2>> ends;
};

PeerEdges::PeerEdges(const PoseGraphProblem& problem) : impl_(std::make_unique<Impl>()) {
  impl_->nodes = NodesOf(problem);
  for (const RelativePoseTerm& term : problem.relative) {
    impl_->costs.push_back(CostOf(term));
    impl_->ends.push_back({term.i, term.j});
  }
}

PeerEdges::~PeerEdges() = default;

double PeerEdges::Evaluate() const {
  double sum = 0.0;
  Eigen::Matrix<double, 6, 1> residuals;
  Eigen::Matrix<double, 6, 3, Eigen::RowMajor> by_ti, by_tj;
  Eigen::Matrix<double, 6, 4, Eigen::RowMajor> by_qi, by_qj;
  for (std::size_t k = 0; k < impl_->costs.size(); ++k) {
    const Node& i = impl_->nodes[impl_->ends[k][0]];
    const Node& j = impl_->nodes[impl_->ends[k][1]];
    const double* parameters[] = {i.t.data(), i.q.coeffs().data(), j.t.data(), j.q.coeffs().data()};
    double* jacobians[] = {by_ti.data(), by_qi.data(), by_tj.data(), by_qj.data()};
    impl_->costs[k]->Evaluate(parameters, residuals.data(), jacobians);
    sum += residuals.sum() + by_ti.sum() + by_qi.sum() + by_tj.sum() + by_qj.sum();
  }
  return sum;
}

}  // namespace strata::bench
