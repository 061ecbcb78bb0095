#include "core/registration/mls_registration.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/LU>

#include "core/common/option_checks.h"
#include "core/geometry/pose.h"
#include "core/mls/features.h"
#include "core/registration/column_grid.h"
#include "core/registration/plane_to_plane.h"
#include "core/registration/sliding.h"
#include "core/registration/umeyama.h"

namespace strata {
namespace {

// Times the tolerances; at 5 to 10 results are the same and times least.
constexpr double kSettledFactor = 10.0;

// One iteration's matches, whatever the metric.
struct Round {
  NormalStep solution;
  Matrix6d information = Matrix6d::Zero();
  int selected = 0;
  int inliers = 0;
  double rms_m = 0.0;
};

// Chooses the metric's way through one iteration.
class RoundSolver {
 public:
  RoundSolver(const ScanFeatures& source,
              const RegistrationTarget& target,
              const MlsRegistrationOptions& options)
      : source_(source), target_(target), options_(options), surfaces_(source, target, options) {}

  // `T_local_source`: into the grids' coordinates.
  Round Solve(const Pose& T_local_source, const Pose& T_guess, double gate_m, bool fine) {
    return options_.metric == MlsErrorMetric::kPlaneToPlane
               ? PlaneToPlane(T_local_source, T_guess, gate_m, fine)
               : PointToPoint(T_local_source, gate_m);
  }

 private:
  Round PlaneToPlane(const Pose& T_local_source, const Pose& T_guess, double gate_m, bool fine);
  Round PointToPoint(const Pose& T_local_source, double gate_m);

  const ScanFeatures& source_;
  const RegistrationTarget& target_;
  const MlsRegistrationOptions& options_;
  PlaneToPlaneMatcher surfaces_;
};

// The step with what is known of the guess, which is at `T_now_guess`, as one more measurement;
// `step` without.
Vector6d StepWithGuess(const NormalEquations& held,
                       const Vector6d& step,
                       const Pose& T_now_guess,
                       const MlsRegistrationOptions& options) {
  if (options.guess_sigma_m <= 0.0 || options.guess_sigma_rad <= 0.0) return step;
  Vector6d information;
  information.head<3>().setConstant(1.0 / std::pow(options.guess_sigma_rad, 2));
  information.tail<3>().setConstant(1.0 / std::pow(options.guess_sigma_m, 2));
  Vector6d back;
  back << So3Log(T_now_guess.linear()), T_now_guess.translation();
  const Matrix6d prior = information.asDiagonal();
  return (held.H + prior).ldlt().solve(held.b + prior * back);
}

Round RoundSolver::PlaneToPlane(const Pose& T_local_source,
                                const Pose& T_guess,
                                double gate_m,
                                bool fine) {
  const PlaneToPlaneSums sums = surfaces_.Linearise(T_local_source, gate_m, fine);
  Round round;
  round.selected = sums.selected;
  round.inliers = sums.inliers;
  if (sums.inliers == 0) return round;
  round.rms_m = std::sqrt(sums.squared_distance_m2 / sums.inliers);
  const double radius_m = std::sqrt(sums.squared_radius_m2 / sums.inliers);
  const double full = sums.weight / (2.0 * options_.normal_sigma_m * options_.normal_sigma_m);
  const double squared_lean = sums.leans > 0 ? sums.squared_lean / sums.leans : 0.0;
  const double least = options_.min_hold > 0.0
                           ? std::max(options_.min_hold, FeignedHold(squared_lean, sums.leans))
                           : 0.0;
  const NormalEquations held =
      WithoutSliding({sums.H, sums.b}, sums.H_across, least * full, radius_m);
  round.solution = SolveNormalEquations(held.H, held.b, radius_m, options_.min_eigenvalue_ratio);
  round.solution.step =
      StepWithGuess(held, round.solution.step, T_local_source.inverse() * T_guess, options_);
  // Residuals larger than the assumed σ take their share from the information.
  const double variance_factor = std::max(1.0, sums.squared_error / sums.inliers);
  round.information = round.solution.information / variance_factor;
  return round;
}

Round RoundSolver::PointToPoint(const Pose& T_local_source, double gate_m) {
  std::vector<Eigen::Vector3d> from;
  std::vector<Eigen::Vector3d> to;
  Round round;
  const Eigen::Matrix3f R = T_local_source.linear().cast<float>();
  const Eigen::Vector3f t = T_local_source.translation().cast<float>();
  const auto match = [&](const Eigen::Vector3f& p, FeatureClass c) {
    ++round.selected;
    const ColumnGrid& grid = target_.grid(c);
    const std::uint32_t j = grid.Nearest(R * p + t, static_cast<float>(gate_m));
    if (j == ColumnGrid::kNone) return;
    from.push_back(p.cast<double>());
    to.push_back(T_local_source.inverse() * grid.points()[j].cast<double>());
  };
  if (options_.max_samples > 0) {
    for (int i = 0; i < options_.max_samples && i < static_cast<int>(source_.sample().size());
         ++i) {
      match(source_.sample()[i].element.point, source_.sample()[i].feature_class);
    }
  } else {
    for (const FeatureClass c :
         {FeatureClass::kTraversable, FeatureClass::kNonTraversable, FeatureClass::kVertical}) {
      for (const Eigen::Vector3f& p : source_.points(c)) match(p, c);
    }
  }
  round.inliers = static_cast<int>(from.size());
  if (from.empty()) return round;
  const UmeyamaResult fit = FitRigidTransform(from, to);
  round.rms_m = fit.rms_m;
  round.solution.step << So3Log(fit.T_y_x.linear()), fit.T_y_x.translation();
  round.solution.degenerate_directions = fit.degenerate_directions;
  round.information = PointInformation(from, std::max(fit.rms_m, options_.normal_sigma_m));
  return round;
}

bool WithinBounds(const Pose& T, const Pose& T_guess, const MlsRegistrationOptions& options) {
  if (!T.matrix().allFinite()) return false;
  const Pose moved = T_guess.inverse() * T;
  return moved.translation().norm() <= options.max_translation_m &&
         RotationAngleRad(moved) <= options.max_rotation_rad;
}

}  // namespace

absl::Status MlsRegistrationOptions::Validate() const {
  OptionChecks checks("registration options");
  checks.InRange("initial_gate_m", initial_gate_m, 1e-3, 100.0);
  checks.InRange("final_gate_m", final_gate_m, 1e-3, initial_gate_m);
  checks.InRange("gate_factor", gate_factor, 0.1, 0.999);
  checks.InRange("max_iterations", max_iterations, 1, 1000);
  checks.InRange("coarse_samples", coarse_samples, 0, 1000000);
  checks.InRange("max_samples", max_samples, 0, 1000000);
  checks.InRange("rotation_tolerance_rad", rotation_tolerance_rad, 0.0, 1.0);
  checks.InRange("translation_tolerance_m", translation_tolerance_m, 0.0, 10.0);
  checks.InRange("normal_sigma_m", normal_sigma_m, 1e-4, 10.0);
  checks.InRange("tangent_sigma_m", tangent_sigma_m, 1e-4, 10.0);
  checks.InRange("robust_width", robust_width, 1e-3, 1e6);
  checks.InRange("min_overlap", min_overlap, 0.0, 1.0);
  checks.InRange("min_inliers", min_inliers, 6, 1000000);
  checks.InRange("max_translation_m", max_translation_m, 0.0, 1e6);
  checks.InRange("max_rotation_rad", max_rotation_rad, 0.0, 3.15);
  checks.InRange("min_eigenvalue_ratio", min_eigenvalue_ratio, 0.0, 1.0);
  checks.InRange("min_hold", min_hold, 0.0, 1.0);
  checks.InRange("guess_sigma_m", guess_sigma_m, 0.0, 1000.0);
  checks.InRange("guess_sigma_rad", guess_sigma_rad, 0.0, 1000.0);
  checks.InRange("neighbours", neighbours, 4, ColumnGrid::kMaxNeighbours);
  checks.InRange("neighbour_radius_m", neighbour_radius_m, 0.01, 100.0);
  return checks.status();
}

RegistrationResult RegisterScan(const ScanFeatures& source,
                                const RegistrationTarget& target,
                                const Pose& T_target_source_guess,
                                const MlsRegistrationOptions& options) {
  RegistrationResult result;
  result.T_target_source = T_target_source_guess;
  if (!T_target_source_guess.matrix().allFinite()) {
    result.termination = Termination::kDiverged;
    return result;
  }
  if (source.size() == 0 || target.size() == 0) return result;

  RoundSolver solver(source, target, options);
  Pose T_guess = T_target_source_guess;
  T_guess.translation() -= target.origin();
  Pose T = T_guess;
  const auto finish = [&](Termination termination, const Pose& T_local) {
    result.termination = termination;
    if (termination == Termination::kTooLittleOverlap || termination == Termination::kDiverged) {
      return;
    }
    result.T_target_source = Normalized(T_local);
    result.T_target_source.translation() += target.origin();
  };

  double gate_m = options.initial_gate_m;
  // Matches far off are not worth many samples: those wait until the first move little.
  bool settled = options.metric == MlsErrorMetric::kPointToPoint;
  for (result.iterations = 1;; ++result.iterations) {
    const bool narrow = gate_m <= options.final_gate_m;
    const bool fine = narrow && settled;
    const Round round = solver.Solve(T, T_guess, gate_m, fine);
    result.inliers = round.inliers;
    result.overlap = round.selected > 0 ? static_cast<double>(round.inliers) / round.selected : 0.0;
    result.rms_m = round.rms_m;
    result.information = round.information;
    result.degenerate_directions = round.solution.degenerate_directions;
    if (round.inliers < options.min_inliers || (fine && result.overlap < options.min_overlap)) {
      finish(Termination::kTooLittleOverlap, T);
      return result;
    }
    T = Retract(T, round.solution.step);
    if (!WithinBounds(T, T_guess, options)) {
      finish(Termination::kDiverged, T);
      return result;
    }
    const auto step_within = [&](double factor) {
      return round.solution.step.head<3>().norm() < factor * options.rotation_tolerance_rad &&
             round.solution.step.tail<3>().norm() < factor * options.translation_tolerance_m;
    };
    const bool still = step_within(1.0);
    settled = settled || (narrow && step_within(kSettledFactor));
    const bool last = result.iterations == options.max_iterations;
    if ((fine && still) || last) {
      const bool degenerate = !result.degenerate_directions.empty();
      finish(degenerate ? Termination::kDegenerate
             : still    ? Termination::kConverged
                        : Termination::kMaxIterations,
             T);
      return result;
    }
    gate_m = std::max(options.final_gate_m, gate_m * options.gate_factor);
  }
}

}  // namespace strata
