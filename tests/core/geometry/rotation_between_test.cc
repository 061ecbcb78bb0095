#include "core/geometry/rotation_between.h"

#include <cmath>
#include <numbers>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <gtest/gtest.h>

namespace strata {
namespace {

TEST(RotationBetweenTest, TurnsByTheAngleBetweenThem) {
  const Eigen::Vector3d from(1.0, -2.0, 0.5), to(-0.3, 0.1, 4.0);
  const Eigen::Quaterniond R = RotationBetween(from, to);
  EXPECT_LT((R * from.normalized() - to.normalized()).norm(), 1e-12);
  const double angle = std::acos(from.normalized().dot(to.normalized()));
  EXPECT_NEAR(R.angularDistance(Eigen::Quaterniond::Identity()), angle, 1e-9);
}

TEST(RotationBetweenTest, OppositeDirectionsAreHalfATurnApart) {
  const Eigen::Quaterniond R = RotationBetween({0.0, 0.0, 2.0}, {0.0, 0.0, -1.0});
  EXPECT_LT((R * Eigen::Vector3d::UnitZ() + Eigen::Vector3d::UnitZ()).norm(), 1e-7);
  EXPECT_NEAR(R.angularDistance(Eigen::Quaterniond::Identity()), std::numbers::pi, 1e-6);
}

}  // namespace
}  // namespace strata
