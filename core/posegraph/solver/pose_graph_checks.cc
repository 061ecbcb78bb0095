#include "core/posegraph/solver/pose_graph_checks.h"

#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include <Eigen/Core>

#include "core/common/status.h"
#include "core/posegraph/semidefinite.h"

namespace strata {
namespace {

constexpr double kLargestCoordinate = 1e8;  // as ValidatePose()
constexpr double kLargest = std::numeric_limits<double>::max();

absl::Status InRange(absl::string_view field, double value, double low, double high) {
  if (value >= low && value <= high) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(
      "pose graph options: ", field, " is ", value, ", must be in [", low, ", ", high, "]"));
}

absl::Status ValidateNode(std::size_t node, std::size_t nodes, absl::string_view field) {
  if (node < nodes) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(field, " is ", node, ", but there are ", nodes, " poses"));
}

absl::Status ValidateEnds(std::size_t i, std::size_t j, std::size_t nodes) {
  STRATA_RETURN_IF_ERROR(ValidateNode(i, nodes, "i"));
  STRATA_RETURN_IF_ERROR(ValidateNode(j, nodes, "j"));
  if (i == j) return absl::InvalidArgumentError(absl::StrCat("i and j are both ", i));
  return absl::OkStatus();
}

absl::Status Validate(const RelativePoseTerm& term, std::size_t nodes) {
  STRATA_RETURN_IF_ERROR(ValidateEnds(term.i, term.j, nodes));
  STRATA_RETURN_IF_ERROR(Annotate(ValidatePose(term.T_i_j), "T_i_j"));
  return ValidateSemidefinite<6>(term.information, "information");
}

absl::Status Validate(const PlaneTerm& term, std::size_t nodes) {
  const Plane& plane = term.plane_map;
  if (!plane.normal.allFinite() || !std::isfinite(plane.distance) ||
      std::abs(plane.normal.norm() - 1.0) > 1e-6) {
    return absl::InvalidArgumentError(
        absl::StrCat("plane_map: needs finite numbers and a unit normal, has one of length ",
                     plane.normal.norm()));
  }
  for (const PlaneTerm::View& view : term.views) {
    STRATA_RETURN_IF_ERROR(ValidateNode(view.i, nodes, "a view's i"));
    STRATA_RETURN_IF_ERROR(ValidateSemidefinite<4>(
        view.moments, absl::StrCat("moments of the view from pose ", view.i)));
  }
  return absl::OkStatus();
}

absl::Status ValidateUnit(const Eigen::Vector3d& vector, absl::string_view field) {
  if (vector.allFinite() && std::abs(vector.norm() - 1.0) <= 1e-6) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(field, ": has the length ", vector.norm(), ", must be a unit vector"));
}

absl::Status Validate(const DirectionTerm& term, std::size_t nodes) {
  STRATA_RETURN_IF_ERROR(ValidateUnit(term.direction_map, "direction_map"));
  for (const DirectionTerm::View& view : term.views) {
    STRATA_RETURN_IF_ERROR(ValidateNode(view.i, nodes, "a view's i"));
    STRATA_RETURN_IF_ERROR(ValidateUnit(view.normal_scan, "a view's normal_scan"));
    if (!(view.information >= 0.0 && view.information <= kLargest)) {
      return absl::InvalidArgumentError(absl::StrCat("information of the view from pose ",
                                                     view.i,
                                                     " is ",
                                                     view.information,
                                                     ", must be finite and not negative"));
    }
  }
  return absl::OkStatus();
}

absl::Status Validate(const PriorTerm& term, std::size_t nodes) {
  STRATA_RETURN_IF_ERROR(ValidateNode(term.i, nodes, "i"));
  STRATA_RETURN_IF_ERROR(Annotate(ValidatePose(term.T_map_scan), "T_map_scan"));
  return ValidateSemidefinite<6>(term.information, "information");
}

absl::Status ValidateFixed(const std::vector<bool>& fixed, std::size_t nodes) {
  if (fixed.empty() || fixed.size() == nodes) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("pose graph: fixed has ",
                                                 fixed.size(),
                                                 " entries, must have none or one for each of ",
                                                 nodes,
                                                 " poses"));
}

absl::Status ValidateMaxChi2(double max_chi2) {
  if (std::isinf(max_chi2) && max_chi2 > 0.0) return absl::OkStatus();
  return InRange("max_closure_chi2", max_chi2, 1e-12, kLargest);
}

absl::Status ValidatePlanarPose(const PlanarPose& pose) {
  if (!pose.allFinite()) return absl::InvalidArgumentError("pose: not finite");
  const double largest = pose.cwiseAbs().maxCoeff();
  if (largest <= kLargestCoordinate) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("pose: ", largest, " is beyond ", kLargestCoordinate));
}

absl::Status Validate(const PlanarRelativeTerm& term, std::size_t nodes) {
  STRATA_RETURN_IF_ERROR(ValidateEnds(term.i, term.j, nodes));
  STRATA_RETURN_IF_ERROR(Annotate(ValidatePlanarPose(term.T_i_j), "T_i_j"));
  return ValidateSemidefinite<3>(term.information, "information");
}

template <typename Terms>
absl::Status ValidateAll(const Terms& terms, std::size_t nodes, absl::string_view kind) {
  for (std::size_t k = 0; k < terms.size(); ++k) {
    const absl::Status status = Validate(terms[k], nodes);
    if (!status.ok()) return Annotate(status, absl::StrCat("pose graph: ", kind, " ", k));
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status ValidateProblem(const PoseGraphProblem& problem) {
  const std::size_t nodes = problem.T_map_scan.size();
  STRATA_RETURN_IF_ERROR(ValidateFixed(problem.fixed, nodes));
  for (std::size_t i = 0; i < nodes; ++i) {
    const absl::Status status = ValidatePose(problem.T_map_scan[i]);
    if (!status.ok()) return Annotate(status, absl::StrCat("pose graph: T_map_scan ", i));
  }
  STRATA_RETURN_IF_ERROR(ValidateAll(problem.relative, nodes, "relative pose"));
  STRATA_RETURN_IF_ERROR(ValidateAll(problem.planes, nodes, "plane"));
  STRATA_RETURN_IF_ERROR(ValidateAll(problem.directions, nodes, "direction"));
  return ValidateAll(problem.priors, nodes, "prior");
}

absl::Status ValidateOptions(const ConvergenceOptions& options) {
  STRATA_RETURN_IF_ERROR(InRange("max_iterations", options.max_iterations, 1, 10000));
  STRATA_RETURN_IF_ERROR(InRange("cost_tolerance", options.cost_tolerance, 0.0, 0.5));
  return InRange("step_tolerance", options.step_tolerance, 0.0, 0.5);
}

absl::Status ValidateOptions(const PoseGraphOptions& options) {
  STRATA_RETURN_IF_ERROR(ValidateOptions(options.convergence));
  STRATA_RETURN_IF_ERROR(InRange("local_weight", options.local_weight, 1e-6, 1.0 - 1e-6));
  return ValidateMaxChi2(options.max_closure_chi2);
}

absl::Status ValidateProblem(const PlanarPoseGraph& graph) {
  const std::size_t nodes = graph.poses.size();
  STRATA_RETURN_IF_ERROR(ValidateFixed(graph.fixed, nodes));
  for (std::size_t i = 0; i < nodes; ++i) {
    const absl::Status status = ValidatePlanarPose(graph.poses[i]);
    if (!status.ok()) return Annotate(status, absl::StrCat("pose graph: pose ", i));
  }
  return ValidateAll(graph.relative, nodes, "relative pose");
}

absl::Status ValidateOptions(const PlanarOptions& options) {
  STRATA_RETURN_IF_ERROR(ValidateOptions(options.convergence));
  return ValidateMaxChi2(options.max_closure_chi2);
}

}  // namespace strata
