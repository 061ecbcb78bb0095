#include "core/geometry/pose.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::testing::HasSubstr;
using testing::StatusIs;

Eigen::Matrix3d Hat(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

// The exponential series of a skew matrix, summed until nothing changes.
Eigen::Matrix3d Series(const Eigen::Vector3d& v) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d term = Eigen::Matrix3d::Identity();
  for (int k = 1; k < 60; ++k) {
    term = term * Hat(v) / k;
    sum += term;
  }
  return sum;
}

TEST(PoseTest, ExpIsTheMatrixExponentialAndLogItsInverse) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (const double length : {0.0, 1e-14, 1e-9, 1e-5, 0.1, 1.0, 2.0, 3.0, 3.1415, 3.14159265}) {
    for (int i = 0; i < 20; ++i) {
      Eigen::Vector3d v(uniform(random), uniform(random), uniform(random));
      v = length * v.normalized();
      const Eigen::Matrix3d R = So3Exp(v);
      EXPECT_LT((R - Series(v)).norm(), 1e-12) << length;
      EXPECT_LT((So3Log(R) - v).norm(), 1e-7) << length;
    }
  }
}

TEST(PoseTest, LogOfHalfATurnHasLengthPi) {
  for (const Eigen::Vector3d& axis : {Eigen::Vector3d(1, 0, 0),
                                      Eigen::Vector3d(0, 1, 0),
                                      Eigen::Vector3d(0, 0, 1),
                                      Eigen::Vector3d(1, 2, -2).normalized()}) {
    const Eigen::Vector3d v = So3Log(So3Exp(std::numbers::pi * axis));
    EXPECT_NEAR(v.norm(), std::numbers::pi, 1e-7);
    EXPECT_NEAR(std::abs(v.normalized().dot(axis)), 1.0, 1e-9);
  }
}

TEST(PoseTest, NamesOfFramesCancel) {
  const Pose T_map_robot = MakePose(
      Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitZ())),
      {10, 0, 0});
  // One metre ahead of a robot that looks along y.
  EXPECT_LT((T_map_robot * Eigen::Vector3d(1, 0, 0) - Eigen::Vector3d(10, 1, 0)).norm(), 1e-14);
  EXPECT_NEAR(RotationAngleRad(T_map_robot), std::numbers::pi / 2, 1e-12);
}

TEST(PoseTest, RetractStepsInTheBodyFrameRotationFirst) {
  const Pose T = MakePose(
      Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized())), {4, 5, 6});
  const double h = 1e-6;
  const Eigen::Vector3d p(0.3, -0.2, 0.9);
  for (int k = 0; k < 6; ++k) {
    Vector6d step = Vector6d::Zero();
    step(k) = h;
    const Eigen::Vector3d numeric = (Retract(T, step) * p - Retract(T, -step) * p) / (2 * h);
    const Eigen::Vector3d unit = Eigen::Vector3d::Unit(k % 3);
    const Eigen::Vector3d expected =
        T.linear() * (k < 3 ? Eigen::Vector3d(unit.cross(p)) : Eigen::Vector3d(unit));
    EXPECT_LT((numeric - expected).norm(), 1e-8) << k;
  }
}

TEST(PoseTest, NormalizedMendsALongChain) {
  const Pose step =
      MakePose(Eigen::Quaterniond(Eigen::AngleAxisd(0.01, Eigen::Vector3d::UnitY())), {0.1, 0, 0});
  Pose T = Pose::Identity();
  for (int i = 0; i < 100000; ++i) T = T * step;
  T.linear() *= 1.0 + 1e-7;
  const Pose mended = Normalized(T);
  EXPECT_LT((mended.linear() * mended.linear().transpose() - Eigen::Matrix3d::Identity()).norm(),
            1e-14);
  EXPECT_EQ(mended.translation(), T.translation());
}

TEST(PoseTest, ValidateNamesWhatIsWrong) {
  STRATA_EXPECT_OK(ValidatePose(Pose::Identity()));
  Pose T = Pose::Identity();
  T.translation().x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(ValidatePose(T), StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("finite")));
  T.translation() = Eigen::Vector3d(300.0, 0.0, 400.0);
  EXPECT_THAT(ValidatePose(T, 499.0),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("500 m is beyond 499 m")));
  STRATA_EXPECT_OK(ValidatePose(T, 500.0));
  T.linear() *= 1.001;
  EXPECT_THAT(ValidatePose(T), StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("rotation")));
  Pose mirror = Pose::Identity();
  mirror.linear()(2, 2) = -1.0;
  EXPECT_THAT(ValidatePose(mirror),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("rotation")));
}

}  // namespace
}  // namespace strata
