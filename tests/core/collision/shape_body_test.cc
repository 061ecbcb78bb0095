// Shapes against boxes: separating axes, written out, as an oracle.
#include "core/collision/shape_body.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/geometry/pose.h"

namespace strata {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

// The gap between two convex solids along the best of these axes; < 0: none parts them.
double GapAlong(const std::vector<Vector3d>& a,
                const std::vector<Vector3d>& b,
                const std::vector<Vector3d>& axes) {
  double gap = -1e9;
  for (const Vector3d& axis : axes) {
    if (axis.norm() < 1e-9) continue;
    const Vector3d unit = axis.normalized();
    const auto span = [&unit](const std::vector<Vector3d>& points) {
      std::pair<double, double> ends(1e9, -1e9);
      for (const Vector3d& p : points) {
        ends.first = std::min(ends.first, unit.dot(p));
        ends.second = std::max(ends.second, unit.dot(p));
      }
      return ends;
    };
    const auto [a_low, a_high] = span(a);
    const auto [b_low, b_high] = span(b);
    gap = std::max({gap, a_low - b_high, b_low - a_high});
  }
  return gap;
}

std::vector<Vector3d> CornersOf(const AlignedBox3d& box, const Pose& T = Pose::Identity()) {
  std::vector<Vector3d> corners;
  for (int i = 0; i < 8; ++i) {
    corners.emplace_back(T * box.corner(static_cast<AlignedBox3d::CornerType>(i)));
  }
  return corners;
}

class Dice {
 public:
  explicit Dice(unsigned seed) : random_(seed) {}
  double Within(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  Vector3d Vector(double low, double high) {
    const double x = Within(low, high);
    const double y = Within(low, high);
    const double z = Within(low, high);
    return {x, y, z};
  }
  Pose AnyPose(double reach) {
    const Vector3d axis = Vector(-1.0, 1.0);
    const double angle = Within(-M_PI, M_PI);
    return MakePose(Eigen::Quaterniond(Eigen::AngleAxisd(angle, axis.normalized())),
                    Vector(-reach, reach));
  }
  AlignedBox3d Box() {
    const Vector3d low = Vector(-1.0, 1.0);
    return {low, low + Vector(0.05, 1.0)};
  }

 private:
  std::mt19937 random_;
};

constexpr double kTouching = 1e-6;  // so close either answer is right

TEST(ShapeBodyTest, TrianglesTouchBoxesAsTheSeparatingAxesSay) {
  Dice dice(5);
  int touching = 0;
  for (int i = 0; i < 10'000; ++i) {
    CollisionShape shape;
    std::vector<Vector3d> corners;
    const Pose T = dice.AnyPose(1.0);
    for (int k = 0; k < 3; ++k) {
      shape.vertices.emplace_back(dice.Vector(-1.0, 1.0).cast<float>());
      corners.emplace_back(T * shape.vertices.back().cast<double>());
    }
    shape.triangles = {{0, 1, 2}};
    const AlignedBox3d box = dice.Box();
    std::vector<Vector3d> axes;
    const std::array<Vector3d, 3> edges = {
        corners[1] - corners[0], corners[2] - corners[1], corners[0] - corners[2]};
    axes.push_back(edges[0].cross(edges[1]));
    for (int k = 0; k < 3; ++k) {
      axes.push_back(Vector3d::Unit(k));
      for (const Vector3d& edge : edges) axes.push_back(edge.cross(Vector3d::Unit(k)));
    }
    const double gap = GapAlong(corners, CornersOf(box), axes);
    if (std::abs(gap) < kTouching) continue;
    touching += gap < 0.0;
    const std::optional<ShapeTouch> touch = ShapeBody(shape).Touches(T, box);
    ASSERT_EQ(touch.has_value(), gap < 0.0) << i << ": " << gap;
    if (touch.has_value()) {
      EXPECT_NEAR(touch->depth_m, -gap, 1e-6) << i;
    }
  }
  EXPECT_GT(touching, 500);
  EXPECT_LT(touching, 9000);
}

TEST(ShapeBodyTest, BoxesTouchBoxesAsTheSeparatingAxesSay) {
  Dice dice(6);
  int touching = 0;
  for (int i = 0; i < 10'000; ++i) {
    CollisionShape shape;
    ShapePart part;
    part.size_m = dice.Vector(0.1, 1.0);
    part.T_shape_part = dice.AnyPose(0.3);
    shape.parts.push_back(part);
    const Pose T = dice.AnyPose(1.0);
    const AlignedBox3d box = dice.Box();
    const Pose T_part = T * part.T_shape_part;
    std::vector<Vector3d> axes;
    for (int k = 0; k < 3; ++k) {
      axes.push_back(Vector3d::Unit(k));
      axes.emplace_back(T_part.linear().col(k));
      for (int n = 0; n < 3; ++n) {
        axes.push_back(Vector3d::Unit(k).cross(Vector3d(T_part.linear().col(n))));
      }
    }
    const Vector3d half = part.size_m / 2.0;
    const double gap = GapAlong(CornersOf({-half, half}, T_part), CornersOf(box), axes);
    if (std::abs(gap) < kTouching) continue;
    touching += gap < 0.0;
    const std::optional<ShapeTouch> touch = ShapeBody(shape).Touches(T, box);
    ASSERT_EQ(touch.has_value(), gap < 0.0) << i << ": " << gap;
    // No shorter way leads out, and the shortest is one of the axes' or near it.
    if (!touch.has_value()) continue;
    EXPECT_NEAR(touch->depth_m, -gap, 0.02 - 0.1 * gap) << i;
  }
  EXPECT_GT(touching, 1000);
  EXPECT_LT(touching, 9000);
}

// A box of two triangles a side.
CollisionShape BoxMesh(const Vector3d& low, const Vector3d& high) {
  CollisionShape shape;
  for (int i = 0; i < 8; ++i) {
    const Vector3d corner((i & 1) != 0 ? high.x() : low.x(),
                          (i & 2) != 0 ? high.y() : low.y(),
                          (i & 4) != 0 ? high.z() : low.z());
    shape.vertices.emplace_back(corner.cast<float>());
  }
  shape.triangles = {{0, 2, 1},
                     {1, 2, 3},
                     {4, 5, 6},
                     {5, 7, 6},
                     {0, 1, 4},
                     {1, 5, 4},
                     {2, 6, 3},
                     {3, 6, 7},
                     {0, 4, 2},
                     {2, 4, 6},
                     {1, 3, 5},
                     {3, 7, 5}};
  return shape;
}

TEST(ShapeBodyTest, WhatIsInsideOfAClosedMeshIsTouched) {
  Dice dice(7);
  const Vector3d low(-0.5, -0.3, 0.1);
  const Vector3d high(1.5, 0.3, 1.7);
  const ShapeBody mesh(BoxMesh(low, high));
  CollisionShape solid;
  ShapePart part;
  part.size_m = high - low;
  part.T_shape_part = Pose(Eigen::Translation3d((low + high) / 2.0));
  solid.parts.push_back(part);
  const ShapeBody box(solid);
  EXPECT_TRUE(mesh.bounds().isApprox(box.bounds(), 1e-6));
  int touching = 0, inside = 0;
  for (int i = 0; i < 10'000; ++i) {
    const Pose T = dice.AnyPose(1.0);
    const Vector3d middle = dice.Vector(-1.5, 1.5);
    const Vector3d half = dice.Vector(0.01, 0.2);
    const AlignedBox3d other(middle - half, middle + half);
    const auto expected = box.Touches(T, other);
    const auto found = mesh.Touches(T, other);
    EXPECT_EQ(found.has_value(), expected.has_value()) << i;
    touching += found.has_value();
    const AlignedBox3d deep(low.array() + 0.3, high.array() - 0.25);
    if (!found.has_value() || !deep.contains(T.inverse() * middle)) continue;
    ++inside;
    EXPECT_GT(found->depth_m, 0.05);
  }
  EXPECT_GT(touching, 500);
  EXPECT_GT(inside, 0);
}

// Each of them is over all columns.
TEST(ShapeBodyTest, ManyLargeTrianglesAreHeldAsOne) {
  CollisionShape shape = BoxMesh(Vector3d(-1.0, -1.0, 0.0), Vector3d(1.0, 1.0, 2.0));
  const auto sides = shape.triangles;
  for (int copy = 0; copy < 400; ++copy) {  // odd with the first
    shape.triangles.insert(shape.triangles.end(), sides.begin(), sides.end());
    shape.triangles.insert(shape.triangles.end(), sides.begin(), sides.end());
  }
  const ShapeBody mesh(shape);
  const Vector3d half = Vector3d::Constant(0.1);
  const Vector3d inside(0.3, 0.2, 1.0);
  const Vector3d beside(1.4, 0.2, 1.0);
  EXPECT_TRUE(mesh.Touches(Pose::Identity(), {inside - half, inside + half}).has_value());
  EXPECT_FALSE(mesh.Touches(Pose::Identity(), {beside - half, beside + half}).has_value());
}

TEST(ShapeBodyTest, APlateHasNoInside) {
  CollisionShape shape;
  shape.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 0, 1}, {0, 0, 1}};
  shape.triangles = {{0, 1, 2}, {0, 2, 3}};
  const ShapeBody plate(shape);
  const Vector3d half = Vector3d::Constant(0.1);
  const Vector3d at(0.5, 0.05, 0.5);
  const Vector3d behind(0.5, 0.3, 0.5);
  EXPECT_TRUE(plate.Touches(Pose::Identity(), {at - half, at + half}).has_value());
  EXPECT_FALSE(plate.Touches(Pose::Identity(), {behind - half, behind + half}).has_value());
}

TEST(ShapeBodyTest, CylindersAndSpheresAreRound) {
  CollisionShape shape;
  ShapePart part;
  part.kind = ShapePart::Kind::kCylinder;
  part.size_m = {0.3, 0.0, 1.0};
  part.T_shape_part = Pose(Eigen::Translation3d(0.0, 0.0, 0.5));
  shape.parts = {part};
  const auto post = [](double x, double y) {
    return AlignedBox3d(Vector3d(x, y, 0.2), Vector3d(x + 0.1, y + 0.1, 0.8));
  };
  const ShapeBody cylinder(shape);
  EXPECT_TRUE(cylinder.Touches(Pose::Identity(), post(0.29, -0.05)).has_value());
  EXPECT_FALSE(cylinder.Touches(Pose::Identity(), post(0.31, -0.05)).has_value());
  EXPECT_TRUE(cylinder.Touches(Pose::Identity(), post(0.21, 0.21)).has_value());
  EXPECT_FALSE(cylinder.Touches(Pose::Identity(), post(0.22, 0.22)).has_value());
  shape.parts[0].kind = ShapePart::Kind::kSphere;
  const ShapeBody sphere(shape);
  const AlignedBox3d low(Vector3d(-1.0, -1.0, -0.5), Vector3d(1.0, 1.0, 0.19));
  EXPECT_FALSE(sphere.Touches(Pose::Identity(), low).has_value());
  EXPECT_TRUE(sphere.Touches(Pose(Eigen::Translation3d(0.0, 0.0, -0.02)), low).has_value());
}

}  // namespace
}  // namespace strata
