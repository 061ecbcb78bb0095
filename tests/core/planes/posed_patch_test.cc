#include "core/planes/posed_patch.h"

#include <cmath>
#include <cstddef>
#include <cstdint>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "core/common/random.h"
#include "core/geometry/pose.h"

namespace strata {
namespace {

constexpr std::uint64_t kSeed = 20261126;

Eigen::Vector3d DrawVector(SplitMix64& random, double reach) {
  Eigen::Vector3d v;
  for (int k = 0; k < 3; ++k) v[k] = reach * (2.0 * random.Uniform() - 1.0);
  return v;
}

// A rectangle with holes, level in its scan.
PlanePatch Draw(SplitMix64& random) {
  PlanePatch patch;
  patch.centroid = DrawVector(random, 10.0);
  patch.plane.normal = Eigen::Vector3d::UnitZ();
  patch.plane.distance = patch.centroid.z();
  patch.axis_u = Eigen::Vector3d::UnitX();
  patch.extent_min = Eigen::Vector2d(-2.0, -1.0);
  patch.extent_max = Eigen::Vector2d(2.0, 1.0);
  patch.footprint_cell_m = 0.25;
  patch.footprint.resize(16);
  for (std::uint32_t& row : patch.footprint) row = static_cast<std::uint32_t>(random.Next()) & 0xFF;
  patch.area_m2 = 8.0;
  patch.rms_m = 0.01;
  Eigen::Matrix4d moments = Eigen::Matrix4d::Zero();
  for (int k = 0; k < 50; ++k) {
    const double x = 4.0 * random.Uniform() - 2.0;
    const double y = 2.0 * random.Uniform() - 1.0;
    const Eigen::Vector4d p =
        (patch.centroid + Eigen::Vector3d(x, y, 0.02 * random.Uniform())).homogeneous();
    moments += p * p.transpose();
  }
  patch.moments = moments;
  return patch;
}

Pose DrawTilt(SplitMix64& random, double most_rad) {
  const double angle = most_rad * random.Uniform();
  const Eigen::Vector3d axis = DrawVector(random, 1.0).normalized();
  return Pose(Eigen::AngleAxisd(angle, axis));
}

Pose MovedBy(Pose T, const Eigen::Vector3d& by) {
  T.pretranslate(by);
  return T;
}

// A patch where the surface z = ½ (x² k_x + y² k_y) is at (x, y), as seen from the surface's pose.
PosedPatch OnBowl(double k_x, double k_y, const Eigen::Vector2d& at, const Pose& T_map_bowl) {
  SplitMix64 random(kSeed);
  static PlanePatch patch;
  patch = Draw(random);
  patch.centroid = {at.x(), at.y(), 0.5 * (k_x * at.x() * at.x() + k_y * at.y() * at.y())};
  patch.curvature = {k_x, 0.0, k_y};
  return InMap(patch, 0, T_map_bowl, {});
}

TEST(PosedPatchTest, BentAwayIsHowFarTheSurfaceLeavesThePlane) {
  SplitMix64 random(kSeed);
  for (int i = 0; i < 20; ++i) {
    const Pose T_map_bowl = MovedBy(DrawTilt(random, 3.0), DrawVector(random, 50.0));
    const double k_x = 0.02 * (random.Uniform() - 0.5);
    const double k_y = 0.02 * (random.Uniform() - 0.5);
    const Eigen::Vector2d at = DrawVector(random, 8.0).head<2>();
    const PosedPatch patch = OnBowl(k_x, k_y, at, T_map_bowl);
    const double offset = std::abs(0.5 * (k_x * at.x() * at.x() + k_y * at.y() * at.y()));
    const double tilt = std::hypot(k_x * at.x(), k_y * at.y());
    EXPECT_NEAR(
        BentAway(patch, T_map_bowl.translation()), std::hypot(offset, tilt * patch.spread_m), 1e-9);
  }
  EXPECT_EQ(BentAway(OnBowl(0.0, 0.0, {5.0, 5.0}, Pose::Identity()), Eigen::Vector3d::Zero()), 0.0);
}

TEST(PosedPatchTest, WhatFitsIsNotRefusedByBounds) {
  SplitMix64 random(kSeed);
  std::size_t fits = 0;
  std::size_t refused = 0;
  for (int k = 0; k < 20000; ++k) {
    SharedPlaneOptions options;
    options.pose_sigma_m = 0.01 + 0.3 * random.Uniform();
    options.pose_sigma_rad = 0.002 + 0.1 * random.Uniform();
    const PlanePatch a = Draw(random);
    PlanePatch b = Draw(random);
    b.centroid = a.centroid + DrawVector(random, 1.0);
    const PosedPatch patch = InMap(a, 0, DrawTilt(random, 0.3), options);
    const PosedPatch other = InMap(b, 1, Pose::Identity(), options);
    const JointPlane joint{.plane = other.plane,
                           .mean = other.centroid,
                           .scans = 1.0 + std::floor(5.0 * random.Uniform())};
    const bool may_fit = MayFit(BriefOf(patch, options), joint, options);
    if (Fits(patch, joint, options)) {
      ++fits;
      EXPECT_TRUE(may_fit) << "draw " << k;
    }
    refused += may_fit ? 0 : 1;
  }
  EXPECT_GT(fits, 1000U);
  EXPECT_GT(refused, 1000U);
}

// Of squares, one by one.
double ShareOf(const PosedPatch& a, const PosedPatch& b) {
  int squares = 0;
  int on = 0;
  for (int i = 0; i < 16; ++i) {
    for (int j = 0; j < 8; ++j) {
      if ((a.patch->footprint[static_cast<std::size_t>(i)] >> j & 1U) == 0) continue;
      ++squares;
      const Eigen::Vector3d p =
          a.centroid + Eigen::Vector3d(-2.0 + 0.25 * (i + 0.5), -1.0 + 0.25 * (j + 0.5), 0.0);
      const int x = static_cast<int>(std::floor((p.x() - b.centroid.x() + 2.0) / 0.25));
      const int y = static_cast<int>(std::floor((p.y() - b.centroid.y() + 1.0) / 0.25));
      if (x < 0 || x >= 16 || y < 0 || y >= 8) continue;
      on += static_cast<int>(b.patch->footprint[static_cast<std::size_t>(x)] >> y & 1U);
    }
  }
  return static_cast<double>(on) / squares;
}

TEST(PosedPatchTest, OverlapIsTheShareOfSquares) {
  SplitMix64 random(kSeed);
  std::size_t enough = 0;
  for (int k = 0; k < 2000; ++k) {
    const PlanePatch a = Draw(random);
    PlanePatch b = Draw(random);
    b.centroid = a.centroid + DrawVector(random, 1.0);
    const PosedPatch patch = InMap(a, 0, Pose::Identity(), {});
    const PosedPatch other = InMap(b, 1, Pose::Identity(), {});
    const double share =
        patch.squares <= other.squares ? ShareOf(patch, other) : ShareOf(other, patch);
    for (const double asked : {0.0, 0.2, 0.3, 1.0}) {
      EXPECT_EQ(Overlap(patch, other, asked), share >= asked) << "draw " << k << ", " << asked;
    }
    enough += share >= 0.3 ? 1 : 0;
  }
  EXPECT_GT(enough, 200U);
  EXPECT_LT(enough, 1800U);
}

}  // namespace
}  // namespace strata
