// Two rooms with a thin wall between them: each face of it is a thing of its own.
#include "core/registration/faces.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "core/cloud/sensor_model.h"
#include "core/mls/build.h"
#include "core/registration/column_grid.h"
#include "core/registration/mls_registration.h"
#include "tests/support/simulator/scene.h"
#include "tests/support/simulator/simulator.h"

namespace strata::testing {
namespace {

// Walls along the cells would lie off their features, whatever their faces.
constexpr double kTurnRad = 0.6;
constexpr double kHalfWallM = 0.04;

// Rooms on both sides of x = 0, with a door in the middle.
Scene TwoRooms() {
  Scene scene;
  scene.Add(Box({-7.0, -5.0, -1.0}, {7.0, 5.0, 0.0}));
  scene.Add(Box({-7.0, -5.0, 2.8}, {7.0, 5.0, 3.0}));
  for (const double side : {-1.0, 1.0}) {
    const Eigen::Vector2d x(side * 6.13, side * 6.4);
    scene.Add(Box({x.minCoeff(), -5.0, 0.0}, {x.maxCoeff(), 5.0, 2.8}));
    const Eigen::Vector2d y(side * 4.07, side * 4.3);
    scene.Add(Box({-6.4, y.minCoeff(), 0.0}, {6.4, y.maxCoeff(), 2.8}));
    const Eigen::Vector2d wall(side * 0.6, side * 4.2);
    scene.Add(Box({-kHalfWallM, wall.minCoeff(), 0.0}, {kHalfWallM, wall.maxCoeff(), 2.8}));
    scene.Add(Box({side * 4.0 - 0.5, side * 2.1, 0.0}, {side * 4.0 + 0.5, side * 2.1 + 0.7, 1.2}));
  }
  scene.Add(Box({-kHalfWallM, -0.6, 2.1}, {kHalfWallM, 0.6, 2.8}));
  scene.Build();
  return scene;
}

Pose At(double x, double y) {
  Pose T(Eigen::AngleAxisd(kTurnRad, Eigen::Vector3d::UnitZ()));
  T.translation() = Eigen::Vector3d(x, y, 1.1);
  return T;
}

ScanFeatures FeaturesFrom(const Scene& scene, const Pose& T_world_scan) {
  SensorOptions sensor;
  sensor.rings = 48;
  sensor.columns = 720;
  const auto seed = static_cast<std::uint64_t>(1000.0 * (10.0 + T_world_scan.translation().x()));
  return ScanFeatures::FromMap(BuildMlsMap(SimulateScan(scene, sensor, T_world_scan, seed),
                                           Pose::Identity(),
                                           SensorModel(),
                                           MlsParameters())
                                   ->map,
                               {.sample_count = 4000});
}

// Mean offset, across the wall, of what the scans see in the second room when it is driven into.
double BiasOfTheSecondRoom() {
  const Scene scene = TwoRooms();
  std::vector<ScanFeatures> seen;
  std::vector<PlacedScan> placed;
  seen.reserve(20);
  double bias_m = 0.0;
  int scans = 0;
  for (double x = -4.0; x < 4.0; x += 0.75) {
    const Pose truth = At(x, 0.1);
    seen.push_back(FeaturesFrom(scene, truth));
    if (x > 0.0) {
      const RegistrationTarget target(placed, {.centre = truth.translation()});
      MlsRegistrationOptions options;
      options.max_samples = 4000;
      bias_m +=
          RegisterScan(seen.back(), target, truth, options).T_target_source.translation().x() - x;
      ++scans;
    }
    placed.push_back({&seen.back(), truth});
  }
  return bias_m / scans;
}

TEST(FacesOfWallsTest, DoNotPullTheNextRoomOntoTheirOtherSide) {
  const double bias_m = BiasOfTheSecondRoom();
  std::printf("%.1f mm\n", 1000.0 * bias_m);
  EXPECT_LT(std::abs(bias_m), 0.006);  // 0.0135 where faces are not told apart
}

// What a scan finds of its half of the wall.
struct Found {
  int features = 0;
  int one = 0;
  int other = 0;
  double mean_x_m = 0.0;  // of elements of one face
};

class FacesTest : public ::testing::Test {
 protected:
  // By a scan at `sensor`, in what was seen from `places`.
  Found FindIn(const std::vector<Pose>& places, const Eigen::Vector3f& sensor) const {
    std::vector<ScanFeatures> seen;
    seen.reserve(places.size());
    std::vector<PlacedScan> placed;
    for (const Pose& place : places) {
      seen.push_back(FeaturesFrom(scene_, place));
      placed.push_back({&seen.back(), place});
    }
    const RegistrationTarget target(placed);
    const auto& points = target.grid(FeatureClass::kVertical).points();
    Found found;
    for (std::uint32_t i = 0; i < points.size(); ++i) {
      const Eigen::Vector3f off = points[i] - Eigen::Vector3f(0.0F, 2.2F, 1.2F);
      if (off.x() * sensor.x() < 0.0F || std::abs(off.x()) > 0.2F || std::abs(off.y()) > 1.0F ||
          std::abs(off.z()) > 0.8F)
        continue;
      SurfaceElement element;
      const Face face = FaceTowards(target, i, sensor, Eigen::Vector3f::UnitX(), 16, 1.5F, element);
      ++found.features;
      found.one += face == Face::kOne ? 1 : 0;
      found.other += face == Face::kOther ? 1 : 0;
      if (face == Face::kOne) found.mean_x_m += element.point.x();
    }
    found.mean_x_m /= std::max(found.one, 1);
    std::printf("%d features, %d of one face at %.3f m, %d of the other\n",
                found.features,
                found.one,
                found.mean_x_m,
                found.other);
    return found;
  }

  const Scene scene_ = TwoRooms();
  const std::vector<Pose> first_room_ = {At(-2.0, 1.0), At(-2.5, 2.5), At(-1.5, 3.0)};
  const std::vector<Pose> second_room_ = {At(2.0, 1.0), At(2.5, 2.5), At(1.5, 3.0)};
  const Eigen::Vector3f in_the_first_{-3.0F, 1.5F, 1.1F};
  const Eigen::Vector3f in_the_second_{3.0F, 1.5F, 1.1F};
};

TEST_F(FacesTest, OfAWallThatWasSeenFromBothRoomsAScanGetsItsOwnFace) {
  std::vector<Pose> both = first_room_;
  both.insert(both.end(), second_room_.begin(), second_room_.end());
  const Found first = FindIn(both, in_the_first_);
  EXPECT_GT(first.one, first.features / 2);
  EXPECT_EQ(first.other, 0);
  EXPECT_NEAR(first.mean_x_m, -kHalfWallM, 0.01);
  const Found second = FindIn(both, in_the_second_);
  EXPECT_GT(second.one, second.features / 2);
  EXPECT_NEAR(second.mean_x_m, kHalfWallM, 0.01);
}

TEST_F(FacesTest, OfAWallThatWasSeenFromTheOtherRoomOnlyAScanGetsNothing) {
  const Found second = FindIn(first_room_, in_the_second_);
  EXPECT_GT(second.other, second.features / 2);
  EXPECT_EQ(second.one, 0);
  const Found first = FindIn(first_room_, in_the_first_);
  EXPECT_EQ(first.other + first.one, 0);
}

// A post is seen from all around, and says from any side where it is.
TEST(FacesOfPostsTest, AreNotToldApart) {
  Scene scene;
  scene.Add(Box({-9.0, -9.0, -1.0}, {9.0, 9.0, 0.0}));
  scene.Add(Box({-0.1, -0.1, 0.0}, {0.1, 0.1, 3.0}));
  scene.Build();
  const std::vector<Pose> places = {At(-2.0, 0.3), At(-3.0, -0.2)};
  std::vector<ScanFeatures> seen;
  seen.reserve(places.size());
  std::vector<PlacedScan> placed;
  for (const Pose& place : places) {
    seen.push_back(FeaturesFrom(scene, place));
    placed.push_back({&seen.back(), place});
  }
  const RegistrationTarget target(placed);
  ASSERT_GT(target.grid(FeatureClass::kVertical).points().size(), 20U);
  for (std::uint32_t i = 0; i < target.grid(FeatureClass::kVertical).points().size(); ++i) {
    SurfaceElement element;
    EXPECT_EQ(FaceTowards(target,
                          i,
                          Eigen::Vector3f(3.0F, 0.0F, 1.1F),
                          Eigen::Vector3f::UnitX(),
                          16,
                          1.5F,
                          element),
              Face::kWhole);
  }
}

}  // namespace
}  // namespace strata::testing
