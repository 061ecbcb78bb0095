#include "core/registration/facing.h"

#include <cmath>
#include <cstddef>
#include <numbers>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace strata {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;
constexpr double kSectorRad = kTurn / kFacingSectors;

double AngleOf(Facing facing) { return (facing - 0.5) * kSectorRad; }

double Apart(double a, double b) { return std::abs(std::remainder(a - b, kTurn)); }

// A wall through `foot` along `along_rad`, as cells of 0.1 m hold it.
std::vector<Eigen::Vector3f> WallPoints(const Eigen::Vector2d& foot, double along_rad, double m) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> along(0.0, m);
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 400 * m; ++i) {
    const double a = along(random);
    const Eigen::Vector2d p = foot + a * Eigen::Vector2d(std::cos(along_rad), std::sin(along_rad));
    points.emplace_back(static_cast<float>((std::floor(p.x() / 0.1) + 0.5) * 0.1),
                        static_cast<float>((std::floor(p.y() / 0.1) + 0.5) * 0.1),
                        static_cast<float>(0.25 * (i % 8)));
  }
  return points;
}

TEST(FacingTest, WhatIsNoMoreThanARightAngleApartIsCompatible) {
  for (Facing a = 1; a <= kFacingSectors; ++a) {
    const FacingSet set = CompatibleWith(a);
    for (Facing b = 1; b <= kFacingSectors; ++b) {
      EXPECT_EQ((set >> b & 1U) != 0, Apart(AngleOf(a), AngleOf(b)) < 0.25 * kTurn + 1e-9)
          << int{a} << " and " << int{b};
      EXPECT_EQ(OfOneSide(a, b), (set >> b & 1U) != 0);
    }
    EXPECT_EQ(set >> kFacingUnknown & 1U, 0U);
    EXPECT_FALSE(OfOneSide(a, kFacingUnknown));
  }
  EXPECT_EQ(CompatibleWith(kFacingUnknown), 0U);
  EXPECT_TRUE(OfOneSide(kFacingUnknown, kFacingUnknown));
}

TEST(FacingTest, TurnsTurnThemToTheNearestSector) {
  for (const double yaw : {0.0, 0.3, -0.3, 3.1, -3.1, 9.0}) {
    const FacingTurn turn(yaw);
    EXPECT_EQ(turn(kFacingUnknown), kFacingUnknown);
    for (Facing f = 1; f <= kFacingSectors; ++f) {
      EXPECT_LE(Apart(AngleOf(turn(f)), AngleOf(f) + yaw), 0.5 * kSectorRad + 1e-9);
    }
  }
}

TEST(FacingTest, AWallFacesItsSensorWhateverItsDirection) {
  for (int i = 0; i < 36; ++i) {
    const double along = kTurn * i / 36;
    const Eigen::Vector2d foot(40.0, -30.0);
    const std::vector<Eigen::Vector3f> wall = WallPoints(foot, along, 6.0);
    const Eigen::Vector2d normal(-std::sin(along), std::cos(along));
    const Eigen::Vector2d middle = foot + 3.0 * Eigen::Vector2d(std::cos(along), std::sin(along));
    std::size_t right[2] = {0, 0};
    std::size_t wrong[2] = {0, 0};
    for (const int side : {0, 1}) {
      const Eigen::Vector2d sensor = middle + (side == 0 ? 2.0 : -2.0) * normal;
      const std::vector<Facing> facings =
          FacingsOf(wall, {static_cast<float>(sensor.x()), static_cast<float>(sensor.y()), 1.0F});
      const double truth = along + (side == 0 ? 0.25 : -0.25) * kTurn;
      for (const Facing f : facings) {
        if (f == kFacingUnknown) continue;
        const double off = Apart(AngleOf(f), truth);
        right[side] += off < 0.5 ? 1 : 0;
        wrong[side] += off > 0.25 * kTurn ? 1 : 0;
      }
      EXPECT_EQ(wrong[side], 0U) << i;
      EXPECT_GT(right[side], wall.size() * 3 / 5) << i;
    }
  }
}

TEST(FacingTest, WhatIsSeenAlongItselfHasNoSide) {
  const std::vector<Eigen::Vector3f> wall = WallPoints({10.0, 0.05}, 0.0, 5.0);
  for (const Facing f : FacingsOf(wall, {0.0F, 0.05F, 1.0F})) EXPECT_EQ(f, kFacingUnknown);
}

// A column is no surface: what can be seen of it is within a right angle of the way to the sensor.
TEST(FacingTest, WhatSpansNoSurfaceFacesTheSensor) {
  std::vector<Eigen::Vector3f> column;
  for (int i = 0; i < 8; ++i) column.emplace_back(5.05F, 5.05F, 0.1F * static_cast<float>(i));
  for (const Facing f : FacingsOf(column, {0.0F, 0.0F, 1.0F})) {
    EXPECT_LT(Apart(AngleOf(f), -0.375 * kTurn), kSectorRad);
  }
  EXPECT_TRUE(FacingsOf({}, {0.0F, 0.0F, 1.0F}).empty());
}

}  // namespace
}  // namespace strata
