// How a state moves by what an IMU feels, and its derivatives.
#ifndef STRATA_CORE_EGOMOTION_INERTIAL_MOTION_H_
#define STRATA_CORE_EGOMOTION_INERTIAL_MOTION_H_

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/egomotion/fused_state.h"
#include "core/egomotion/motion_log.h"
#include "core/egomotion/rig.h"

namespace strata {

inline constexpr double kGravityM_s2 = 9.80665;

// An IMU's reading in the axes of the body, without bias.
struct BodyReading {
  Eigen::Vector3d angular_rate_rad_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d specific_force_m_s2 = Eigen::Vector3d::Zero();
};
BodyReading InBody(const FusedState& state,
                   const Eigen::Quaterniond& R_body_imu,
                   const ImuSample& reading);

// How the body's angular rate changes with the errors of a state: 3 × 17.
Eigen::Matrix<double, 3, kStateSize> AngularRateDerivatives(const FusedState& state,
                                                            const Eigen::Quaterniond& R_body_imu,
                                                            const BodyReading& body);

// One for each of gyroscope, accelerometer and the walks of both biases (3 each), of the wheels'
// scale and the mount's yaw.
inline constexpr int kNoiseSize = 14;

struct InertialStep {
  FusedState state;
  StateMatrix F;                                    // by the errors before
  Eigen::Matrix<double, kStateSize, kNoiseSize> G;  // by noises of `variances`
  Eigen::Matrix<double, kNoiseSize, 1> variances;
};

// `duration_s` > 0 under a reading that stays as it is; the specific force has the direction that
// it has in the middle. The turn of the earth is left out: it is part of the gyroscope's bias.
InertialStep Move(const FusedState& state,
                  const Eigen::Quaterniond& R_body_imu,
                  const ImuModel& imu,
                  const ImuSample& reading,
                  double duration_s);

}  // namespace strata

#endif  // STRATA_CORE_EGOMOTION_INERTIAL_MOTION_H_
