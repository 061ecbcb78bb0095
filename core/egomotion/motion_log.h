// What a robot's log says of its motion: values of the sensors, in their own frames, with times.
// Times are seconds since 1970 (UTC), by one clock; metres and radians.
#ifndef STRATA_CORE_EGOMOTION_MOTION_LOG_H_
#define STRATA_CORE_EGOMOTION_MOTION_LOG_H_

#include <optional>
#include <vector>

#include <Eigen/Core>

namespace strata {

// In the axes of the unit.
struct ImuSample {
  double time_s = 0.0;
  Eigen::Vector3d angular_rate_rad_s = Eigen::Vector3d::Zero();
  // What an accelerometer feels: at rest it points up and is 9.81 long.
  Eigen::Vector3d specific_force_m_s2 = Eigen::Vector3d::Zero();
};

struct WheelSample {
  double time_s = 0.0;
  double speed_m_s = 0.0;  // forward
  std::optional<double> yaw_rate_rad_s;
};

// WGS 84; the place of the antenna.
struct GpsFix {
  double time_s = 0.0;
  double latitude_rad = 0.0;
  double longitude_rad = 0.0;
  double altitude_m = 0.0;
  Eigen::Vector3d sigma_m = Eigen::Vector3d::Ones();  // east, north, up
};

struct MotionLog {
  std::vector<ImuSample> imu;
  std::vector<WheelSample> wheels;  // empty: none
  std::vector<GpsFix> fixes;
};

}  // namespace strata

#endif  // STRATA_CORE_EGOMOTION_MOTION_LOG_H_
