// Expected views against beams that are followed in small steps.
#include "core/occupancy/expected_view.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <random>
#include <set>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/cloud/point_cloud.h"
#include "core/common/stop.h"
#include "core/geometry/pose.h"
#include "core/occupancy/information.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;
using testing::StatusIs;

constexpr double kVoxelM = 0.2;

// A hall of 12 m × 8 m × 3 m with a wall across that leaves a door open, seen from (2, 4, 1).
OccupancyVoxels SeenHall(const InverseSensorModel& model) {
  OccupancyVoxelsOptions options;
  options.voxel_m = kVoxelM;
  options.model = model;
  options.region = {Vector3d(-1.0, -1.0, -1.0), Vector3d(13.0, 9.0, 4.0)};
  OccupancyVoxels grid(options);
  PointCloud cloud;
  const Vector3d from(2.0, 4.0, 1.0);
  for (double azimuth = -M_PI; azimuth < M_PI; azimuth += 0.01) {
    for (double elevation = -0.7; elevation < 0.7; elevation += 0.01) {
      const Vector3d along(std::cos(elevation) * std::cos(azimuth),
                           std::cos(elevation) * std::sin(azimuth),
                           std::sin(elevation));
      double range = 100.0;
      const auto plane = [&](int axis, double at) {
        const double t = (at - from[axis]) / along[axis];
        if (t > 0.0) range = std::min(range, t);
      };
      const double t = (6.1 - from.x()) / along.x();
      const double y = from.y() + t * along.y();
      if (t > 0.0 && (y < 3.0 || y > 5.0)) range = t;
      plane(0, -0.1), plane(0, 12.1), plane(1, -0.1), plane(1, 8.1), plane(2, -0.1), plane(2, 3.1);
      cloud.points.emplace_back((range * along).cast<float>());
    }
  }
  EXPECT_TRUE(grid.Add(cloud, Pose(Eigen::Translation3d(from)), {}, Stop()).ok());
  return grid;
}

FieldOfView Sensor() {
  FieldOfView sensor;
  sensor.up_rad = 0.4;
  sensor.down_rad = 0.4;
  sensor.rows = 33;
  sensor.columns = 301;
  return sensor;
}

// Eq. 4.13 over distinct voxels, in steps of a 60th of a voxel.
ViewGain StepByStep(const OccupancyVoxels& grid, const FieldOfView& sensor, const Pose& pose) {
  OccupancyReader reader(grid);
  std::set<std::array<int, 3>> counted;
  ViewGain gain;
  for (int row = 0; row < sensor.rows; ++row) {
    const double elevation =
        -sensor.down_rad + (row + 0.5) * (sensor.up_rad + sensor.down_rad) / sensor.rows;
    for (int column = 0; column < sensor.columns; ++column) {
      const double azimuth = (-0.5 + (column + 0.5) / sensor.columns) * sensor.width_rad;
      const Vector3d along = pose.linear() * Vector3d(std::cos(elevation) * std::cos(azimuth),
                                                      std::cos(elevation) * std::sin(azimuth),
                                                      std::sin(elevation));
      for (double range = 0.0; range < sensor.max_range_m; range += kVoxelM / 60) {
        const Eigen::Vector3i at =
            ((pose.translation() + range * along) / kVoxelM).array().floor().cast<int>();
        if (!grid.Inside(at)) break;
        const double before = reader.Probability(at);
        const bool unknown = reader.Odds(at) == OccupancyVoxels::kUnknownOdds;
        const double z = (pose.translation() + range * along).z() / kVoxelM;
        const double z_next = z + kVoxelM / 60 * along.z() / kVoxelM;
        const bool hit = before > 0.5 && !reader.Passes(at, z, z_next);
        if (counted.insert({at.x(), at.y(), at.z()}).second) {
          const double after = OccupancyVoxels::ProbabilityOf(grid.After(reader.Odds(at), hit));
          gain.bits += InformationGainBits(before, after);
          if (unknown) gain.volume_m3 += std::pow(kVoxelM, 3);
        }
        if (hit) break;
      }
    }
  }
  return gain;
}

Pose At(double x, double y, double yaw = 0.0) {
  return MakePose(Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Vector3d::UnitZ())), {x, y, 1.03});
}

TEST(ExpectedViewTest, AgreesWithBeamsFollowedStepByStep) {
  for (const InverseSensorModel& model : {InverseSensorModel(), InverseSensorModel::OfOneLook()}) {
    const OccupancyVoxels grid = SeenHall(model);
    for (const Pose& pose : {At(2.03, 4.07), At(5.01, 1.53, 0.3), At(8.07, 4.33, 2.0)}) {
      const ViewGain expected = StepByStep(grid, Sensor(), pose);
      const ViewGain taken = ExpectedViews(grid, Sensor()).Follow(pose);
      EXPECT_NEAR(taken.bits, expected.bits, 0.01 * expected.bits + 0.5);
      EXPECT_NEAR(taken.volume_m3, expected.volume_m3, 0.01 * expected.volume_m3 + 0.05);
      const ViewGain some = ExpectedViews(grid, Sensor()).Estimate(pose);
      EXPECT_NEAR(
          some.bits, expected.bits, 0.2 * expected.bits + 150.0);  // few beams miss small gaps
    }
  }
}

TEST(ExpectedViewTest, WhatIsBehindTheWallIsWorthMore) {
  const OccupancyVoxels grid = SeenHall(InverseSensorModel::OfOneLook());
  ExpectedViews views(grid, Sensor());
  const ViewGain same = views.Estimate(At(2.03, 4.07));
  const ViewGain beyond = views.Estimate(At(7.0, 4.0));
  EXPECT_GT(beyond.bits, 5.0 * same.bits);
  EXPECT_GT(beyond.volume_m3, 20.0);
}

TEST(ExpectedViewTest, WhatIsTakenGainsNothingAgain) {
  const OccupancyVoxels grid = SeenHall(InverseSensorModel::OfOneLook());
  ExpectedViews views(grid, Sensor());
  const double first = views.Follow(At(7.0, 4.0)).bits;
  EXPECT_EQ(views.Follow(At(7.0, 4.0)).bits, first);
  views.Take();
  EXPECT_GT(first, 100.0);
  EXPECT_EQ(views.Follow(At(7.0, 4.0)).bits, 0.0);
  EXPECT_EQ(views.Estimate(At(7.0, 4.0)).bits, 0.0);
  EXPECT_GT(views.Estimate(At(10.0, 7.0)).bits, 0.0);
}

// From above, by a beam that ends there before another passed.
TEST(ExpectedViewTest, OpenGroundIsWorthAVoxelOfGroundUntilItIsTaken) {
  const OccupancyVoxels grid = SeenHall(InverseSensorModel::OfOneLook());
  const auto views = [&grid] {
    return ExpectedViews(grid, Sensor(), OccupancyVoxelsOptions().region, 10.0);
  };
  const Pose pose = At(2.03, 4.07);
  const double before = views().Follow(pose).bits;
  ExpectedViews with = views();
  for (const double x : {4.95, 5.15, 5.35}) with.AddOpenGround({x, 4.07, -0.1});
  with.AddOpenGround({7.1, 0.5, -0.1});  // behind the wall
  const double more = with.Follow(pose).bits - before;
  const double each = 10.0 * InformationGainBits(0.5, InverseSensorModel::OfOneLook().most);
  EXPECT_GT(more, 0.99 * each);
  EXPECT_LT(more, 3.01 * each);
  with.Take();
  EXPECT_EQ(with.Follow(pose).bits, 0.0);
  ExpectedViews from_below = views();
  from_below.AddOpenGround({5.1, 4.07, 3.1});
  EXPECT_EQ(from_below.Follow(pose).bits, before);
}

// Far away few beams end where there are many such places.
TEST(ExpectedViewTest, ABeamShowsOnePlaceOfOpenGround) {
  const OccupancyVoxels grid = SeenHall(InverseSensorModel::OfOneLook());
  const Pose pose = At(2.03, 4.07);
  const auto bits_with = [&](int places) {
    ExpectedViews views(grid, Sensor(), OccupancyVoxelsOptions().region, 10.0);
    for (int i = 0; i < places; ++i) {
      for (const double x : {4.95, 5.15, 5.35}) views.AddOpenGround({x, 4.07, -0.1});
    }
    return views.Follow(pose).bits;
  };
  const double each = 10.0 * InformationGainBits(0.5, InverseSensorModel::OfOneLook().most);
  EXPECT_GT(bits_with(1), bits_with(0) + 0.99 * each);
  EXPECT_LT(bits_with(200), bits_with(0) + 60.0 * each);
}

TEST(ExpectedViewTest, SomeBeamsSayOfOpenGroundWhatAllDo) {
  const OccupancyVoxels grid = SeenHall(InverseSensorModel::OfOneLook());
  ExpectedViews views(grid, Sensor(), OccupancyVoxelsOptions().region, 10.0);
  for (double x = 0.05; x < 6.0; x += 0.1) {
    for (double y = 0.05; y < 8.0; y += 0.1) views.AddOpenGround({x, y, -0.1});
  }
  for (const Pose& pose : {At(2.03, 4.07), At(1.01, 1.53, 0.3), At(4.07, 6.33, 2.0)}) {
    const double all = views.Follow(pose).bits;
    EXPECT_GT(all, 5000.0);
    EXPECT_NEAR(views.Estimate(pose).bits, all, 0.2 * all);
  }
}

// More views than the 16 bits that tell one from the next.
TEST(ExpectedViewTest, ViewsAreToldApartHoweverManyThereAre) {
  OccupancyVoxelsOptions options;
  options.voxel_m = 1.0;
  options.region = {Vector3d(-3.0, -3.0, -3.0), Vector3d(3.0, 3.0, 3.0)};
  const OccupancyVoxels grid(options);
  FieldOfView sensor;
  sensor.rows = 1;
  sensor.columns = 4;
  sensor.max_range_m = 2.0;
  ExpectedViews views(grid, sensor);
  const double first = views.Estimate(At(0.5, 0.5)).bits;
  EXPECT_GT(first, 0.0);
  for (int i = 0; i < 70'000; ++i) ASSERT_EQ(views.Estimate(At(0.5, 0.5)).bits, first) << i;
}

TEST(ExpectedViewTest, SensorsOutOfRangeAreNamed) {
  FieldOfView sensor;
  STRATA_EXPECT_OK(sensor.Validate());
  sensor.rows = 0;
  sensor.max_range_m = std::nan("");
  EXPECT_THAT(sensor.Validate(), StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("rows")));
  EXPECT_THAT(sensor.Validate(),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("max_range_m")));
}

}  // namespace
}  // namespace strata
