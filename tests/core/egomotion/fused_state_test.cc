#include "core/egomotion/fused_state.h"

#include <Eigen/Core>
#include <gtest/gtest.h>

#include "core/geometry/screw_motion.h"
#include "tests/core/egomotion/drawn_state.h"
#include "tests/support/simulator/simulator.h"

namespace strata {
namespace {

TEST(FusedStateTest, DifferenceIsTheInverseOfRetract) {
  testing::Random random(1);
  for (int i = 0; i < 20; ++i) {
    const FusedState a = testing::DrawState(random), b = testing::DrawState(random);
    const StateVector step = Difference(a, b);
    EXPECT_LT(Difference(Retract(a, step), b).norm(), 1e-12);
  }
}

// By the body's pose of states that are a small error away.
TEST(FusedStateTest, BodyCovarianceIsThatOfRightHandSteps) {
  constexpr double kStep = 1e-6;
  testing::Random random(2);
  const FusedState state = testing::DrawState(random);
  const Eigen::Vector3d arm = testing::DrawVector(random, 2.0);
  StateMatrix root;
  for (double& number : root.reshaped()) number = random.Uniform(-1.0, 1.0);
  const StateMatrix covariance = root * root.transpose();
  const Pose T = BodyPose(state, arm);
  Eigen::Matrix<double, 6, kStateSize> J;
  for (int k = 0; k < kStateSize; ++k) {
    const StateVector step = kStep * StateVector::Unit(k);
    const Pose after = T.inverse() * BodyPose(Retract(state, step), arm);
    const Pose before = T.inverse() * BodyPose(Retract(state, -step), arm);
    J.col(k) = (TwistOf(after) - TwistOf(before)) / (2.0 * kStep);
  }
  const Matrix6d expected = J * covariance * J.transpose();
  EXPECT_LT((BodyCovariance(state, covariance, arm) - expected).norm(), 1e-7 * expected.norm());
}

}  // namespace
}  // namespace strata
