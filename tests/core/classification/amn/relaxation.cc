#include "tests/core/classification/amn/relaxation.h"

#include <algorithm>
#include <cstddef>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include <coin/ClpSimplex.hpp>
#include <coin/CoinPackedMatrix.hpp>

namespace strata::testing {
namespace {

// Columns: y_i^k, then y_ij^k. Rows: a sum a point, then two bounds an edge and class.
class Program {
 public:
  explicit Program(const AmnProblem& problem)
      : problem_(problem),
        classes_(static_cast<int>(problem.classes())),
        points_(static_cast<int>(problem.points())),
        edges_(static_cast<int>(problem.edges.size())) {
    AddObjective();
    for (int i = 0; i < points_; ++i) AddSum(i);
    for (int e = 0; e < edges_; ++e) AddEdge(e);
  }

  absl::StatusOr<AmnRelaxation> Solve() {
    const CoinPackedMatrix matrix(
        false, row_.data(), column_.data(), value_.data(), static_cast<CoinBigIndex>(row_.size()));
    const std::vector<double> lower(objective_.size(), 0.0);
    const std::vector<double> upper(objective_.size(), COIN_DBL_MAX);
    ClpSimplex simplex;
    simplex.setLogLevel(0);
    simplex.loadProblem(matrix,
                        lower.data(),
                        upper.data(),
                        objective_.data(),
                        row_lower_.data(),
                        row_upper_.data());
    simplex.setOptimizationDirection(-1.0);  // maximise
    simplex.dual();
    if (!simplex.isProvenOptimal()) {
      return absl::ResourceExhaustedError(absl::StrCat("the linear program of ",
                                                       points_,
                                                       " points was not solved (Clp status ",
                                                       simplex.status(),
                                                       "); use fewer points"));
    }
    AmnRelaxation relaxation;
    relaxation.score = simplex.objectiveValue();
    const double* y = simplex.getColSolution();
    using Rows = Eigen::Map<const ScoreMatrix>;
    relaxation.share = Rows(y, points_, classes_);
    relaxation.edge_share =
        Rows(y + static_cast<std::ptrdiff_t>(points_) * classes_, edges_, classes_);
    return relaxation;
  }

 private:
  int NodeColumn(std::uint32_t i, int k) const { return static_cast<int>(i) * classes_ + k; }
  int EdgeColumn(int e, int k) const { return (points_ + e) * classes_ + k; }

  void AddObjective() {
    for (int i = 0; i < points_; ++i) {
      for (int k = 0; k < classes_; ++k) objective_.push_back(problem_.node_scores(i, k));
    }
    for (int e = 0; e < edges_; ++e) {
      for (int k = 0; k < classes_; ++k) objective_.push_back(problem_.edge_scores[k]);
    }
  }
  void Put(int column, double value) {
    row_.push_back(static_cast<int>(row_lower_.size()));
    column_.push_back(column);
    value_.push_back(value);
  }
  void EndRow(double lower, double upper) {
    row_lower_.push_back(lower);
    row_upper_.push_back(upper);
  }
  void AddSum(int i) {
    for (int k = 0; k < classes_; ++k) Put(NodeColumn(static_cast<std::uint32_t>(i), k), 1.0);
    EndRow(1.0, 1.0);
  }
  void AddEdge(int e) {
    const NetworkEdge& edge = problem_.edges[static_cast<std::size_t>(e)];
    for (int k = 0; k < classes_; ++k) {
      for (const std::uint32_t end : {edge.i, edge.j}) {
        Put(EdgeColumn(e, k), 1.0);
        Put(NodeColumn(end, k), -1.0);
        EndRow(-COIN_DBL_MAX, 0.0);
      }
    }
  }

  const AmnProblem& problem_;
  const int classes_;
  const int points_;
  const int edges_;
  std::vector<int> row_;
  std::vector<int> column_;
  std::vector<double> value_;
  std::vector<double> objective_;
  std::vector<double> row_lower_;
  std::vector<double> row_upper_;
};

}  // namespace

absl::StatusOr<AmnRelaxation> RelaxScore(const AmnProblem& problem) {
  if (problem.points() == 0) return AmnRelaxation();
  return Program(problem).Solve();
}

}  // namespace strata::testing
