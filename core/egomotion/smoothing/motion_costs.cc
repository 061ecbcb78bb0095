#include "core/egomotion/smoothing/motion_costs.h"

#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Core>

namespace strata {

InertialCost::InertialCost(const InertialDelta& delta,
                           const Eigen::Quaterniond& mount,
                           const ImuModel& imu)
    : delta_(delta),
      mount_(mount),
      gyro_walk_(imu.gyro_bias_walk * std::sqrt(delta.duration_s)),
      accelerometer_walk_(imu.accelerometer_bias_walk * std::sqrt(delta.duration_s)) {
  using Matrix9 = Eigen::Matrix<double, 9, 9>;
  // W with Wᵀ W = covariance⁻¹: the inverse of the covariance's lower root.
  // A single sample would leave it singular: 1 µm, 1 µrad.
  constexpr double kLeastVariance = 1e-12;
  const Eigen::LLT<Matrix9> root(delta.covariance + kLeastVariance * Matrix9::Identity());
  root_ = root.matrixL().solve(Matrix9::Identity());
}

}  // namespace strata
