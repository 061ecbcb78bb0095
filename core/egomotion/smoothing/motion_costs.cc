#include "core/egomotion/smoothing/motion_costs.h"

#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <ceres/autodiff_cost_function.h>

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

ceres::CostFunction* InertialCost::Make(const InertialDelta& delta,
                                        const Eigen::Quaterniond& mount,
                                        const ImuModel& imu) {
  return new ceres::AutoDiffCostFunction<InertialCost,
                                         15,
                                         kPoseBlock,
                                         kMotionBlock,
                                         kPoseBlock,
                                         kMotionBlock,
                                         kSharedBlock>(new InertialCost(delta, mount, imu));
}

ceres::CostFunction* WheelCost::Make(const WheelDelta& delta, const Eigen::Vector3d& imu_body_m) {
  return new ceres::AutoDiffCostFunction<WheelCost, 4, kPoseBlock, kPoseBlock, kSharedBlock>(
      new WheelCost(delta, imu_body_m));
}

template <int first, int rows>
ceres::CostFunction* FixCost<first, rows>::Make(const FixDelta& fix) {
  return new ceres::AutoDiffCostFunction<FixCost, rows, kPoseBlock, kMotionBlock, kSharedBlock>(
      new FixCost(fix));
}

template class FixCost<0, 2>;
template class FixCost<2, 1>;

ceres::CostFunction* BiasPrior::Make(const Eigen::Matrix<double, 6, 1>& biases,
                                     const Eigen::Matrix<double, 6, 1>& sigma) {
  return new ceres::AutoDiffCostFunction<BiasPrior, 6, kMotionBlock>(new BiasPrior(biases, sigma));
}

ceres::CostFunction* SharedPrior::Make(const Eigen::Vector2d& sigma) {
  return new ceres::AutoDiffCostFunction<SharedPrior, 2, kSharedBlock>(new SharedPrior(sigma));
}

}  // namespace strata
