#include "core/egomotion/smoothing/motion_costs.h"

#include <array>
#include <memory>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "core/egomotion/fused_state.h"
#include "core/egomotion/inertial_motion.h"
#include "core/egomotion/rig.h"
#include "core/egomotion/smoothing/preintegration.h"
#include "tests/core/egomotion/drawn_state.h"
#include "tests/support/simulator/simulator.h"

namespace strata {
namespace {

// A drawn motion, exactly: whatever a cost says of it is 0.
class MotionCostsTest : public ::testing::Test {
 protected:
  MotionCostsTest() {
    for (int i = 0; i < 20; ++i) {
      ImuSample reading;
      reading.angular_rate_rad_s = testing::DrawVector(random_, 1.0);
      reading.specific_force_m_s2 = testing::DrawVector(random_, 12.0);
      last_ = Move(last_, mount_, ImuModel(), reading, 0.025).state;
      Append(delta_, ImuModel(), reading.angular_rate_rad_s, reading.specific_force_m_s2, 0.025);
    }
  }
  static std::array<double, kPoseBlock> PoseOf(const FusedState& s) {
    return {s.R_map_body.x(),
            s.R_map_body.y(),
            s.R_map_body.z(),
            s.R_map_body.w(),
            s.p_imu_m.x(),
            s.p_imu_m.y(),
            s.p_imu_m.z()};
  }
  static std::array<double, kMotionBlock> MotionOf(const FusedState& s) {
    std::array<double, kMotionBlock> block{};
    Eigen::Map<Eigen::Matrix<double, kMotionBlock, 1>>(block.data()) << s.v_imu_m_s,
        s.gyro_bias_rad_s, s.accelerometer_bias_m_s2;
    return block;
  }
  static Eigen::VectorXd Residuals(ceres::CostFunction* owned,
                                   const std::vector<const double*>& blocks) {
    const std::unique_ptr<ceres::CostFunction> cost(owned);
    Eigen::VectorXd residuals(cost->num_residuals());
    EXPECT_TRUE(cost->Evaluate(blocks.data(), residuals.data(), nullptr));
    return residuals;
  }

  testing::Random random_{81};
  const FusedState first_ = testing::DrawState(random_);
  const Eigen::Quaterniond mount_{So3Exp(testing::DrawVector(random_, 1.0))};
  FusedState last_ = first_;
  InertialDelta delta_ = [this] {
    InertialDelta delta;  // at biases a little off
    delta.gyro_bias = first_.gyro_bias_rad_s + Eigen::Vector3d(1e-5, -1e-5, 2e-5);
    delta.accelerometer_bias = first_.accelerometer_bias_m_s2 + Eigen::Vector3d(1e-4, 2e-4, 0.0);
    return delta;
  }();
  const std::array<double, kSharedBlock> shared_ = {first_.wheel_scale, first_.yaw_mount_rad};
};

TEST_F(MotionCostsTest, TheImuAgreesWithItsOwnMotion) {
  const auto pose_i = PoseOf(first_), pose_j = PoseOf(last_);
  const auto motion_i = MotionOf(first_), motion_j = MotionOf(last_);
  const Eigen::VectorXd residuals =
      Residuals(InertialCost::Make(delta_, mount_, ImuModel()),
                {pose_i.data(), motion_i.data(), pose_j.data(), motion_j.data(), shared_.data()});
  EXPECT_LT(residuals.norm(), 1e-3);  // in σ; the biases are corrected to first order
}

TEST_F(MotionCostsTest, WheelsAgreeWithTheWayOfTheBody) {
  const Eigen::Vector3d arm(0.3, -0.2, 0.7);
  const Pose T = BodyPose(first_, arm).inverse() * BodyPose(last_, arm);
  WheelDelta wheels;
  wheels.way_m = (1.0 + first_.wheel_scale) * T.translation();
  wheels.sigma.setConstant(0.01);
  const auto pose_i = PoseOf(first_), pose_j = PoseOf(last_);
  const Eigen::VectorXd residuals =
      Residuals(WheelCost::Make(wheels, arm), {pose_i.data(), pose_j.data(), shared_.data()});
  EXPECT_LT(residuals.norm(), 1e-9);
}

TEST_F(MotionCostsTest, AFixIsWhereTheImuBringsTheAntenna) {
  const Eigen::Vector3d arm(0.5, 0.1, 1.2);
  const Eigen::Vector3d antenna = last_.p_imu_m + last_.R_map_body * arm;
  const auto pose = PoseOf(first_);
  const auto motion = MotionOf(first_);
  const FixDelta fix = {delta_, mount_, arm, antenna, Eigen::Vector3d::Constant(0.01)};
  for (ceres::CostFunction* const cost : {PlaceCost::Make(fix), AltitudeCost::Make(fix)}) {
    EXPECT_LT(Residuals(cost, {pose.data(), motion.data(), shared_.data()}).norm(), 1e-3);
  }
}

}  // namespace
}  // namespace strata
