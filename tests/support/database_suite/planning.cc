// Conformance: planning.
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/database_suite/database_suite.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::_;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using Code = absl::StatusCode;

TEST_P(DatabaseSuite, SurfacesAndPathsOnALevelFloor) {
  PutFloor(db(), {"run", 1});
  STRATA_ASSERT_OK_AND_ASSIGN(
      const auto columns,
      db().planning().SampleSurfaces({}, kMap, {Eigen::Vector2d(1.0, 1.0), {50.0, 0.0}}));
  ASSERT_THAT(columns, SizeIs(2));
  ASSERT_THAT(columns[0].surfaces, SizeIs(1));
  EXPECT_NEAR(columns[0].surfaces[0].z_m, 0.0, 1e-3);
  EXPECT_THAT(columns[1].surfaces, IsEmpty());

  PlanQuery query;
  query.from.x_m = -2.0;
  query.to.x_m = 2.0;
  STRATA_ASSERT_OK_AND_ASSIGN(PlanResult plan, db().planning().PlanPath({}, kMap, query));
  EXPECT_EQ(plan.reason, PlanReason::kFound) << plan.message;
  EXPECT_NEAR(plan.length_m, 4.0, 0.2);
  EXPECT_GE(plan.waypoints.size(), 2U);
  query.to.x_m = 50.0;
  STRATA_ASSERT_OK_AND_ASSIGN(plan, db().planning().PlanPath({}, kMap, query));
  EXPECT_EQ(plan.reason, PlanReason::kGoalNotOnSurface) << plan.message;
  EXPECT_THAT(plan.waypoints, IsEmpty());
  query.profile.radius_m = -1.0;
  EXPECT_THAT(db().planning().PlanPath({}, kMap, query),
              StatusIs(Code::kInvalidArgument, HasSubstr("radius_m")));
}

TEST_P(DatabaseSuite, PathsKeepToWhatClassesCost) {
  PointCloud floor = LevelFloor();
  for (const Eigen::Vector3f& p : floor.points) {
    floor.label.push_back(std::abs(p.x()) < 0.5F && p.y() < 1.0F ? 3 : 1);
  }
  STRATA_ASSERT_OK(UploadScan(db(), kMap, FloorHeader({"run", 1}, floor, 0.0), floor));
  AwaitIntegration(db(), kMap);
  PlanQuery query;
  query.from.x_m = -1.5;
  query.to.x_m = 1.5;
  STRATA_ASSERT_OK_AND_ASSIGN(const PlanResult straight, db().planning().PlanPath({}, kMap, query));
  EXPECT_NEAR(straight.length_m, 3.0, 0.1);
  query.class_costs = {{3, 1.5}};
  STRATA_ASSERT_OK_AND_ASSIGN(const PlanResult dearer, db().planning().PlanPath({}, kMap, query));
  EXPECT_NEAR(dearer.cost - straight.cost, 0.5, 0.2);
  query.class_costs = {{3, kForbiddenClass}};
  STRATA_ASSERT_OK_AND_ASSIGN(const PlanResult around, db().planning().PlanPath({}, kMap, query));
  EXPECT_TRUE(around.found()) << around.message;
  EXPECT_GT(around.length_m, straight.length_m + 0.3);
  query.class_costs = {{3, kForbiddenClass}, {1, 0.5}};
  EXPECT_THAT(db().planning().PlanPath({}, kMap, query),
              StatusIs(Code::kInvalidArgument, HasSubstr("factor 0.5 of class 1")));
}

TEST_P(DatabaseSuite, ExploresWhatNoScanSaw) {
  PutFloor(db(), {"run", 1});
  const PointCloud beside = LevelFloor();
  ScanHeader low = FloorHeader({"run", 2}, beside, 8.0);
  low.sensor_origin.z() = 0.05F;  // sees little of the space over its floor
  STRATA_ASSERT_OK(UploadScan(db(), kMap, low, beside));
  AwaitIntegration(db(), kMap);
  ExploreQuery query;
  query.from.x_m = -2.0;
  query.count = 3;
  query.sensor.max_range_m = 6.0;
  query.min_bits = 20.0;
  STRATA_ASSERT_OK_AND_ASSIGN(const ExploreResult result, db().planning().Explore({}, kMap, query));
  EXPECT_EQ(result.reason, ExploreReason::kViews) << result.message;
  ASSERT_THAT(result.views, SizeIs(3));
  EXPECT_TRUE(std::any_of(result.views.begin(), result.views.end(), [](const ExploreView& view) {
    return view.place.x() > 0.0;
  }));
  EXPECT_NEAR(result.views[0].place.z(), 0.0, 1e-2);
  EXPECT_NEAR(result.views[0].T_map_sensor.translation().z(), 1.0, 1e-2);
  EXPECT_GE(result.views[2].utility_bits, query.min_bits);
  EXPECT_EQ(result.scans, 2U);
  EXPECT_EQ(result.scans_left_out, 0U);
  EXPECT_GT(result.known_m3, 1.0);
  EXPECT_GT(result.region_m3, result.known_m3);
  EXPECT_TRUE(result.region.contains(result.views[0].place));
  PlanQuery way;
  way.from = query.from;
  way.to.x_m = result.views[0].place.x();
  way.to.y_m = result.views[0].place.y();
  STRATA_ASSERT_OK_AND_ASSIGN(const PlanResult path, db().planning().PlanPath({}, kMap, way));
  EXPECT_TRUE(path.found()) << path.message;
  EXPECT_NEAR(path.graph_cost, result.views[0].cost_m, 0.05 * path.graph_cost + 0.2);
  query.min_bits = 1e6;
  STRATA_ASSERT_OK_AND_ASSIGN(const ExploreResult none, db().planning().Explore({}, kMap, query));
  EXPECT_EQ(none.reason, ExploreReason::kExplored);
  EXPECT_THAT(none.message, HasSubstr("explored"));
}

// What is kept of a region goes on with the scans that came since, and only while they are the
// same.
TEST_P(DatabaseSuite, ExploringAgainIsAsExploringFirst) {
  ExploreQuery query;
  query.from.x_m = -2.0;
  query.count = 3;
  query.sensor.max_range_m = 6.0;
  query.min_bits = 20.0;
  const auto explored = [&] {
    absl::StatusOr<ExploreResult> result = db().planning().Explore({}, kMap, query);
    STRATA_EXPECT_OK(result);
    return result.ok() ? *std::move(result) : ExploreResult();
  };
  const auto is_as_anew = [&] {
    const ExploreResult kept = explored();
    Reopen();
    const ExploreResult anew = explored();
    EXPECT_EQ(kept.known_m3, anew.known_m3);
    EXPECT_EQ(kept.scans, anew.scans);
    ASSERT_EQ(kept.views.size(), anew.views.size());
    for (std::size_t i = 0; i < kept.views.size(); ++i) {
      EXPECT_EQ(kept.views[i].place, anew.views[i].place);
      EXPECT_EQ(kept.views[i].gain_bits, anew.views[i].gain_bits);
    }
  };
  PutFloor(db(), {"run", 1});
  const ExploreResult first = explored();
  const PointCloud beside = LevelFloor();
  for (const double x_m : {3.0, 8.0}) {
    const ScanHeader header = FloorHeader({"run", x_m > 5.0 ? 3U : 2U}, beside, x_m);
    STRATA_ASSERT_OK(UploadScan(db(), kMap, header, beside));
    AwaitIntegration(db(), kMap);
    query.region = first.region;
    const ExploreResult next = explored();
    EXPECT_GT(next.known_m3, first.known_m3);
  }
  is_as_anew();
  STRATA_ASSERT_OK(db().scans().Delete({}, kMap, {"run", 2}));
  AwaitIntegration(db(), kMap);
  is_as_anew();
}

TEST_P(DatabaseSuite, ExploringWhereThatIsNotPossibleSaysWhy) {
  STRATA_ASSERT_OK_AND_ASSIGN(const ExploreResult empty, db().planning().Explore({}, kMap, {}));
  EXPECT_EQ(empty.reason, ExploreReason::kStartNotOnSurface);
  EXPECT_THAT(db().planning().Explore({}, "nowhere", {}), StatusIs(Code::kNotFound, _));
  ExploreQuery query;
  query.count = 0;
  EXPECT_THAT(db().planning().Explore({}, kMap, query),
              StatusIs(Code::kInvalidArgument, HasSubstr("count is 0")));
  query = {};
  query.from.x_m = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(db().planning().Explore({}, kMap, query),
              StatusIs(Code::kInvalidArgument, HasSubstr("from")));
  PutFloor(db(), {"run", 1});
  query = {};
  query.resolution_m = 0.01;
  EXPECT_THAT(db().planning().Explore({}, kMap, query),
              StatusIs(Code::kInvalidArgument, HasSubstr("take a resolution of")));
  MapParameters parameters;
  parameters.keep_points = false;
  STRATA_ASSERT_OK(db().maps().Create({}, "bare", parameters));
  const PointCloud floor = LevelFloor();
  STRATA_ASSERT_OK(UploadScan(db(), "bare", FloorHeader({"run", 1}, floor), floor));
  AwaitIntegration(db(), "bare");
  EXPECT_THAT(db().planning().Explore({}, "bare", {}),
              StatusIs(Code::kFailedPrecondition, HasSubstr("--drop-points")));
}

TEST_P(DatabaseSuite, AShapeIsHeldAgainstTheMap) {
  PointCloud floor = LevelFloor();
  for (int i = 0; i < 20; ++i) {
    floor.points.emplace_back(1.03F, 0.28F, 0.05F * static_cast<float>(i + 1));  // a post
  }
  STRATA_ASSERT_OK(UploadScan(db(), kMap, FloorHeader({"run", 1}, floor), floor));
  AwaitIntegration(db(), kMap);
  ShapeQuery query;
  ShapePart cart;
  cart.size_m = {1.0, 0.36, 0.8};
  cart.T_shape_part = Pose(Eigen::Translation3d(0.0, 0.0, 0.4));
  query.shape.parts = {cart};
  query.waypoints = {{-2.0, 0.0, 0.0}, {2.5, 0.0, 0.0}};
  STRATA_ASSERT_OK_AND_ASSIGN(const ShapeCheck by, db().planning().CheckShape({}, kMap, query));
  EXPECT_TRUE(by.free) << by.message;
  EXPECT_NEAR(by.length_m, 4.5, 1e-9);
  query.shape.parts[0].size_m.y() = 0.7;
  STRATA_ASSERT_OK_AND_ASSIGN(const ShapeCheck wide, db().planning().CheckShape({}, kMap, query));
  EXPECT_FALSE(wide.free);
  ASSERT_THAT(wide.contacts, SizeIs(1));
  EXPECT_NEAR(wide.contacts[0].from_m, 2.5, 0.1);
  EXPECT_NEAR(wide.contacts[0].where.y(), 0.28, 0.2);
  EXPECT_EQ(wide.free_m, wide.contacts[0].from_m);
  query.waypoints = {{3.0, 0.0, 0.0}, {6.0, 0.0, 0.0}};  // beyond the floor
  STRATA_ASSERT_OK_AND_ASSIGN(const ShapeCheck off, db().planning().CheckShape({}, kMap, query));
  EXPECT_TRUE(off.free);
  query.unknown_blocks = true;
  STRATA_ASSERT_OK_AND_ASSIGN(const ShapeCheck known, db().planning().CheckShape({}, kMap, query));
  ASSERT_FALSE(known.free);
  EXPECT_TRUE(known.contacts[0].unknown);
  EXPECT_THAT(db().planning().CheckShape({}, "nowhere", query), StatusIs(Code::kNotFound, _));
  query.poses = {Pose::Identity()};
  EXPECT_THAT(db().planning().CheckShape({}, kMap, query),
              StatusIs(Code::kInvalidArgument, HasSubstr("poses or waypoints")));
  query.waypoints.clear();
  query.poses = {NanPose()};
  EXPECT_THAT(db().planning().CheckShape({}, kMap, query), StatusIs(Code::kInvalidArgument, _));
}

// A wall across the floor at x = 0.
PointCloud Wall() {
  PointCloud wall;
  for (int y = -80; y < 80; ++y) {
    for (int z = 0; z < 20; ++z) {
      wall.points.emplace_back(
          0.01F, static_cast<float>(0.05 * y), 0.05F * static_cast<float>(z + 1));
    }
  }
  return wall;
}

// What the watcher of a path is told, in order.
class Told {
 public:
  absl::Status Take(const PathCheck& check) {
    absl::MutexLock lock(&mutex_);
    told_.push_back(check);
    return absl::OkStatus();
  }
  // The i-th message, once it has come.
  PathCheck Await(std::size_t i) {
    absl::MutexLock lock(&mutex_);
    const auto come = [this, i]() ABSL_SHARED_LOCKS_REQUIRED(mutex_) { return told_.size() > i; };
    mutex_.Await(absl::Condition(&come));
    return told_[i];
  }
  std::size_t count() {
    absl::MutexLock lock(&mutex_);
    return told_.size();
  }

 private:
  absl::Mutex mutex_;
  std::vector<PathCheck> told_ ABSL_GUARDED_BY(mutex_);
};

TEST_P(DatabaseSuite, APathHoldsUntilSomethingStandsInItsWay) {
  PutFloor(db(), {"run", 1});
  PlanQuery query;
  query.from.x_m = -2.0;
  query.to.x_m = 2.0;
  STRATA_ASSERT_OK_AND_ASSIGN(const PlanResult plan, db().planning().PlanPath({}, kMap, query));
  PathQuery asked = {plan.waypoints, query.profile};
  STRATA_ASSERT_OK_AND_ASSIGN(const PathCheck before, db().planning().CheckPath({}, kMap, asked));
  EXPECT_TRUE(before.valid) << before.message;
  EXPECT_NEAR(before.length_m, plan.length_m, 1e-6);
  EXPECT_FALSE(before.tiles.empty());
  asked.known = before;
  STRATA_ASSERT_OK_AND_ASSIGN(const PathCheck again, db().planning().CheckPath({}, kMap, asked));
  EXPECT_EQ(again.message, before.message);
  Told told;
  const api::Call call;
  std::thread watcher([&] {
    EXPECT_THAT(db().planning().WatchPath(
                    call, kMap, asked, [&](const PathCheck& check) { return told.Take(check); }),
                StatusIs(Code::kCancelled, _));
  });
  EXPECT_TRUE(told.Await(0).valid);
  PutFloor(db(), {"far", 1}, 300.0);  // says nothing about the path
  const PointCloud wall = Wall();
  STRATA_ASSERT_OK(UploadScan(db(), kMap, FloorHeader({"wall", 1}, wall), wall));
  const PathCheck blocked = told.Await(1);
  EXPECT_FALSE(blocked.valid);
  ASSERT_TRUE(blocked.where.has_value());
  EXPECT_NEAR(blocked.where->x(), 0.0, 0.2);
  EXPECT_NE(blocked.obstruction, Obstruction::kNone);
  EXPECT_NEAR(blocked.valid_m, 2.0 - query.profile.radius_m, 0.4);
  STRATA_ASSERT_OK_AND_ASSIGN(const PathCheck known, db().planning().CheckPath({}, kMap, asked));
  EXPECT_EQ(known.message, blocked.message);
  STRATA_ASSERT_OK(db().scans().Delete({}, kMap, {"wall", 1}));
  EXPECT_TRUE(told.Await(2).valid);
  call.stop.Request();
  watcher.join();
  EXPECT_EQ(told.count(), 3U);
  asked.waypoints.clear();
  EXPECT_THAT(db().planning().CheckPath({}, kMap, asked),
              StatusIs(Code::kInvalidArgument, HasSubstr("waypoints: 0")));
  EXPECT_THAT(db().planning().CheckPath({}, "none", {plan.waypoints, {}}),
              StatusIs(Code::kNotFound, _));
}

TEST_P(DatabaseSuite, AFloorIsWhatARobotCanDrive) {
  FloorQuery query;
  STRATA_ASSERT_OK_AND_ASSIGN(const FloorPlan none, db().planning().ListFloors({}, kMap, query));
  EXPECT_TRUE(none.floors.empty());
  EXPECT_FALSE(none.at.has_value());
  PutFloor(db(), {"run", 1});
  query.at = PlanEndpoint{.x_m = 0.0, .y_m = 0.0};
  query.cells = true;
  STRATA_ASSERT_OK_AND_ASSIGN(const FloorPlan plan, db().planning().ListFloors({}, kMap, query));
  ASSERT_EQ(plan.floors.size(), 1U);
  EXPECT_EQ(plan.at, 0);
  EXPECT_TRUE(plan.links.empty());
  EXPECT_GT(plan.commit_sequence, none.commit_sequence);
  const Floor& floor = plan.floors[0];
  std::size_t cells = 0;
  for (const FloorBlock& block : floor.blocks) cells += std::popcount(block.free);
  EXPECT_GT(cells, 100U);
  EXPECT_NEAR(floor.area_m2, cells * plan.cell_size_m * plan.cell_size_m, 1e-6);
  EXPECT_TRUE(((floor.high - floor.low).head<2>().array() > 0.0).all());
  query.at = PlanEndpoint{.x_m = 500.0, .y_m = 0.0};
  STRATA_ASSERT_OK_AND_ASSIGN(const FloorPlan off, db().planning().ListFloors({}, kMap, query));
  EXPECT_FALSE(off.at.has_value());
  query.at->y_m = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(db().planning().ListFloors({}, kMap, query),
              StatusIs(Code::kInvalidArgument, HasSubstr("at")));
  query.at.reset();
  for (double RobotProfile::*field : {&RobotProfile::radius_m,
                                      &RobotProfile::height_m,
                                      &RobotProfile::max_step_m,
                                      &RobotProfile::max_slope_rad}) {
    query.profile = {};
    query.profile.*field = std::numeric_limits<double>::quiet_NaN();
    EXPECT_THAT(db().planning().ListFloors({}, kMap, query),
                StatusIs(Code::kInvalidArgument, HasSubstr("nan")));
  }
  query = {.profile = {}, .min_area_m2 = -1.0};
  EXPECT_THAT(db().planning().ListFloors({}, kMap, query),
              StatusIs(Code::kInvalidArgument, HasSubstr("min_area_m2")));
  EXPECT_THAT(db().planning().ListFloors({}, "none", {}), StatusIs(Code::kNotFound, _));
}

TEST_P(DatabaseSuite, PlacesAreOfOneFloor) {
  PlaceQuery query;
  query.cells = true;
  STRATA_ASSERT_OK_AND_ASSIGN(const FloorPlaces none, db().planning().ListPlaces({}, kMap, query));
  EXPECT_TRUE(none.places.empty());
  EXPECT_FALSE(none.floor.has_value());
  query.floor = 0;
  EXPECT_THAT(db().planning().ListPlaces({}, kMap, query),
              StatusIs(Code::kNotFound, HasSubstr("no floor")));
  PutFloor(db(), {"run", 1});
  STRATA_ASSERT_OK_AND_ASSIGN(const FloorPlaces found, db().planning().ListPlaces({}, kMap, query));
  STRATA_ASSERT_OK_AND_ASSIGN(const FloorPlan plan,
                              db().planning().ListFloors({}, kMap, {.profile = {}, .cells = true}));
  ASSERT_EQ(plan.floors.size(), 1U);
  EXPECT_EQ(found.floor, 0);
  EXPECT_EQ(found.commit_sequence, plan.commit_sequence);
  double area_m2 = 0.0;
  std::map<std::pair<std::int32_t, std::int32_t>, std::uint64_t> cells;
  for (const Place& place : found.places) {
    area_m2 += place.area_m2;
    for (const PlaceBlock& block : place.blocks) cells[{block.x, block.y}] += block.cells;
  }
  EXPECT_NEAR(area_m2, plan.floors[0].area_m2, 1e-6);
  for (const FloorBlock& block : plan.floors[0].blocks) {
    EXPECT_EQ((cells[{block.x, block.y}]), block.free);
  }
  query = {.profile = {}, .floor = {}, .at = PlanEndpoint{.x_m = 0.0, .y_m = 0.0}};
  STRATA_ASSERT_OK_AND_ASSIGN(const FloorPlaces there, db().planning().ListPlaces({}, kMap, query));
  EXPECT_EQ(there.places.size(), found.places.size());
  EXPECT_TRUE(there.places[0].blocks.empty());
}

TEST_P(DatabaseSuite, PlacesThatAreNoneAreNamed) {
  PutFloor(db(), {"run", 1});
  PlaceQuery query;
  query.floor = 3;
  EXPECT_THAT(db().planning().ListPlaces({}, kMap, query),
              StatusIs(Code::kNotFound, HasSubstr("no floor 3")));
  query.floor = -1;
  EXPECT_THAT(db().planning().ListPlaces({}, kMap, query),
              StatusIs(Code::kInvalidArgument, HasSubstr("floor -1")));
  query.floor = 0;
  query.at = PlanEndpoint{.x_m = 0.0, .y_m = 0.0};
  EXPECT_THAT(db().planning().ListPlaces({}, kMap, query),
              StatusIs(Code::kInvalidArgument, HasSubstr("not both")));
  query.floor.reset();
  query.at->x_m = 500.0;
  EXPECT_THAT(db().planning().ListPlaces({}, kMap, query),
              StatusIs(Code::kNotFound, HasSubstr("500")));
  query.at.reset();
  query.profile.radius_m = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(db().planning().ListPlaces({}, kMap, query),
              StatusIs(Code::kInvalidArgument, HasSubstr("radius")));
  EXPECT_THAT(db().planning().ListPlaces({}, "none", {}), StatusIs(Code::kNotFound, _));
  const api::Call cancelled;
  cancelled.stop.Request();
  EXPECT_THAT(db().planning().ListPlaces(cancelled, kMap, {}), StatusIs(Code::kCancelled, _));
}

TEST_P(DatabaseSuite, AStoppedCallSaysSo) {
  PutFloor(db(), {"run", 1});
  PlanQuery query;
  query.to.x_m = 2.0;
  const api::Call cancelled;
  cancelled.stop.Request();
  EXPECT_THAT(db().planning().PlanPath(cancelled, kMap, query), StatusIs(Code::kCancelled, _));
  const api::Call late{Stop(absl::UnixEpoch()), "", ""};
  EXPECT_THAT(db().planning().PlanPath(late, kMap, query), StatusIs(Code::kDeadlineExceeded, _));
}

TEST_P(DatabaseSuite, ProfilesAreKept) {
  RobotProfile profile;
  profile.radius_m = 0.9;
  profile.max_gap_m = 0.1;
  STRATA_ASSERT_OK(db().planning().SetProfile({}, kMap, "truck", profile));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto profiles, db().planning().ListProfiles({}, kMap));
  EXPECT_EQ(profiles.at("truck"), profile);
  EXPECT_EQ(profiles.at(std::string(api::kDefaultProfile)), RobotProfile());
  profile.height_m = 0.0;
  EXPECT_THAT(db().planning().SetProfile({}, kMap, "truck", profile),
              StatusIs(Code::kInvalidArgument, HasSubstr("height_m")));
  EXPECT_THAT(db().planning().SetProfile({}, kMap, "", {}), StatusIs(Code::kInvalidArgument, _));
}

}  // namespace
}  // namespace strata::testing
