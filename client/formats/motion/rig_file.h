// A robot's rig in YAML.
#ifndef STRATA_CLIENT_FORMATS_MOTION_RIG_FILE_H_
#define STRATA_CLIENT_FORMATS_MOTION_RIG_FILE_H_

#include <filesystem>

#include "absl/status/status.h"

#include "core/egomotion/rig.h"

namespace strata {

// Sets what the file says and leaves the rest of `rig` as it is. The body has x forward, y left, z
// up. All keys may be missing:
//
//   imu:
//     orientation: [roll, pitch, yaw]  # of its axes in the body, degrees: R = Rz Ry Rx
//     position: [x, y, z]              # in the body, m
//     yaw_mount: 5                     # σ of its yaw, degrees
//     gyro_noise, accelerometer_noise, gyro_bias, accelerometer_bias, gyro_bias_walk,
//     accelerometer_bias_walk: as ImuModel
//   gps:
//     antenna: [x, y, z]               # in the body, m
//     least_sigma: 0.3                 # m
//     lag: 0                           # s
//   wheels:
//     speed, side_slip, climb, yaw_rate, yaw_rate_share, scale, lag: as WheelModel
//
// NOT_FOUND; INVALID_ARGUMENT naming file, key and what was expected, for keys that nobody knows
// too, and as ValidateRig().
absl::Status ReadRig(const std::filesystem::path& path, Rig& rig);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_MOTION_RIG_FILE_H_
