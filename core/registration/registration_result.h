// What every registration of this folder answers, and how the step of one iteration is solved.
#ifndef STRATA_CORE_REGISTRATION_REGISTRATION_RESULT_H_
#define STRATA_CORE_REGISTRATION_REGISTRATION_RESULT_H_

#include <vector>

#include "absl/strings/string_view.h"

#include "core/geometry/pose.h"

namespace strata {

// Why a registration stopped. Only kConverged is a match; the others say what the pose is worth.
enum class Termination {
  kConverged,         // the last step was below the tolerances
  kMaxIterations,     // still moving: the pose is the best so far
  kTooLittleOverlap,  // not enough of the source found a partner; the pose is the guess
  kDegenerate,  // a direction is not determined by the matches; the pose was not moved along it
  kDiverged,  // left the allowed distance from the guess, or became infinite; the pose is the guess
};

// "converged", "max iterations", "too little overlap", "degenerate", "diverged".
absl::string_view ToString(Termination termination);

// Outcome of a registration; too little overlap is an outcome, not an error.
struct RegistrationResult {
  Pose T_target_source = Pose::Identity();
  Termination termination = Termination::kTooLittleOverlap;
  int iterations = 0;
  double rms_m = 0.0;    // of the error metric over the inliers of the last iteration
  int inliers = 0;       // matches of the last iteration that were not rejected
  double overlap = 0.0;  // inliers / selected source points, in [0, 1]
  // Information of a right-hand step on T_target_source, tangent order [rotation, translation];
  // 1/rad², 1/m². None along degenerate_directions.
  Matrix6d information = Matrix6d::Zero();
  // Unit tangent vectors that the matches leave undetermined: eigenvectors of the information (its
  // rotation scaled to metres) with an eigenvalue below a share of the largest one.
  std::vector<Vector6d> degenerate_directions;

  bool converged() const { return termination == Termination::kConverged; }
};

// A Gauss–Newton step H·step = b that stays zero along undetermined directions.
struct NormalStep {
  Vector6d step = Vector6d::Zero();
  std::vector<Vector6d> degenerate_directions;
  Matrix6d information = Matrix6d::Zero();  // H without what it says of undetermined directions
};

// Solves H·step = b. `radius_m` > 0 is the typical distance of the points from the frame's origin:
// rotations are weighed as the arc they cause there, so that the eigenvalues compare. Directions
// whose eigenvalue is below `min_eigenvalue_ratio` of the largest are degenerate and get no step.
NormalStep SolveNormalEquations(const Matrix6d& H,
                                const Vector6d& b,
                                double radius_m,
                                double min_eigenvalue_ratio);

}  // namespace strata

#endif  // STRATA_CORE_REGISTRATION_REGISTRATION_RESULT_H_
