#include "core/geometry/screw_motion.h"

#include <random>

#include <Eigen/Core>
#include <gtest/gtest.h>

#include "core/geometry/skew.h"

namespace strata {
namespace {

// The exponential series of a twist as a 4 × 4 matrix.
Eigen::Matrix4d Series(const Vector6d& twist) {
  Eigen::Matrix4d generator = Eigen::Matrix4d::Zero();
  generator.topLeftCorner<3, 3>() = Skew(twist.head<3>());
  generator.topRightCorner<3, 1>() = twist.tail<3>();
  Eigen::Matrix4d sum = Eigen::Matrix4d::Identity();
  Eigen::Matrix4d term = Eigen::Matrix4d::Identity();
  for (int k = 1; k < 60; ++k) {
    term = term * generator / k;
    sum += term;
  }
  return sum;
}

Pose Exp(const Vector6d& twist) {
  const ScrewStep step = ScrewMotion(twist.head<3>(), twist.tail<3>());
  return MakePose(step.turn, step.way_m);
}

class ScrewMotionTest : public ::testing::Test {
 protected:
  Vector6d Twist(double angle) {
    Vector6d twist;
    for (double& number : twist.reshaped()) number = uniform_(random_);
    twist.head<3>() *= angle / twist.head<3>().norm();
    return twist;
  }
  std::mt19937 random_{1};
  std::uniform_real_distribution<double> uniform_{-1.0, 1.0};
};

TEST_F(ScrewMotionTest, IsTheMatrixExponentialAndTheTwistItsInverse) {
  for (const double angle : {1e-9, 9e-5, 1.1e-4, 0.1, 1.0, 2.0, 3.0}) {
    for (int i = 0; i < 20; ++i) {
      const Vector6d twist = Twist(angle);
      EXPECT_LT((Exp(twist).matrix() - Series(twist)).norm(), 1e-12) << angle;
      EXPECT_LT((TwistOf(Exp(twist)) - twist).norm(), 1e-9) << angle;
    }
  }
}

TEST_F(ScrewMotionTest, InterpolatesAlongOneScrew) {
  const Pose a = Exp(Twist(1.0));
  const Vector6d way = Twist(2.0);
  const Pose b = a * Exp(way);
  EXPECT_TRUE(Interpolate(a, b, 0.0).isApprox(a, 1e-12));
  EXPECT_TRUE(Interpolate(a, b, 1.0).isApprox(b, 1e-12));
  EXPECT_TRUE(Interpolate(a, b, 0.3).isApprox(a * Exp(0.3 * way), 1e-12));
}

TEST_F(ScrewMotionTest, RightJacobianIsTheDerivativeOfTheExponential) {
  constexpr double kStep = 1e-6;
  for (const double angle : {1e-9, 0.01, 1.0, 2.5}) {
    const Eigen::Vector3d v = Twist(angle).head<3>();
    const Eigen::Matrix3d J = So3RightJacobian(v);
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d step = kStep * Eigen::Vector3d::Unit(k);
      const Eigen::Vector3d turned =
          So3Log(So3Exp(v - step).transpose() * So3Exp(v + step)) / (2.0 * kStep);
      EXPECT_LT((turned - J.col(k)).norm(), 1e-8) << angle;
    }
  }
}

}  // namespace
}  // namespace strata
