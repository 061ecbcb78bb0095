// What wheels and GPS say of a state: residuals, their derivatives by the state's errors and their
// covariances.
#ifndef STRATA_CORE_EGOMOTION_MEASUREMENTS_H_
#define STRATA_CORE_EGOMOTION_MEASUREMENTS_H_

#include <Eigen/Core>

#include "core/egomotion/fused_state.h"
#include "core/egomotion/inertial_motion.h"
#include "core/egomotion/motion_log.h"
#include "core/egomotion/rig.h"

namespace strata {

// residual = measured − predicted = H · error + noise of `covariance`.
template <int rows>
struct StateMeasurement {
  Eigen::Matrix<double, rows, 1> residual;
  Eigen::Matrix<double, rows, kStateSize> H;
  Eigen::Matrix<double, rows, rows> covariance;
};

// The antenna's place in the map.
StateMeasurement<3> MeasurePosition(const FusedState& state,
                                    const Rig& rig,
                                    const Eigen::Vector3d& p_antenna_map_m,
                                    const Eigen::Vector3d& sigma_m);

// Wheels turn forward: the body's origin neither slips sideways nor climbs off the ground. `mount`
// is R_body_imu, `body` the IMU's reading at that time.
StateMeasurement<3> MeasureSpeed(const FusedState& state,
                                 const Rig& rig,
                                 const Eigen::Quaterniond& mount,
                                 const BodyReading& body,
                                 double speed_m_s);

StateMeasurement<1> MeasureYawRate(const FusedState& state,
                                   const Rig& rig,
                                   const Eigen::Quaterniond& mount,
                                   const BodyReading& body,
                                   double yaw_rate_rad_s);

// A robot that stands: no velocity, no turn. Its gravity then says which way is up through the
// velocity that it would bring.
StateMeasurement<6> MeasureRest(const FusedState& state,
                                const Eigen::Quaterniond& mount,
                                const BodyReading& body);

}  // namespace strata

#endif  // STRATA_CORE_EGOMOTION_MEASUREMENTS_H_
