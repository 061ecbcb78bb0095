// Where a robot was: poses in the order of time, and between them.
#ifndef STRATA_CORE_EGOMOTION_TRAJECTORY_H_
#define STRATA_CORE_EGOMOTION_TRAJECTORY_H_

#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/geometry/pose.h"

namespace strata {

struct TrajectoryPose {
  double time_s = 0.0;  // since 1970
  Pose T_map_body = Pose::Identity();
  // Of a right-hand step [rotation, translation].
  Matrix6d covariance = Matrix6d::Zero();
};

class Trajectory {
 public:
  // INVALID_ARGUMENT naming the row, from 0, unless times ascend strictly, poses are valid and
  // covariances finite, symmetric and without a negative variance.
  static absl::StatusOr<Trajectory> Make(std::vector<TrajectoryPose> poses);

  const std::vector<TrajectoryPose>& poses() const { return poses_; }

  // Along the screw between the poses before and after; the covariance is theirs, weighed alike.
  // OUT_OF_RANGE before the first and after the last pose, and between two that are farther apart
  // than `max_gap_s`; the message names the times.
  absl::StatusOr<TrajectoryPose> At(double time_s, double max_gap_s = 1.0) const;

 private:
  explicit Trajectory(std::vector<TrajectoryPose> poses) : poses_(std::move(poses)) {}
  std::vector<TrajectoryPose> poses_;
};

}  // namespace strata

#endif  // STRATA_CORE_EGOMOTION_TRAJECTORY_H_
