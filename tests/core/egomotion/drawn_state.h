// States far from all that is special.
#ifndef STRATA_TESTS_CORE_EGOMOTION_DRAWN_STATE_H_
#define STRATA_TESTS_CORE_EGOMOTION_DRAWN_STATE_H_

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/egomotion/fused_state.h"
#include "tests/support/simulator/simulator.h"

namespace strata::testing {

inline Eigen::Vector3d DrawVector(Random& random, double size) {
  Eigen::Vector3d v;
  for (double& number : v) number = random.Uniform(-size, size);
  return v;
}

inline FusedState DrawState(Random& random) {
  FusedState state;
  state.time_s = 100.0;
  state.R_map_body = Eigen::Quaterniond(So3Exp(DrawVector(random, 1.5)));
  state.p_imu_m = DrawVector(random, 20.0);
  state.v_imu_m_s = DrawVector(random, 5.0);
  state.gyro_bias_rad_s = DrawVector(random, 0.05);
  state.accelerometer_bias_m_s2 = DrawVector(random, 0.3);
  state.wheel_scale = random.Uniform(-0.1, 0.1);
  state.yaw_mount_rad = random.Uniform(-0.3, 0.3);
  return state;
}

}  // namespace strata::testing

#endif  // STRATA_TESTS_CORE_EGOMOTION_DRAWN_STATE_H_
