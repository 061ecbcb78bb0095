// Poses as files for other programs.
#ifndef STRATA_CLIENT_FORMATS_POSE_WRITER_H_
#define STRATA_CLIENT_FORMATS_POSE_WRITER_H_

#include <span>
#include <string>

#include "absl/time/time.h"

#include "core/geometry/pose.h"

namespace strata {

struct TimedPose {
  absl::Time time;
  Pose T_map_scan = Pose::Identity();
};

// TUM format, a line a pose in the order given: "time x y z qx qy qz qw", time with 6 decimals, the
// rest with 12; qw ≥ 0.
std::string TumText(std::span<const TimedPose> poses);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_POSE_WRITER_H_
