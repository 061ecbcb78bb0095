#include "tests/support/simulator/scene.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <gtest/gtest.h>

#include "tests/support/simulator/simulator.h"

namespace strata::testing {
namespace {

using Eigen::Vector3d;

Scene Of(Solid solid) {
  Scene scene;
  scene.Add(std::move(solid));
  scene.Build();
  return scene;
}

TEST(SceneTest, BoxIsHitAtItsFaceAndMissedBesideIt) {
  const Scene scene = Of(Box({2, -1, -1}, {3, 1, 1}));
  EXPECT_DOUBLE_EQ(scene.Cast({0, 0, 0}, Vector3d::UnitX(), 10).value(), 2.0);
  EXPECT_DOUBLE_EQ(scene.Cast({5, 0.5, 0}, -Vector3d::UnitX(), 10).value(), 2.0);
  EXPECT_FALSE(scene.Cast({0, 1.5, 0}, Vector3d::UnitX(), 10).has_value());
  EXPECT_FALSE(scene.Cast({0, 0, 0}, -Vector3d::UnitX(), 10).has_value());
  EXPECT_FALSE(scene.Cast({0, 0, 0}, Vector3d::UnitX(), 1.9).has_value());
}

TEST(SceneTest, OrientedBoxIsHitWhereItsTurnedFaceIs) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = Eigen::AngleAxisd(M_PI / 4, Vector3d::UnitZ()).toRotationMatrix();
  T.translation() = Vector3d(5, 0, 0);
  const Scene scene = Of(OrientedBox(T, {2, 2, 2}));
  // The edge points towards the ray: half the diagonal of the square.
  EXPECT_NEAR(scene.Cast({0, 0, 0}, Vector3d::UnitX(), 10).value(), 5.0 - std::sqrt(2.0), 1e-12);
}

TEST(SceneTest, RampRisesLinearlyEitherWay) {
  const Scene up = Of(RampX(0, 10, -1, 1, 0.0, 2.0));
  const Scene down = Of(RampX(10, 0, -1, 1, 0.0, 2.0));
  for (int half = 1; half < 20; ++half) {
    const double x = 0.5 * half;
    EXPECT_NEAR(up.GroundBelow(x, 0, 5).value(), 0.2 * x, 1e-12);
    EXPECT_NEAR(down.GroundBelow(x, 0, 5).value(), 2.0 - 0.2 * x, 1e-12);
  }
  EXPECT_NEAR(up.Cast({0, 0, 1}, Vector3d::UnitX(), 20).value(), 5.0, 1e-12);
  EXPECT_FALSE(up.GroundBelow(-0.1, 0, 5).has_value());
}

TEST(SceneTest, PostTouchesItsCircleInTheMiddleOfEachFace) {
  const Scene scene = Of(Post(4, 0, 0, 3, 0.5));
  EXPECT_NEAR(scene.Cast({0, 0, 1}, Vector3d::UnitX(), 10).value(), 3.5, 1e-12);
  EXPECT_FALSE(scene.Cast({0, 0, 3.01}, Vector3d::UnitX(), 10).has_value());
}

TEST(SceneTest, TerrainOfAPlaneIsThePlane) {
  Scene scene;
  scene.SetTerrain({Eigen::Vector2d(-20, -30), Eigen::Vector2d(20, 30)},
                   0.7,
                   [](double x, double y) { return 1.0 + 0.1 * x - 0.2 * y; });
  scene.Build();
  const Vector3d normal = Vector3d(-0.1, 0.2, 1.0);
  Random random(7);
  for (int i = 0; i < 2000; ++i) {
    const Vector3d origin(random.Uniform(-15, 15), random.Uniform(-25, 25), random.Uniform(8, 12));
    const Vector3d direction =
        Vector3d(random.Uniform(-1, 1), random.Uniform(-1, 1), random.Uniform(-1, 0)).normalized();
    const double expected = (1.0 - normal.dot(origin)) / normal.dot(direction);
    const Vector3d hit = origin + expected * direction;
    if (expected < 0.0 || std::abs(hit.x()) > 19.9 || std::abs(hit.y()) > 29.9) continue;
    const auto range = scene.Cast(origin, direction, 1000.0);
    ASSERT_TRUE(range.has_value()) << "ray " << i << " of seed 7";
    EXPECT_NEAR(*range, expected, 1e-9);
  }
  EXPECT_NEAR(scene.GroundBelow(3.0, 4.0, 100).value(), 0.5, 1e-12);
  EXPECT_FALSE(scene.Cast({0, 0, 5}, Vector3d::UnitZ(), 1000).has_value());
}

// Every solid asked alone is the oracle for the hierarchy over all of them.
TEST(SceneTest, HierarchyFindsWhatTryingEverySolidFinds) {
  Random random(11);
  Scene scene;
  std::vector<Scene> alone;
  for (int i = 0; i < 60; ++i) {
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.linear() = Eigen::AngleAxisd(random.Uniform(0, 3),
                                   Vector3d(random.Gaussian(), random.Gaussian(), 1).normalized())
                     .toRotationMatrix();
    T.translation() = 10.0 * Vector3d(random.Gaussian(), random.Gaussian(), random.Gaussian());
    const Solid solid = OrientedBox(T, {random.Uniform(0.5, 4), random.Uniform(0.5, 4), 1.0});
    scene.Add(solid);
    alone.push_back(Of(solid));
  }
  scene.Build();
  int hits = 0;
  for (int i = 0; i < 3000; ++i) {
    const Vector3d direction =
        Vector3d(random.Gaussian(), random.Gaussian(), random.Gaussian()).normalized();
    double expected = 40.0;
    for (const Scene& one : alone) {
      expected = std::min(expected, one.Cast({0, 0, 0}, direction, 40.0).value_or(40.0));
    }
    EXPECT_DOUBLE_EQ(scene.Cast({0, 0, 0}, direction, 40.0).value_or(40.0), expected);
    hits += expected < 40.0 ? 1 : 0;
  }
  EXPECT_GT(hits, 200);
}

TEST(SceneTest, HullOfEllipsoidsIsTheirs) {
  // A ball, and a limb between two balls along z.
  const Eigen::Matrix3d ball = 0.5 * Eigen::Matrix3d::Identity();
  Solid limb = Hull({{{3, 0, 0}, ball}, {{3, 0, 2}, ball}}, 400);
  limb.label = 7;
  Scene scene;
  scene.Add(limb);
  scene.Add(Hull({{{0, 4, 0}, ball}}, 400));
  scene.Build();
  const auto side = scene.Trace({0, 0, 1}, Vector3d::UnitX(), 10.0);
  ASSERT_TRUE(side.has_value());
  EXPECT_NEAR(side->range, 2.5, 0.02);
  EXPECT_EQ(side->label, 7);
  EXPECT_NEAR(scene.Cast({3, 0, 5}, -Vector3d::UnitZ(), 10.0).value_or(0.0), 2.5, 0.02);
  const auto round = scene.Trace({0, 0, 0}, Vector3d::UnitY(), 10.0);
  ASSERT_TRUE(round.has_value());
  EXPECT_NEAR(round->range, 3.5, 0.02);
  EXPECT_EQ(round->label, 0);
  // Circumscribed: rays that meet the ball meet the hull.
  Random random(5);
  for (int run = 0; run < 500; ++run) {
    const double angle = random.Uniform(-0.124, 0.124);
    const Vector3d direction(std::sin(angle), std::cos(angle), 0.0);
    EXPECT_TRUE(scene.Cast({0, 0, 0}, direction, 10.0).has_value()) << angle;
  }
}

}  // namespace
}  // namespace strata::testing
