#include "core/geometry/euler.h"

#include <cmath>
#include <numbers>
#include <random>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "core/geometry/pose.h"

namespace strata {
namespace {

constexpr double kPi = std::numbers::pi;

// Eq. 2.17 written out, as an oracle for the quaternions.
Eigen::Matrix3d Elementary(const EulerAngles& e) {
  Eigen::Matrix3d x;
  Eigen::Matrix3d y;
  Eigen::Matrix3d z;
  const auto c = [](double a) { return std::cos(a); };
  const auto s = [](double a) { return std::sin(a); };
  x << 1, 0, 0, 0, c(e.roll_rad), -s(e.roll_rad), 0, s(e.roll_rad), c(e.roll_rad);
  y << c(e.pitch_rad), 0, s(e.pitch_rad), 0, 1, 0, -s(e.pitch_rad), 0, c(e.pitch_rad);
  z << c(e.yaw_rad), -s(e.yaw_rad), 0, s(e.yaw_rad), c(e.yaw_rad), 0, 0, 0, 1;
  return z * y * x;
}

TEST(EulerTest, MatrixAndQuaternionAreThoseOfTheThesis) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> angle(-7.0, 7.0);
  for (int i = 0; i < 200; ++i) {
    const EulerAngles e = {angle(random), angle(random), angle(random)};
    EXPECT_LT((MatrixOf(e) - Elementary(e)).norm(), 1e-14);
    EXPECT_LT((QuaternionOf(e).toRotationMatrix() - Elementary(e)).norm(), 1e-14);
  }
}

TEST(EulerTest, AnglesComeBack) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> angle(-3.14, 3.14);
  std::uniform_real_distribution<double> pitch(-1.57, 1.57);
  for (int i = 0; i < 500; ++i) {
    const EulerAngles e = {angle(random), pitch(random), angle(random)};
    const EulerAngles back = EulerOf(Elementary(e));
    EXPECT_NEAR(back.roll_rad, e.roll_rad, 1e-9) << i;
    EXPECT_NEAR(back.pitch_rad, e.pitch_rad, 1e-9) << i;
    EXPECT_NEAR(back.yaw_rad, e.yaw_rad, 1e-9) << i;
  }
}

TEST(EulerTest, MatrixComesBackAtAndNearTheGimbalLock) {
  for (const double off : {0.0, 1e-15, 1e-12, 1e-10, 1e-9, 2e-9, 1e-8, 1e-6, 1e-3}) {
    for (const double sign : {-1.0, 1.0}) {
      for (const double roll : {-2.0, 0.0, 0.7, 3.0}) {
        const Eigen::Matrix3d R = Elementary({roll, sign * (kPi / 2 - off), 1.1});
        const EulerAngles back = EulerOf(R);
        EXPECT_LT((Elementary(back) - R).norm(), 3e-9) << off << " " << sign << " " << roll;
      }
    }
  }
  EXPECT_EQ(EulerOf(Elementary({0.4, kPi / 2, 0.3})).roll_rad, 0.0);
}

TEST(EulerTest, AngleAxisAgreesWithTheOtherThree) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-1.8, 1.8);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d v(uniform(random), uniform(random), uniform(random));
    if (v.norm() >= kPi) continue;
    const Eigen::Matrix3d R = So3Exp(v);
    EXPECT_LT((So3Log(MatrixOf(EulerOf(R))) - v).norm(), 1e-9);
    const Eigen::Quaterniond q = QuaternionOf(EulerOf(R));
    EXPECT_NEAR(q.angularDistance(Eigen::Quaterniond(R)), 0.0, 1e-7);
  }
}

}  // namespace
}  // namespace strata
