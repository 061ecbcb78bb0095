// Views that are chosen, against all that could be.
#include "core/planning/viewpoints.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/cloud/point_cloud.h"
#include "core/common/stop.h"
#include "core/occupancy/expected_view.h"
#include "core/planning/planner.h"
#include "tests/core/planning/memory_tiles.h"
#include "tests/support/drawing.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using Eigen::Vector3d;
using ::strata::testing::DrawnMap;
using ::strata::testing::MemoryTiles;
using ::strata::testing::StatusIs;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using Code = absl::StatusCode;

constexpr double kCell = 0.1;

// Level ground of 24 m × 8 m and 4 m × 4 m beside it from the origin on, and 3 m above its far end
// a floor of 8 m × 8 m that a ramp of 20 m leads up to.
DrawnMap TwoLevels() {
  DrawnMap map;
  for (int y = 0; y < 80; ++y) {
    for (int x = 0; x < 240; ++x) map[{x, y}].push_back({0.0});
  }
  // A ramp beside the ground, from x = 4 at y = 8 … 12 up to x = 24, then the floor.
  for (int y = 80; y < 120; ++y) {
    for (int x = 0; x < 40; ++x) map[{x, y}] = {{0.0}};
    for (int x = 40; x < 240; ++x) map[{x, y}] = {{0.15 * (x - 40) * kCell}};
    for (int x = 240; x < 320; ++x) map[{x, y}].push_back({3.0});
  }
  for (int y = 40; y < 80; ++y) {
    for (int x = 240; x < 320; ++x) map[{x, y}].push_back({3.0});
  }
  return map;
}

// All rays of a sensor with 2 × 10⁵ beams, each `range_m` long at most, over level ground.
PointCloud GroundSeen(double height_m, double range_m) {
  PointCloud cloud;
  for (double elevation = -1.2; elevation < 0.0; elevation += 0.01) {
    const double range = height_m / std::sin(-elevation);
    if (range > range_m) continue;
    for (double azimuth = -M_PI; azimuth < M_PI; azimuth += 0.01) {
      cloud.points.emplace_back((range * Vector3d(std::cos(elevation) * std::cos(azimuth),
                                                  std::cos(elevation) * std::sin(azimuth),
                                                  std::sin(elevation)))
                                    .cast<float>());
    }
  }
  return cloud;
}

class World {
 public:
  World() : source_(TwoLevels().Tiles()), planner_({.cell_size_m = kCell}) {}

  // What is known: the ground around these places.
  void See(const Vector3d& from, double range_m = 8.0) { seen_from_.push_back({from, range_m}); }

  absl::StatusOr<ExploreResult> Explore(const ExploreQuery& query) {
    const auto space_of = [this](const Eigen::AlignedBox3d& region, double voxel_m) {
      return SpaceOf(region, voxel_m);
    };
    return planner_.Explore(source_, query, space_of, Stop());
  }

  absl::StatusOr<std::shared_ptr<const SeenSpace>> SpaceOf(const Eigen::AlignedBox3d& region,
                                                           double voxel_m) {
    OccupancyVoxelsOptions options;
    options.voxel_m = voxel_m;
    options.region = region;
    options.model = InverseSensorModel::OfOneLook();
    auto seen = std::make_shared<SeenSpace>(SeenSpace{OccupancyVoxels(options)});
    for (const auto& [from, range_m] : seen_from_) {
      STRATA_RETURN_IF_ERROR(
          seen->voxels.Add(GroundSeen(1.0, range_m), Pose(Eigen::Translation3d(from)), {}, Stop()));
      seen->looks.emplace_back(Eigen::Translation3d(from));
    }
    ++asked;
    return std::shared_ptr<const SeenSpace>(std::move(seen));
  }

  int asked = 0;

 private:
  MemoryTiles source_;
  Planner planner_;
  std::vector<std::pair<Vector3d, double>> seen_from_;
};

ExploreQuery Query(double x, double y, double z = 0.0) {
  ExploreQuery query;
  query.from = {.x_m = x, .y_m = y, .z_m = z};
  query.sensor.max_range_m = 8.0;
  query.budget_m = 60.0;
  return query;
}

TEST(ViewpointsTest, LooksWhereNobodyHasLooked) {
  World world;
  world.See({4.0, 4.0, 1.0});
  STRATA_ASSERT_OK_AND_ASSIGN(const ExploreResult result, world.Explore(Query(4.0, 4.0)));
  EXPECT_EQ(result.reason, ExploreReason::kViews);
  ASSERT_THAT(result.views, SizeIs(5));
  EXPECT_GT(result.stands, 50U);
  EXPECT_GT(result.known_m3, 10.0);
  EXPECT_LT(result.known_m3, result.region_m3);
  for (const ExploreView& view : result.views) {
    EXPECT_GT((view.place - Vector3d(4.0, 4.0, 0.0)).norm(), 0.5);
    EXPECT_NEAR(view.T_map_sensor.translation().z(), view.place.z() + 1.0, 1e-6);
    EXPECT_NEAR(view.utility_bits, view.gain_bits - 10.0 * view.cost_m, 1e-6);
    EXPECT_GE(view.utility_bits, 100.0);
    EXPECT_GT(view.volume_m3, 0.0);
  }
}

// Its first view tells the most of all that the answer could be of, for how far it is and up to how
// gains are estimated; what tells most at all is left for later.
TEST(ViewpointsTest, NoOtherStandTellsMuchMoreForItsWay) {
  World world;
  const Vector3d start(4.0, 4.0, 1.0);
  world.See(start);
  ExploreQuery query = Query(4.0, 4.0);
  query.count = 1;
  STRATA_ASSERT_OK_AND_ASSIGN(const ExploreResult result, world.Explore(query));
  ASSERT_THAT(result.views, SizeIs(1));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto seen, world.SpaceOf(result.region, query.resolution_m));
  const auto for_the_way = [](double bits, double way_m) {
    return bits * std::exp(-way_m / kNearM);
  };
  double most = 0.0, most_for_the_way = 0.0;
  for (double x = 0.5; x < 24.0; x += 1.0) {
    for (double y = 0.5; y < 8.0; y += 1.0) {
      const Vector3d at(x, y, 1.0);
      const double way_m = (at - start).norm();
      if (way_m < 0.8) continue;
      const double gain = ExpectedViews(seen->voxels, query.sensor, result.region, kGroundWeight)
                              .Follow(Pose(Eigen::Translation3d(at)))
                              .bits;
      most = std::max(most, gain);
      most_for_the_way = std::max(most_for_the_way, for_the_way(gain, 1.1 * way_m));
    }
  }
  const ExploreView& view = result.views[0];
  EXPECT_GT(for_the_way(view.gain_bits, view.cost_m), 0.9 * most_for_the_way);
  EXPECT_LT(view.gain_bits, 0.9 * most);
}

// A view that did not tell what was expected is not taken again.
TEST(ViewpointsTest, NothingIsExpectedOfWhereALookWasTaken) {
  World world;
  world.See({4.0, 4.0, 1.0});
  ExploreQuery query = Query(4.0, 4.0);
  query.count = 1;
  STRATA_ASSERT_OK_AND_ASSIGN(const ExploreResult result, world.Explore(query));
  ASSERT_THAT(result.views, SizeIs(1));
  const Vector3d taken = result.views[0].T_map_sensor.translation();
  world.See(taken, 0.1);  // nothing of the ground
  STRATA_ASSERT_OK_AND_ASSIGN(const ExploreResult after, world.Explore(query));
  ASSERT_THAT(after.views, SizeIs(1));
  EXPECT_GT((after.views[0].T_map_sensor.translation() - taken).norm(), 0.5);
}

TEST(ViewpointsTest, GoesUpTheRampToAnotherLevel) {
  World world;
  for (double x = 2.0; x < 24.0; x += 4.0) {
    world.See({x, 2.0, 1.0}, 12.0);
    world.See({x, 6.0, 1.0}, 12.0);
  }
  ExploreQuery query = Query(4.0, 4.0);
  query.region = {Vector3d(24.0, 2.0, 2.5), Vector3d(32.0, 12.0, 5.0)};
  query.sensor.max_range_m = 5.0;
  query.count = 1;
  STRATA_ASSERT_OK_AND_ASSIGN(const ExploreResult up, world.Explore(query));
  ASSERT_THAT(up.views, SizeIs(1)) << up.message;
  EXPECT_GT(up.views[0].place.z(), 2.0);
  EXPECT_GT(up.views[0].cost_m, 15.0);
  query.budget_m = 8.0;
  STRATA_ASSERT_OK_AND_ASSIGN(const ExploreResult near, world.Explore(query));
  EXPECT_EQ(near.reason, ExploreReason::kExplored);
  EXPECT_THAT(near.message, HasSubstr("within 8 m"));
}

// What is left of it tells less than the ramp, whose foot is nearer.
TEST(ViewpointsTest, FinishesALevelBeforeItGoesToAnother) {
  World world;
  for (double x = 2.0; x < 16.0; x += 4.0) {
    world.See({x, 2.0, 1.0});
    world.See({x, 6.0, 1.0});
  }
  ExploreQuery query = Query(4.0, 9.0);
  query.region = {Vector3d(14.0, 0.0, -0.4), Vector3d(24.0, 12.0, 4.0)};
  query.sensor.max_range_m = 5.0;
  query.count = 10;
  STRATA_ASSERT_OK_AND_ASSIGN(const ExploreResult result, world.Explore(query));
  const std::vector<ExploreView>& views = result.views;
  const auto is_below = [](const ExploreView& view) { return view.place.z() < kLevelM; };
  const auto first_above = std::find_if_not(views.begin(), views.end(), is_below);
  ASSERT_TRUE(first_above != views.begin() && first_above != views.end()) << result.message;
  EXPECT_TRUE(std::none_of(first_above, views.end(), is_below));
  EXPECT_GT(first_above->gain_bits, 2.0 * std::prev(first_above)->gain_bits);
}

TEST(ViewpointsTest, LaterViewsAreWorthLess) {
  World world;
  world.See({4.0, 4.0, 1.0});
  ExploreQuery query = Query(4.0, 4.0);
  query.bits_per_m = 0.0;
  query.count = 100;
  STRATA_ASSERT_OK_AND_ASSIGN(const ExploreResult result, world.Explore(query));
  ASSERT_GT(result.views.size(), 5U);
  EXPECT_LT(result.views.size(), 100U);
  EXPECT_LT(result.views.back().gain_bits, 0.5 * result.views.front().gain_bits);
  double volume = 0.0;
  for (const ExploreView& view : result.views) volume += view.volume_m3;
  EXPECT_LT(volume, result.region_m3 - result.known_m3);
}

TEST(ViewpointsTest, AHorizonPrefersWhatIsNear) {
  World world;
  world.See({4.0, 4.0, 1.0});
  ExploreQuery query = Query(4.0, 4.0);
  query.count = 1;
  query.region = {Vector3d(20.0, 0.0, -0.4), Vector3d(24.0, 8.0, 1.0)};
  query.sensor.max_range_m = 20.0;
  query.bits_per_m = 0.0;
  query.min_bits = 1.0;
  STRATA_ASSERT_OK_AND_ASSIGN(const ExploreResult far, world.Explore(query));
  query.horizon = 10;
  STRATA_ASSERT_OK_AND_ASSIGN(const ExploreResult near, world.Explore(query));
  ASSERT_THAT(near.views, SizeIs(1));
  ASSERT_THAT(far.views, SizeIs(1));
  EXPECT_LT(near.views[0].cost_m, far.views[0].cost_m);
}

TEST(ViewpointsTest, ANarrowSensorIsTurnedToWhatIsUnknown) {
  World world;
  world.See({4.0, 4.0, 1.0}, 12.0);
  ExploreQuery query = Query(4.0, 4.0);
  query.sensor.width_rad = 1.0;
  query.sensor.columns = 200;
  query.count = 1;
  query.budget_m = 5.0;
  STRATA_ASSERT_OK_AND_ASSIGN(const ExploreResult result, world.Explore(query));
  ASSERT_THAT(result.views, SizeIs(1));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto seen, world.SpaceOf(result.region, query.resolution_m));
  const Pose chosen = result.views[0].T_map_sensor;
  const Pose back = chosen * Pose(Eigen::AngleAxisd(M_PI, Vector3d::UnitZ()));
  EXPECT_GE(ExpectedViews(seen->voxels, query.sensor).Follow(chosen).bits,
            ExpectedViews(seen->voxels, query.sensor).Follow(back).bits);
}

TEST(ViewpointsTest, TheSameAgain) {
  World world;
  world.See({4.0, 4.0, 1.0});
  STRATA_ASSERT_OK_AND_ASSIGN(const ExploreResult once, world.Explore(Query(4.0, 4.0)));
  STRATA_ASSERT_OK_AND_ASSIGN(const ExploreResult again, world.Explore(Query(4.0, 4.0)));
  ASSERT_EQ(once.views.size(), again.views.size());
  for (std::size_t i = 0; i < once.views.size(); ++i) {
    EXPECT_EQ(once.views[i].place, again.views[i].place);
    EXPECT_EQ(once.views[i].gain_bits, again.views[i].gain_bits);
  }
}

TEST(ViewpointsTest, WhatCannotBeAnsweredSaysWhy) {
  World world;
  STRATA_ASSERT_OK_AND_ASSIGN(const ExploreResult nowhere, world.Explore(Query(500.0, 4.0)));
  EXPECT_EQ(nowhere.reason, ExploreReason::kStartNotOnSurface);
  EXPECT_THAT(nowhere.views, IsEmpty());
  EXPECT_THAT(nowhere.message, HasSubstr("start"));
  const auto refused = [&](auto change) {
    ExploreQuery query = Query(4.0, 4.0);
    change(query);
    return world.Explore(query).status();
  };
  world.asked = 0;
  EXPECT_THAT(refused([](ExploreQuery& q) { q.count = 0; }),
              StatusIs(Code::kInvalidArgument, HasSubstr("count is 0, must be in [1, 100]")));
  EXPECT_THAT(refused([](ExploreQuery& q) { q.from.x_m = std::nan(""); }),
              StatusIs(Code::kInvalidArgument, HasSubstr("from")));
  EXPECT_THAT(refused([](ExploreQuery& q) { q.budget_m = std::nan(""); }),
              StatusIs(Code::kInvalidArgument, HasSubstr("budget_m")));
  EXPECT_THAT(refused([](ExploreQuery& q) { q.sensor.rows = 0; }),
              StatusIs(Code::kInvalidArgument, HasSubstr("rows")));
  EXPECT_THAT(refused([](ExploreQuery& q) { q.profile.radius_m = -1.0; }),
              StatusIs(Code::kInvalidArgument, HasSubstr("radius_m")));
  EXPECT_THAT(refused([](ExploreQuery& q) {
                q.region = {Vector3d(0, 0, 0), Vector3d(1, 1, std::nan(""))};
              }),
              StatusIs(Code::kInvalidArgument, HasSubstr("region")));
  EXPECT_EQ(world.asked, 0);
}

TEST(ViewpointsTest, TooManyVoxelsSayWhatFits) {
  World world;
  ExploreQuery query = Query(4.0, 4.0);
  query.resolution_m = 0.02;
  const absl::StatusOr<ExploreResult> refused = world.Explore(query);
  EXPECT_THAT(refused, StatusIs(Code::kInvalidArgument, HasSubstr("take a resolution of 0.0")));
  double fits = 0.0;
  const std::string message(refused.status().message());
  ASSERT_EQ(
      std::sscanf(message.c_str() + message.find("resolution of"), "resolution of %lf", &fits), 1);
  query.resolution_m = fits - 0.011;
  EXPECT_THAT(world.Explore(query), StatusIs(Code::kInvalidArgument, HasSubstr("resolution")));
  query.resolution_m = fits;
  query.count = 1;
  STRATA_EXPECT_OK(world.Explore(query));
}

TEST(ViewpointsTest, ARegionBeyondSight) {
  World world;
  ExploreQuery query = Query(4.0, 4.0);
  query.region = {Vector3d(500, 500, -5), Vector3d(600, 600, 5)};
  STRATA_ASSERT_OK_AND_ASSIGN(const ExploreResult result, world.Explore(query));
  EXPECT_EQ(result.reason, ExploreReason::kExplored);
  EXPECT_THAT(result.message, HasSubstr("out of sight"));
  EXPECT_EQ(world.asked, 0);
}

}  // namespace
}  // namespace strata
