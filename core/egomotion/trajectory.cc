#include "core/egomotion/trajectory.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

#include "core/common/status.h"
#include "core/geometry/screw_motion.h"

namespace strata {
namespace {

constexpr double kMaxSkewShare = 1e-6;

absl::Status ValidateCovariance(const Matrix6d& covariance) {
  if (!covariance.allFinite()) return absl::InvalidArgumentError("covariance: not finite");
  const double skew = (covariance - covariance.transpose()).cwiseAbs().maxCoeff();
  if (skew > kMaxSkewShare * covariance.cwiseAbs().maxCoeff()) {
    return absl::InvalidArgumentError("covariance: not symmetric");
  }
  if (covariance.diagonal().minCoeff() < 0.0) {
    return absl::InvalidArgumentError("covariance: a variance is negative");
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<Trajectory> Trajectory::Make(std::vector<TrajectoryPose> poses) {
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const std::string where = absl::StrCat("pose ", i);
    if (!std::isfinite(poses[i].time_s) || (i > 0 && poses[i].time_s <= poses[i - 1].time_s)) {
      return absl::InvalidArgumentError(absl::StrCat(where, ": times must ascend"));
    }
    STRATA_RETURN_IF_ERROR(Annotate(ValidatePose(poses[i].T_map_body), where));
    STRATA_RETURN_IF_ERROR(Annotate(ValidateCovariance(poses[i].covariance), where));
  }
  return Trajectory(std::move(poses));
}

absl::StatusOr<TrajectoryPose> Trajectory::At(double time_s, double max_gap_s) const {
  if (poses_.empty()) return absl::OutOfRangeError("the trajectory has no poses");
  const auto after = std::lower_bound(
      poses_.begin(), poses_.end(), time_s, [](const TrajectoryPose& pose, double time) {
        return pose.time_s < time;
      });
  if (after != poses_.end() && after->time_s == time_s) return *after;
  if (after == poses_.begin() || after == poses_.end()) {
    return absl::OutOfRangeError(
        absl::StrFormat("time %.6f is outside the trajectory, %.6f to %.6f",
                        time_s,
                        poses_.front().time_s,
                        poses_.back().time_s));
  }
  const auto before = after - 1;
  const double gap_s = after->time_s - before->time_s;
  if (gap_s > max_gap_s) {
    return absl::OutOfRangeError(
        absl::StrFormat("time %.6f is in a gap of the trajectory of %.3f s, more than %.3f s",
                        time_s,
                        gap_s,
                        max_gap_s));
  }
  const double share = (time_s - before->time_s) / gap_s;
  TrajectoryPose pose;
  pose.time_s = time_s;
  pose.T_map_body = Interpolate(before->T_map_body, after->T_map_body, share);
  pose.covariance = (1.0 - share) * before->covariance + share * after->covariance;
  return pose;
}

}  // namespace strata
