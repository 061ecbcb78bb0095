#include "core/egomotion/smoothing/preintegration.h"

#include <cmath>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "core/egomotion/fused_state.h"
#include "core/egomotion/inertial_motion.h"
#include "core/geometry/pose.h"
#include "tests/core/egomotion/drawn_state.h"
#include "tests/support/simulator/simulator.h"

namespace strata {
namespace {

constexpr int kSteps = 20;
constexpr double kDt = 0.025;

// The same readings for all.
InertialDelta Integrate(const Eigen::Vector3d& gyro_bias, const Eigen::Vector3d& force_bias) {
  testing::Random random(71);
  InertialDelta delta;
  delta.gyro_bias = gyro_bias;
  delta.accelerometer_bias = force_bias;
  for (int i = 0; i < kSteps; ++i) {
    const Eigen::Vector3d rate = testing::DrawVector(random, 1.0);
    const Eigen::Vector3d force = testing::DrawVector(random, 12.0);
    Append(delta, ImuModel(), rate, force, kDt);
  }
  return delta;
}

TEST(PreintegrationTest, IsTheMotionOfTheFilter) {
  testing::Random drawn(72);
  FusedState state = testing::DrawState(drawn);
  state.yaw_mount_rad = 0.0;
  const FusedState first = state;
  const InertialDelta delta = Integrate(state.gyro_bias_rad_s, state.accelerometer_bias_m_s2);
  testing::Random random(71);
  for (int i = 0; i < kSteps; ++i) {
    ImuSample reading;
    reading.angular_rate_rad_s = testing::DrawVector(random, 1.0);
    reading.specific_force_m_s2 = testing::DrawVector(random, 12.0);
    state = Move(state, Eigen::Quaterniond::Identity(), ImuModel(), reading, kDt).state;
  }
  const double dt = delta.duration_s;
  EXPECT_NEAR(dt, kSteps * kDt, 1e-12);
  const Eigen::Vector3d g = -kGravityM_s2 * Eigen::Vector3d::UnitZ();
  const Eigen::Quaterniond& R = first.R_map_body;
  EXPECT_LT((R * delta.rotation).angularDistance(state.R_map_body), 1e-10);
  EXPECT_LT((first.v_imu_m_s + dt * g + R * delta.velocity - state.v_imu_m_s).norm(), 1e-10);
  EXPECT_LT((first.p_imu_m + dt * first.v_imu_m_s + 0.5 * dt * dt * g + R * delta.position -
             state.p_imu_m)
                .norm(),
            1e-10);
}

TEST(PreintegrationTest, DerivativesByTheBiases) {
  constexpr double kStep = 1e-6;
  const Eigen::Vector3d gyro(0.02, -0.03, 0.01), force(0.1, 0.2, -0.1);
  const InertialDelta here = Integrate(gyro, force);
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d step = kStep * Eigen::Vector3d::Unit(k);
    const InertialDelta more = Integrate(gyro + step, force), less = Integrate(gyro - step, force);
    const Eigen::Vector3d turned =
        So3Log((less.rotation.conjugate() * more.rotation).toRotationMatrix());
    EXPECT_LT((turned / (2.0 * kStep) - here.rotation_by_gyro.col(k)).norm(), 1e-6);
    EXPECT_LT(
        ((more.velocity - less.velocity) / (2.0 * kStep) - here.velocity_by_gyro.col(k)).norm(),
        1e-6);
    EXPECT_LT(
        ((more.position - less.position) / (2.0 * kStep) - here.position_by_gyro.col(k)).norm(),
        1e-6);
    const InertialDelta up = Integrate(gyro, force + step), down = Integrate(gyro, force - step);
    EXPECT_LT(
        ((up.velocity - down.velocity) / (2.0 * kStep) - here.velocity_by_accelerometer.col(k))
            .norm(),
        1e-6);
    EXPECT_LT(
        ((up.position - down.position) / (2.0 * kStep) - here.position_by_accelerometer.col(k))
            .norm(),
        1e-6);
  }
}

// Of 4,000 drawn noises.
TEST(PreintegrationTest, CovarianceIsThatOfNoise) {
  constexpr int kDraws = 4000;
  const ImuModel imu;
  testing::Random noise(73);
  const InertialDelta exact = Integrate(Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
  Eigen::Matrix<double, 9, 9> sum = Eigen::Matrix<double, 9, 9>::Zero();
  for (int draw = 0; draw < kDraws; ++draw) {
    testing::Random random(71);
    InertialDelta delta;
    for (int i = 0; i < kSteps; ++i) {
      Eigen::Vector3d rate = testing::DrawVector(random, 1.0);
      Eigen::Vector3d force = testing::DrawVector(random, 12.0);
      for (double& number : rate) number += imu.gyro_noise / std::sqrt(kDt) * noise.Gaussian();
      for (double& number : force) {
        number += imu.accelerometer_noise / std::sqrt(kDt) * noise.Gaussian();
      }
      Append(delta, imu, rate, force, kDt);
    }
    Eigen::Matrix<double, 9, 1> error;
    error << So3Log((exact.rotation.conjugate() * delta.rotation).toRotationMatrix()),
        delta.velocity - exact.velocity, delta.position - exact.position;
    sum += error * error.transpose() / kDraws;
  }
  for (int i = 0; i < 9; ++i) {
    EXPECT_NEAR(std::sqrt(sum(i, i) / exact.covariance(i, i)), 1.0, 0.05) << i;
  }
}

}  // namespace
}  // namespace strata
