#include "core/completion/upright_box.h"

#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

namespace strata {
namespace {

// A side of a box of 4 × 2 × 1.5 m, a point every 5 cm, turned by `yaw_rad` about (100, -50).
void AddSide(double yaw_rad, bool along, std::vector<Eigen::Vector3d>& points) {
  const Eigen::Vector2d u(std::cos(yaw_rad), std::sin(yaw_rad));
  const Eigen::Vector2d v(-u.y(), u.x());
  const double length = along ? 4.0 : 2.0;
  for (double s = 0.0; s <= length + 1e-9; s += 0.05) {
    for (double z = 0.0; z <= 1.5 + 1e-9; z += 0.05) {
      const Eigen::Vector2d p =
          along ? (s - 2.0) * u - 1.0 * v : Eigen::Vector2d(-2.0 * u + (s - 1.0) * v);
      points.emplace_back(100.0 + p.x(), -50.0 + p.y(), 3.0 + z);
    }
  }
}

void ExpectYaw(double yaw_rad, double expected_rad, double tolerance_rad) {
  EXPECT_GE(yaw_rad, 0.0);
  EXPECT_LT(yaw_rad, std::numbers::pi);
  EXPECT_NEAR(std::sin(2.0 * yaw_rad), std::sin(2.0 * expected_rad), 2.0 * tolerance_rad);
  EXPECT_NEAR(std::cos(2.0 * yaw_rad), std::cos(2.0 * expected_rad), 2.0 * tolerance_rad);
}

// Two sides of a car say where it stands: principal components would go from corner to corner.
TEST(UprightBoxTest, TwoSidesOfABoxAreTheBox) {
  for (const double yaw_rad : {0.0, 0.3, 1.2, 1.6, 2.9}) {
    std::vector<Eigen::Vector3d> points;
    AddSide(yaw_rad, true, points);
    AddSide(yaw_rad, false, points);
    const UprightBox box = UprightBoxOf(points);
    EXPECT_LT((box.centre - Eigen::Vector3d(100.0, -50.0, 3.75)).norm(), 1e-6);
    EXPECT_LT((box.size - Eigen::Vector3d(4.0, 2.0, 1.5)).norm(), 1e-6);
    ExpectYaw(box.yaw_rad, yaw_rad, 1e-6);
    const Eigen::AlignedBox3d bounds = BoundsOf(box);
    for (const Eigen::Vector3d& p : points) EXPECT_LT(bounds.exteriorDistance(p), 1e-6);
  }
}

TEST(UprightBoxTest, ASideIsAlongIt) {
  std::vector<Eigen::Vector3d> points;
  AddSide(0.7, true, points);
  const UprightBox box = UprightBoxOf(points);
  ExpectYaw(box.yaw_rad, 0.7, 1e-6);
  EXPECT_NEAR(box.size.y(), 0.0, 1e-9);
  EXPECT_NEAR(box.size.x(), 4.0, 1e-6);
}

TEST(UprightBoxTest, OnePointAndNone) {
  EXPECT_EQ(UprightBoxOf({}), UprightBox());
  const std::vector<Eigen::Vector3d> one = {{1.0, 2.0, 3.0}, {1.0, 2.0, 3.0}};
  const UprightBox box = UprightBoxOf(one);
  EXPECT_EQ(box.centre, one[0]);
  EXPECT_EQ(box.size, Eigen::Vector3d::Zero());
}

}  // namespace
}  // namespace strata
