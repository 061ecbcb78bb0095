#include "tests/core/classification/amn/quadratic_program.h"

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include <coin/IpIpoptApplication.hpp>
#include <coin/IpSolveStatistics.hpp>
#include <coin/IpTNLP.hpp>

#include "core/common/status.h"

namespace strata::testing {
namespace {

using Ipopt::Index;
using Ipopt::Number;

constexpr Number kInfinity = 2e19;  // Ipopt's

// Variables: w_n class by class, w_e, ξ, α_i, then α_ij^k and α_ji^k. Constraints in the order of
// eq. 9.7: the margin, one a point and class, one an edge and class.
class MarginNlp final : public Ipopt::TNLP {
 public:
  MarginNlp(const AmnTrainingSet& set, double c, AmnLearning& result)
      : set_(set),
        c_(c),
        result_(result),
        classes_(static_cast<Index>(set.classes)),
        features_(static_cast<Index>(set.features.cols())),
        points_(static_cast<Index>(set.labels.size())),
        edges_(static_cast<Index>(set.edges.size())) {
    AddMargin();
    AddPoints();
    AddEdges();
  }

  bool get_nlp_info(
      Index& n, Index& m, Index& nnz_jac, Index& nnz_hessian, IndexStyleEnum& style) override {
    n = Variables();
    m = static_cast<Index>(lower_.size());
    nnz_jac = static_cast<Index>(value_.size());
    nnz_hessian = Slack();
    style = C_STYLE;
    return true;
  }

  bool get_bounds_info(Index n,
                       Number* x_lower,
                       Number* x_upper,
                       Index m,
                       Number* g_lower,
                       Number* g_upper) override {
    for (Index v = 0; v < n; ++v) {
      const bool positive = v >= EdgeWeight(0) && (v <= Slack() || v >= EdgeDual(0, 0, 0));
      x_lower[v] = positive ? 0.0 : -kInfinity;
      x_upper[v] = kInfinity;
    }
    for (Index r = 0; r < m; ++r) {
      g_lower[r] = lower_[static_cast<std::size_t>(r)];
      g_upper[r] = kInfinity;
    }
    return true;
  }

  bool get_starting_point(Index n,
                          bool /*init_x*/,
                          Number* x,
                          bool /*init_z*/,
                          Number* /*z_lower*/,
                          Number* /*z_upper*/,
                          Index /*m*/,
                          bool /*init_lambda*/,
                          Number* /*lambda*/) override {
    for (Index v = 0; v < n; ++v) x[v] = v >= Slack() ? 1.0 : 0.0;
    return true;
  }

  bool eval_f(Index /*n*/, const Number* x, bool /*new_x*/, Number& value) override {
    value = c_ * x[Slack()];
    for (Index v = 0; v < Slack(); ++v) value += 0.5 * x[v] * x[v];
    return true;
  }

  bool eval_grad_f(Index n, const Number* x, bool /*new_x*/, Number* gradient) override {
    for (Index v = 0; v < n; ++v) gradient[v] = v < Slack() ? x[v] : 0.0;
    gradient[Slack()] = c_;
    return true;
  }

  bool eval_g(Index /*n*/, const Number* x, bool /*new_x*/, Index m, Number* g) override {
    for (Index r = 0; r < m; ++r) g[r] = 0.0;
    for (std::size_t k = 0; k < value_.size(); ++k) g[row_[k]] += value_[k] * x[column_[k]];
    return true;
  }

  bool eval_jac_g(Index /*n*/,
                  const Number* /*x*/,
                  bool /*new_x*/,
                  Index /*m*/,
                  Index count,
                  Index* rows,
                  Index* columns,
                  Number* values) override {
    for (Index k = 0; k < count; ++k) {
      const auto at = static_cast<std::size_t>(k);
      if (values != nullptr) {
        values[k] = value_[at];
      } else {
        rows[k] = row_[at];
        columns[k] = column_[at];
      }
    }
    return true;
  }

  bool eval_h(Index /*n*/,
              const Number* /*x*/,
              bool /*new_x*/,
              Number factor,
              Index /*m*/,
              const Number* /*lambda*/,
              bool /*new_lambda*/,
              Index count,
              Index* rows,
              Index* columns,
              Number* values) override {
    for (Index k = 0; k < count; ++k) {
      if (values != nullptr) {
        values[k] = factor;
      } else {
        rows[k] = columns[k] = k;
      }
    }
    return true;
  }

  void finalize_solution(Ipopt::SolverReturn status,
                         Index /*n*/,
                         const Number* x,
                         const Number* /*z_lower*/,
                         const Number* /*z_upper*/,
                         Index /*m*/,
                         const Number* /*g*/,
                         const Number* /*lambda*/,
                         Number objective,
                         const Ipopt::IpoptData* /*data*/,
                         Ipopt::IpoptCalculatedQuantities* /*quantities*/) override {
    result_.converged = status == Ipopt::SUCCESS;
    result_.objective = result_.lower_bound = objective;
    result_.weights.node.resize(classes_, features_);
    for (Index k = 0; k < classes_; ++k) {
      for (Index f = 0; f < features_; ++f) result_.weights.node(k, f) = x[NodeWeight(k, f)];
    }
    // What an interior point leaves of zeros may be below zero.
    result_.weights.edge.resize(classes_);
    for (Index k = 0; k < classes_; ++k) {
      result_.weights.edge[k] = std::max(0.0, x[EdgeWeight(k)]);
    }
  }

 private:
  Index NodeWeight(Index k, Index f) const { return k * features_ + f; }
  Index EdgeWeight(Index k) const { return classes_ * features_ + k; }
  Index Slack() const { return classes_ * (features_ + 1); }
  Index PointDual(Index i) const { return Slack() + 1 + i; }
  // Of edge e at its end i (0) or j (1).
  Index EdgeDual(Index e, Index k, Index end) const {
    return Slack() + 1 + points_ + 2 * (e * classes_ + k) + end;
  }
  Index Variables() const { return EdgeDual(edges_, 0, 0); }

  void Put(Index column, Number value) {
    row_.push_back(static_cast<Index>(lower_.size()));
    column_.push_back(column);
    value_.push_back(value);
  }
  void EndRow(Number lower) { lower_.push_back(lower); }

  // w X ŷ + ξ − Σ α_i ≥ N
  void AddMargin() {
    Eigen::MatrixXd node = Eigen::MatrixXd::Zero(classes_, features_);
    Eigen::VectorXd edge = Eigen::VectorXd::Zero(classes_);
    for (Index i = 0; i < points_; ++i) {
      const auto at = static_cast<std::size_t>(i);
      node.row(set_.labels[at]) += set_.Count(at) * set_.features.row(i).cast<double>();
      edge[set_.labels[at]] += set_.InnerEdges(at);
    }
    for (const NetworkEdge& e : set_.edges) {
      if (set_.labels[e.i] == set_.labels[e.j]) edge[set_.labels[e.i]] += 1.0;
    }
    for (Index k = 0; k < classes_; ++k) {
      for (Index f = 0; f < features_; ++f) Put(NodeWeight(k, f), node(k, f));
      Put(EdgeWeight(k), edge[k]);
    }
    Put(Slack(), 1.0);
    for (Index i = 0; i < points_; ++i) Put(PointDual(i), -1.0);
    EndRow(set_.TotalCount());
  }

  // α_i − Σ_j α_ij^k − w_n^k · x_i ≥ −ŷ_i^k
  void AddPoints() {
    std::vector<std::vector<std::pair<Index, Index>>> ends(static_cast<std::size_t>(points_));
    for (Index e = 0; e < edges_; ++e) {
      const NetworkEdge& edge = set_.edges[static_cast<std::size_t>(e)];
      ends[edge.i].emplace_back(e, 0);
      ends[edge.j].emplace_back(e, 1);
    }
    for (Index i = 0; i < points_; ++i) {
      const auto at = static_cast<std::size_t>(i);
      for (Index k = 0; k < classes_; ++k) {
        Put(PointDual(i), 1.0);
        for (const auto& [e, end] : ends[at]) Put(EdgeDual(e, k, end), -1.0);
        for (Index f = 0; f < features_; ++f) {
          Put(NodeWeight(k, f), -set_.Count(at) * static_cast<double>(set_.features(i, f)));
        }
        Put(EdgeWeight(k), -set_.InnerEdges(at));
        EndRow(set_.labels[at] == k ? -set_.Count(at) : 0.0);
      }
    }
  }

  // α_ij^k + α_ji^k − w_e^k ≥ 0
  void AddEdges() {
    for (Index e = 0; e < edges_; ++e) {
      for (Index k = 0; k < classes_; ++k) {
        Put(EdgeDual(e, k, 0), 1.0);
        Put(EdgeDual(e, k, 1), 1.0);
        Put(EdgeWeight(k), -1.0);
        EndRow(0.0);
      }
    }
  }

  const AmnTrainingSet& set_;
  const double c_;
  AmnLearning& result_;
  const Index classes_;
  const Index features_;
  const Index points_;
  const Index edges_;
  std::vector<Index> row_;
  std::vector<Index> column_;
  std::vector<Number> value_;
  std::vector<Number> lower_;  // of every constraint
};

}  // namespace

absl::StatusOr<AmnLearning> LearnByQuadraticProgram(const AmnTrainingSet& set,
                                                    const AmnLearningOptions& options) {
  STRATA_RETURN_IF_ERROR(options.Validate());
  AmnLearning result;
  const double c = options.slack_weight / std::max(1.0, set.TotalCount());
  const Ipopt::SmartPtr<Ipopt::TNLP> program = new MarginNlp(set, c, result);
  const Ipopt::SmartPtr<Ipopt::IpoptApplication> solver = IpoptApplicationFactory();
  solver->Options()->SetIntegerValue("print_level", 0);
  solver->Options()->SetStringValue("sb", "yes");  // no banner
  solver->Options()->SetStringValue("hessian_constant", "yes");
  solver->Options()->SetStringValue("jac_d_constant", "yes");
  solver->Options()->SetNumericValue("tol", 0.01 * options.tolerance);
  solver->Options()->SetIntegerValue("max_iter", options.max_iterations);
  if (solver->Initialize() != Ipopt::Solve_Succeeded) {
    return absl::InternalError("Ipopt does not start");
  }
  const Ipopt::ApplicationReturnStatus ended = solver->OptimizeTNLP(program);
  if (Ipopt::IsValid(solver->Statistics())) {
    result.iterations = solver->Statistics()->IterationCount();
  }
  if (result.converged) return result;
  return absl::ResourceExhaustedError(absl::StrCat("the quadratic program of ",
                                                   set.labels.size(),
                                                   " points was not solved (Ipopt status ",
                                                   static_cast<int>(ended),
                                                   "); use fewer points, or cutting planes"));
}

}  // namespace strata::testing
