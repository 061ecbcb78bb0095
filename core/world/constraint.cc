#include "core/world/constraint.h"

#include "absl/strings/str_cat.h"

#include "core/common/status.h"
#include "core/geometry/eigen_solvers.h"
#include "core/world/names.h"

namespace strata {
namespace {

constexpr double kMaxInformation = 1e15;
constexpr std::size_t kMaxNote = 1000;

absl::Status ValidateInformation(const Matrix6d& information) {
  if (!information.allFinite() || information.cwiseAbs().maxCoeff() > kMaxInformation) {
    return absl::InvalidArgumentError("information is not finite or beyond 1e15");
  }
  const double scale = information.cwiseAbs().maxCoeff();
  if ((information - information.transpose()).cwiseAbs().maxCoeff() > 1e-9 * scale) {
    return absl::InvalidArgumentError("information is not symmetric");
  }
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(information, Eigen::EigenvaluesOnly);
  if (eigen.eigenvalues().minCoeff() < -1e-9 * scale) {
    return absl::InvalidArgumentError(absl::StrCat("information has the negative eigenvalue ",
                                                   eigen.eigenvalues().minCoeff(),
                                                   "; it must be positive semidefinite"));
  }
  if (scale == 0.0) return absl::InvalidArgumentError("information is zero: nothing is known");
  return absl::OkStatus();
}

}  // namespace

absl::Status ValidateConstraint(const Constraint& constraint) {
  if (!constraint.is_prior()) {
    STRATA_RETURN_IF_ERROR(ValidateName("trajectory name of i", constraint.i.trajectory));
    if (constraint.i == constraint.j) {
      return absl::InvalidArgumentError(absl::StrCat(
          "scan ", constraint.i.ToString(), " cannot be held against itself; name two scans"));
    }
  }
  STRATA_RETURN_IF_ERROR(ValidateName("trajectory name of j", constraint.j.trajectory));
  STRATA_RETURN_IF_ERROR(ValidatePose(constraint.T_i_j));
  if (constraint.note.size() > kMaxNote) {
    return absl::InvalidArgumentError(
        absl::StrCat("note has ", constraint.note.size(), " bytes, at most ", kMaxNote));
  }
  return ValidateInformation(constraint.information);
}

}  // namespace strata
