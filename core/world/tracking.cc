#include "core/world/tracking.h"

#include <Eigen/Cholesky>

#include "core/common/status.h"

namespace strata {

absl::Status ValidateTrackStart(const TrackStart& start) {
  LocalizeQuery query;
  query.sensor = start.sensor;
  query.T_map_scan_guess = start.T_map_scan_guess;
  query.guess_radius_m = start.guess_radius_m;
  return ValidateLocalizeGuess(query);
}

absl::Status ValidateTrackMotion(const TrackStep& step) {
  STRATA_RETURN_IF_ERROR(Annotate(ValidatePose(step.T_odom_scan), "odometry"));
  if (!(step.cloud.sensor_origin.cwiseAbs().maxCoeff<Eigen::PropagateNaN>() <= 1e6F)) {
    return absl::InvalidArgumentError("sensor_origin is not within ±1e6 m");
  }
  if (!step.motion_covariance.has_value()) return absl::OkStatus();
  const Matrix6d& covariance = *step.motion_covariance;
  // 1e-12 is a micrometre; what is less, or beyond 1e12, no arithmetic keeps apart.
  if (!(covariance.cwiseAbs().maxCoeff<Eigen::PropagateNaN>() <= 1e12) ||
      !covariance.isApprox(covariance.transpose(), 1e-6) ||
      (covariance - 1e-12 * Matrix6d::Identity()).llt().info() != Eigen::Success) {
    return absl::InvalidArgumentError(
        "motion covariance is not symmetric with eigenvalues in [1e-12, 1e12]");
  }
  return absl::OkStatus();
}

absl::Status ValidateTrackStep(const TrackStep& step) {
  STRATA_RETURN_IF_ERROR(ValidateTrackMotion(step));
  if (!step.cloud.origin.isZero(0.0)) {
    return absl::InvalidArgumentError("the cloud has an origin; fold it into odometry and answer");
  }
  return ValidateCloud(step.cloud);
}

absl::string_view ToString(TrackState state) {
  switch (state) {
    case TrackState::kTracked:
      return "tracked";
    case TrackState::kPredicted:
      return "predicted";
    case TrackState::kLost:
      return "lost";
  }
  return "unknown";
}

}  // namespace strata
