#include "core/posegraph/covariance.h"

#include <cstddef>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include <Eigen/Core>

#include "core/common/status.h"
#include "core/posegraph/block_cholesky.h"
#include "core/posegraph/gauge.h"
#include "core/posegraph/graph_least_squares.h"
#include "core/posegraph/pose_graph_checks.h"

namespace strata {
namespace {

// Variances above this (1,000 km, squared) are not known but made by what keeps the system
// definite.
constexpr double kUnknown = 1e12;

absl::Status Undetermined() {
  return absl::FailedPreconditionError(
      "pose graph: its terms leave a pose undetermined; add a term or fix the pose");
}

}  // namespace

absl::StatusOr<std::vector<Matrix6d>> MarginalCovariances(const PoseGraphProblem& problem,
                                                          const std::vector<std::size_t>& nodes,
                                                          const Stop& stop) {
  STRATA_RETURN_IF_ERROR(ValidateProblem(problem));
  const std::size_t count = problem.T_map_scan.size();
  for (const std::size_t node : nodes) {
    if (node < count) continue;
    return absl::InvalidArgumentError(
        absl::StrCat("node ", node, " of covariance: there are ", count, " poses"));
  }
  STRATA_RETURN_IF_ERROR(stop.status());
  std::vector<bool> held = problem.fixed;
  held.resize(count, false);
  for (const std::size_t node : NodesToHold(problem)) held[node] = true;

  GraphLeastSquares squares(problem, held, 1.0, 1.0);
  BlockCholesky H = squares.MakeSystem();
  Eigen::VectorXd gradient;
  squares.Linearise(H, gradient);
  if (!H.Factor(Eigen::VectorXd::Zero(gradient.size()))) return Undetermined();
  STRATA_RETURN_IF_ERROR(stop.status());
  const Eigen::MatrixXd diagonal = H.InverseDiagonal();

  std::vector<Eigen::Index> row_of_node(count, -1);
  Eigen::Index rows = 0;
  for (std::size_t n = 0; n < count; ++n) {
    if (!held[n]) row_of_node[n] = 6 * rows++;
  }
  std::vector<Matrix6d> covariances;
  for (const std::size_t node : nodes) {
    covariances.emplace_back(Matrix6d::Zero());
    if (row_of_node[node] < 0) continue;
    covariances.back() = diagonal.middleRows<6>(row_of_node[node]);
    if (!(covariances.back().diagonal().maxCoeff() < kUnknown)) return Undetermined();
  }
  return covariances;
}

}  // namespace strata
