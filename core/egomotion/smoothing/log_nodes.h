// A log cut into nodes and what lies between them. Internal to core/egomotion, not installed.
#ifndef STRATA_CORE_EGOMOTION_SMOOTHING_LOG_NODES_H_
#define STRATA_CORE_EGOMOTION_SMOOTHING_LOG_NODES_H_

#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/egomotion/motion_log.h"
#include "core/egomotion/rig.h"
#include "core/egomotion/smoothing/motion_costs.h"
#include "core/egomotion/smoothing/preintegration.h"

namespace strata {

// Samples of the IMU that are at least `spacing_s` apart, the first and the last among them.
std::vector<std::size_t> NodesOf(const std::vector<ImuSample>& imu, double spacing_s);

// From sample `begin` of the IMU to `until_s`, with the biases of `start`.
InertialDelta DeltaBetween(const std::vector<ImuSample>& imu,
                           const ImuModel& model,
                           std::size_t begin,
                           double until_s,
                           const InertialDelta& start);

// What the wheels say between two samples of the IMU, whose gyroscope turns them; nullopt where
// they are silent for longer than half a second. `wheels` are without lag.
std::optional<WheelDelta> WheelsBetween(const std::vector<ImuSample>& imu,
                                        const std::vector<WheelSample>& wheels,
                                        const WheelModel& model,
                                        const Eigen::Quaterniond& R_body_imu,
                                        const Eigen::Vector3d& gyro_bias_rad_s,
                                        std::size_t begin,
                                        std::size_t end);

}  // namespace strata

#endif  // STRATA_CORE_EGOMOTION_SMOOTHING_LOG_NODES_H_
