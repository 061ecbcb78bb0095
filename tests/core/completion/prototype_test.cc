// Prototypes of things that were seen in parts, and what they add: boxes that rays are cast at, one
// ray after the other against each of their sides.
#include "core/completion/prototype.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/cloud/point_cloud.h"
#include "core/common/stop.h"
#include "core/completion/shape_view.h"
#include "core/geometry/pose.h"
#include "core/occupancy/voxel_walk.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;
using ::testing::_;
using ::testing::HasSubstr;
using testing::StatusIs;

constexpr double kVoxelM = 0.05;
const AlignedBox3d kAround(Vector3d(-2.6, -1.4, 0.1), Vector3d(2.6, 1.4, 2.0));

AlignedBox3d Box(Vector3d low, Vector3d high) { return {low, high}; }

// A car: a body and, not in its middle, a cabin.
std::vector<AlignedBox3d> Car() {
  return {Box({-2.1, -0.9, 0.3}, {2.1, 0.9, 1.1}), Box({-1.4, -0.8, 1.1}, {0.7, 0.8, 1.6})};
}

// Distance along the ray at which it enters the box.
std::optional<double> Enters(const AlignedBox3d& box, const Vector3d& from, const Vector3d& ray) {
  double begin = 0.0;
  double end = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 3; ++i) {
    const double a = (box.min()[i] - from[i]) / ray[i];
    const double b = (box.max()[i] - from[i]) / ray[i];
    begin = std::max(begin, std::min(a, b));
    end = std::min(end, std::max(a, b));
  }
  return begin < end ? std::optional(begin) : std::nullopt;
}

double DistanceTo(const std::vector<AlignedBox3d>& boxes, const Vector3d& p) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const AlignedBox3d& box : boxes) {
    const double outside = box.exteriorDistance(p);
    const double inside = std::min((p - box.min()).minCoeff(), (box.max() - p).minCoeff());
    nearest = std::min(nearest, outside > 0.0 ? outside : inside);
  }
  return nearest;
}

// A car among other things on level ground, scanned at every half degree.
struct Scene {
  std::vector<AlignedBox3d> thing = Car();
  std::vector<AlignedBox3d> others;
  std::mt19937 random{1};

  void Scan(const Vector3d& from, ShapeView& view) {
    std::normal_distribution<double> noise(0.0, 0.004);
    PointCloud cloud;
    std::vector<Vector3d> points;
    const double heading = std::atan2(-from.y(), -from.x());
    for (double azimuth = heading - 0.9; azimuth < heading + 0.9; azimuth += 0.005) {
      for (double rise = -0.5; rise < 0.35; rise += 0.007) {
        const Vector3d ray(
            std::cos(azimuth) * std::cos(rise), std::sin(azimuth) * std::cos(rise), std::sin(rise));
        double range = 30.0;  // a wall behind it all
        bool of_thing = false;
        if (ray.z() < 0.0) range = std::min(range, -from.z() / ray.z());
        for (const AlignedBox3d& box : others)
          range = std::min(range, Enters(box, from, ray).value_or(range));
        for (const AlignedBox3d& box : thing) {
          const double enters = Enters(box, from, ray).value_or(range);
          of_thing = of_thing || enters < range;
          range = std::min(range, enters);
        }
        range += noise(random);
        cloud.points.push_back((range * ray).cast<float>());
        if (of_thing) points.push_back(from + range * ray);
      }
    }
    view.AddPoints(points);
    STRATA_ASSERT_OK(view.AddScan(cloud, Pose(Eigen::Translation3d(from)), {}, Stop()));
  }
};

ShapeView SeenFrom(const std::vector<Vector3d>& places,
                   Scene scene,
                   const AlignedBox3d& around = kAround) {
  ShapeView view = *ShapeView::Over(around, kVoxelM);
  for (const Vector3d& from : places) scene.Scan(from, view);
  return view;
}

const Vector3d kLeft(-1.0, 7.0, 1.8);
const Vector3d kRight(1.0, -7.0, 1.8);
const Vector3d kFront(7.0, 1.5, 1.8);
const Vector3d kBehind(-7.0, -1.0, 1.8);

// The share of the car's sides (not its bottom) within 7 cm of `points`.
double Covered(const std::vector<Vector3d>& points, const AlignedBox3d& where) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> place(0.0, 1.0);
  int covered = 0;
  int all = 0;
  while (all < 400) {
    Vector3d p(0.0, 0.0, 0.0);
    for (int i = 0; i < 3; ++i) p[i] = where.min()[i] + place(random) * where.sizes()[i];
    if (DistanceTo(Car(), p) > 0.01) continue;
    ++all;
    covered += std::any_of(
        points.begin(), points.end(), [&](const Vector3d& q) { return (p - q).norm() < 0.07; });
  }
  return covered / static_cast<double>(all);
}

std::vector<Vector3d> Means(const Prototype& prototype) {
  std::vector<Vector3d> means;
  for (const PrototypeVoxel& voxel : prototype.voxels) means.push_back(voxel.mean);
  return means;
}

TEST(PrototypeTest, WhatOneHidesTheOthersShow) {
  Scene clear;
  std::vector<ShapeView> views;
  views.push_back(SeenFrom({kLeft}, clear));
  views.push_back(SeenFrom({kRight, kFront}, clear));
  views.push_back(SeenFrom({kBehind, kRight}, clear));
  const auto prototype = BuildPrototype(views, Stop());
  STRATA_ASSERT_OK(prototype.status());
  const Inference hidden = InferHidden(*prototype, views[0]);
  EXPECT_TRUE(hidden.IsOfKind());
  EXPECT_GT(hidden.agreeing, 1000u);
  EXPECT_GT(Covered(hidden.points, Box({-2.0, -0.91, 0.4}, {2.0, -0.89, 1.0})), 0.95);
  for (const Vector3d& p : hidden.points) {
    EXPECT_LT(DistanceTo(Car(), p), 0.05) << p.transpose();
    EXPECT_NE(views[0].At(VoxelOf(p / kVoxelM)), ShapeSight::kEmpty);
  }
}

TEST(PrototypeTest, WhatOnlyOneOfManyHasIsNotOfTheKind) {
  Scene with_box;
  with_box.thing.push_back(Box({-0.6, -0.4, 1.6}, {0.2, 0.4, 1.9}));  // on its roof
  std::vector<ShapeView> views;
  views.push_back(SeenFrom({kLeft, kRight}, with_box));
  for (int i = 0; i < 3; ++i) views.push_back(SeenFrom({kLeft, kRight}, Scene()));
  const auto prototype = BuildPrototype(views, Stop());
  STRATA_ASSERT_OK(prototype.status());
  for (const PrototypeVoxel& voxel : prototype->voxels) EXPECT_LT(voxel.mean.z(), 1.7);
  // With only one that looked there, it counts.
  const auto alone = BuildPrototype(std::span(views).first(1), Stop());
  STRATA_ASSERT_OK(alone.status());
  EXPECT_TRUE(std::any_of(alone->voxels.begin(), alone->voxels.end(), [](const auto& voxel) {
    return voxel.mean.z() > 1.8;
  }));
}

TEST(PrototypeTest, WhatIsSymmetricIsCompletedByItsImage) {
  std::vector<ShapeView> views;
  views.push_back(SeenFrom({kLeft, kFront, Vector3d(-6.5, 2.5, 1.8)}, Scene()));
  views.push_back(SeenFrom({kLeft, kFront, Vector3d(-6.5, 2.5, 1.8)},
                           Scene{.thing = Car(), .others = {}, .random = std::mt19937(2)}));
  const auto prototype = BuildPrototype(views, Stop());
  STRATA_ASSERT_OK(prototype.status());
  ASSERT_TRUE(prototype->mirror.has_value());
  const MirrorPlane& mirror = *prototype->mirror;
  EXPECT_NEAR(std::abs(std::sin(mirror.heading_rad)), 1.0, 0.001);
  EXPECT_NEAR(mirror.offset_m, 0.0, 0.03);
  EXPECT_GT(Covered(Means(*prototype), Box({-2.0, -0.91, 0.4}, {2.0, -0.89, 1.0})), 0.9);
  for (const PrototypeVoxel& voxel : prototype->voxels) {
    EXPECT_LT(DistanceTo(Car(), voxel.mean), 0.06) << voxel.mean.transpose();
  }
}

// Nor is all of a symmetric thing: what stands out on one side is not put on the other.
TEST(PrototypeTest, AnImageIsNotPutWhereRaysWent) {
  Scene with_locker;
  with_locker.thing.push_back(Box({-0.3, 0.9, 0.5}, {0.3, 1.2, 0.9}));
  std::vector<ShapeView> views;
  views.push_back(SeenFrom({kLeft, kFront, kRight}, with_locker));
  const auto prototype = BuildPrototype(views, Stop());
  STRATA_ASSERT_OK(prototype.status());
  ASSERT_TRUE(prototype->mirror.has_value());
  EXPECT_NEAR(std::abs(std::sin(prototype->mirror->heading_rad)), 1.0, 0.001);
  for (const PrototypeVoxel& voxel : prototype->voxels) {
    EXPECT_GT(voxel.mean.y(), -1.0) << voxel.mean.transpose();
  }
}

// One whose other side was seen to be different is none.
TEST(PrototypeTest, WhatRaysContradictIsNotSymmetric) {
  Scene lorry;
  lorry.thing = {Box({-2.1, 0.0, 0.3}, {2.1, 0.9, 1.8}), Box({-2.1, -0.9, 0.3}, {2.1, 0.0, 0.8})};
  std::vector<ShapeView> views;
  views.push_back(SeenFrom({kLeft, kFront, kBehind, kRight}, lorry));
  const auto prototype = BuildPrototype(views, Stop());
  STRATA_ASSERT_OK(prototype.status());
  if (prototype->mirror.has_value()) {  // front and back are alike
    EXPECT_LT(std::abs(std::sin(prototype->mirror->heading_rad)), 0.1);
  }
}

TEST(PrototypeTest, AnotherKindIsNotCompleted) {
  std::vector<ShapeView> views;
  for (const Vector3d& from : {kLeft, kRight}) views.push_back(SeenFrom({from, kFront}, Scene()));
  const auto prototype = BuildPrototype(views, Stop());
  STRATA_ASSERT_OK(prototype.status());
  Scene low;
  low.thing = {Box({-2.1, -0.9, 0.3}, {2.1, 0.9, 0.6})};
  const Inference hidden = InferHidden(*prototype, SeenFrom({kLeft}, low));
  EXPECT_FALSE(hidden.IsOfKind());
  EXPECT_GT(hidden.contradicting, 0u);
  EXPECT_TRUE(hidden.points.empty());
}

TEST(PrototypeTest, WhatStandsInFrontHidesAndDoesNotContradict) {
  Scene behind_a_wall;
  behind_a_wall.others = {Box({0.3, 1.2, 0.0}, {2.6, 1.3, 2.2})};
  std::vector<ShapeView> views;
  for (const Vector3d& from : {kLeft, kFront}) views.push_back(SeenFrom({from, kRight}, Scene()));
  views.push_back(SeenFrom({kLeft}, behind_a_wall));
  const auto prototype = BuildPrototype(views, Stop());
  STRATA_ASSERT_OK(prototype.status());
  const Inference hidden = InferHidden(*prototype, views.back());
  EXPECT_TRUE(hidden.IsOfKind());
  EXPECT_LT(hidden.contradicting, hidden.agreeing / 20);
  EXPECT_GT(Covered(hidden.points, Box({1.0, 0.89, 0.4}, {2.0, 0.91, 1.0})), 0.9);
}

// A corner may be one of many things.
TEST(PrototypeTest, WhatTooLittleWasSeenOfIsNotCompleted) {
  Scene nearly_hidden;
  nearly_hidden.others = {Box({-1.6, 1.2, 0.0}, {2.6, 1.3, 2.2})};
  std::vector<ShapeView> views;
  for (const Vector3d& from : {kLeft, kFront}) views.push_back(SeenFrom({from, kRight}, Scene()));
  views.push_back(SeenFrom({kLeft}, nearly_hidden));
  const auto prototype = BuildPrototype(views, Stop());
  STRATA_ASSERT_OK(prototype.status());
  const Inference hidden = InferHidden(*prototype, views.back());
  EXPECT_TRUE(hidden.IsOfKind());
  EXPECT_GT(hidden.agreeing, 0u);
  EXPECT_FALSE(hidden.IsSeenEnough());
  EXPECT_TRUE(hidden.points.empty());
}

// One ray, through the row of voxels beside; what lies 5 mm from that row may be in its beam.
TEST(PrototypeTest, NothingIsPutIntoTheBeamThatGoesByNextToIt) {
  ShapeView view = *ShapeView::Over(kAround, kVoxelM);
  const Vector3d thing(0.025, 0.325, 1.025), near(1.025, 0.495, 1.025), off(1.325, 0.475, 1.025);
  view.AddPoints({{thing}});
  PointCloud cloud;
  cloud.points.emplace_back(10.0F, 0.0F, 0.0F);
  const Pose T(Eigen::Translation3d(-5.0, 0.525, 1.025));
  STRATA_ASSERT_OK(view.AddScan(cloud, T, {}, Stop()));
  Prototype prototype;
  prototype.voxel_m = kVoxelM;
  for (const Vector3d& p : {thing, near, off}) {
    prototype.voxels.push_back({VoxelOf(p / kVoxelM), p, 2, 2});
  }
  const Inference inference = InferHidden(prototype, view);
  EXPECT_EQ(inference.agreeing, 1U);
  EXPECT_EQ(inference.contradicting, 0U);
  ASSERT_EQ(inference.points.size(), 1U);
  EXPECT_EQ(inference.points[0], off);
}

TEST(ShapeViewTest, RefusesBoxesItCannotHold) {
  const auto over = [](const AlignedBox3d& box, double voxel_m) {
    return ShapeView::Over(box, voxel_m).status();
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(over(kAround, 0.0),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("voxel_m")));
  EXPECT_THAT(over(kAround, nan), StatusIs(absl::StatusCode::kInvalidArgument, _));
  EXPECT_THAT(over(AlignedBox3d(), 0.05), StatusIs(absl::StatusCode::kInvalidArgument, _));
  EXPECT_THAT(over(Box({nan, 0, 0}, {1, 1, 1}), 0.05),
              StatusIs(absl::StatusCode::kInvalidArgument, _));
  EXPECT_THAT(over(Box({0, 0, 0}, {1e30, 1, 1}), 0.05),
              StatusIs(absl::StatusCode::kInvalidArgument, _));
  EXPECT_THAT(over(Box({0, 0, 0}, {50, 50, 50}), 0.05),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("voxels of 0.05 m")));
  EXPECT_THAT(BuildPrototype({}, Stop()).status(), StatusIs(absl::StatusCode::kInvalidArgument, _));
}

}  // namespace
}  // namespace strata
