// Conformance: plans, and watchers, and what was inferred.
#include <algorithm>
#include <limits>
#include <string>
#include <thread>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/database_suite/database_suite.h"
#include "tests/support/database_suite/things.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::_;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;
using Code = absl::StatusCode;

// Walls from west and east up to the half of the second block that nobody saw, and the floor once
// more: deleting the scans of the blocks leaves a floor with these. Around the west end there is
// another way.
void PutWalls(api::Database& db) {
  PointCloud cloud = LevelFloor();
  for (float z = 0.1F; z < 1.5F; z += 0.05F) {
    for (float x = -2.5F; x < 4.0F; x += 0.025F) {
      if (x < 2.5F || x > 2.9F) cloud.points.emplace_back(x, -1.675F, z);
    }
  }
  cloud.label.assign(cloud.size(), kGroundClass);
  STRATA_ASSERT_OK(UploadScan(db, kMap, FloorHeader({"walls", 1}, cloud), cloud));
  AwaitIntegration(db, kMap);
}

void Complete(api::Database& db) {
  FindKinds(db);
  const JobInfo job = EndOfJob(db, "complete");
  ASSERT_EQ(job.state, JobState::kSucceeded) << job.message;
}

RobotProfile Narrow() { return {.radius_m = 0.08, .height_m = 0.5}; }

// From south of the walls to north of them.
PlanQuery Through(InferredAs as) {
  PlanQuery query;
  query.from = {.x_m = 2.7, .y_m = -2.6};
  query.to = {.x_m = 2.7, .y_m = -0.8};
  query.profile = Narrow();
  query.inferred = as;
  return query;
}

PlanResult PlanThrough(api::Database& db, InferredAs as) {
  absl::StatusOr<PlanResult> plan = db.planning().PlanPath({}, kMap, Through(as));
  STRATA_EXPECT_OK(plan);
  return plan.ok() ? *std::move(plan) : PlanResult();
}

// How near the lines between waypoints come to the points, seen from above.
double Nearest(const std::vector<Eigen::Vector3d>& way,
               const std::vector<Eigen::Vector3d>& points) {
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i < way.size(); ++i) {
    const Eigen::Vector2d from = way[i - 1].head<2>();
    const Eigen::Vector2d along = way[i].head<2>() - from;
    for (const Eigen::Vector3d& p : points) {
      const double t = std::clamp((p.head<2>() - from).dot(along) / along.squaredNorm(), 0.0, 1.0);
      nearest = std::min(nearest, (from + t * along - p.head<2>()).norm());
    }
  }
  return nearest;
}

TEST_P(DatabaseSuite, PlansGoRoundWhatWasInferredIfAskedTo) {
  PutWholeAndHalf(db());
  PutWalls(db());
  const PlanResult none = PlanThrough(db(), InferredAs::kObstacle);
  EXPECT_THAT(none.message, HasSubstr("nothing is inferred in this map"));
  Complete(db());
  std::vector<Eigen::Vector3d> points;
  STRATA_ASSERT_OK_AND_ASSIGN(const std::vector<InferredPart> parts, InferredOf(db()));
  for (const InferredPart& part : parts) {
    points.insert(points.end(), part.points.begin(), part.points.end());
  }
  const PlanResult through = PlanThrough(db(), InferredAs::kIgnore);
  ASSERT_TRUE(through.found()) << through.message;
  EXPECT_NEAR(through.length_m, 1.8, 0.2);
  EXPECT_LT(Nearest(through.waypoints, points), Narrow().radius_m);
  const PlanResult around = PlanThrough(db(), InferredAs::kObstacle);
  ASSERT_TRUE(around.found()) << around.message;
  EXPECT_EQ(around.message, "found");
  EXPECT_GT(around.length_m, 8.0);
  EXPECT_GE(Nearest(around.waypoints, points), Narrow().radius_m);
  // Where it ends in what nobody saw, it says so.
  PlanQuery into = Through(InferredAs::kObstacle);
  into.to = {.x_m = 2.75, .y_m = -1.7};
  into.profile.max_gap_m = 0.0;
  STRATA_ASSERT_OK_AND_ASSIGN(const PlanResult refused, db().planning().PlanPath({}, kMap, into));
  EXPECT_FALSE(refused.found());
  EXPECT_TRUE(refused.inferred) << refused.message;
  EXPECT_THAT(refused.message, HasSubstr("inferred"));
  Reopen();
  EXPECT_NEAR(PlanThrough(db(), InferredAs::kObstacle).length_m, around.length_m, 1e-9);
  // It is there by the scan of the first block; the second was seen by another.
  STRATA_ASSERT_OK(db().scans().Delete({}, kMap, {"run", 1}));
  EXPECT_THAT(InferredOf(db()).value(), IsEmpty());
  const PlanResult lifted = PlanThrough(db(), InferredAs::kObstacle);
  ASSERT_TRUE(lifted.found()) << lifted.message;
  EXPECT_NEAR(lifted.length_m, through.length_m, 0.2);
}

// Cells of the largest floor within a box, by what they are.
struct CellCounts {
  int free = 0, occupied = 0;
};

CellCounts CellsWithin(const FloorPlan& plan, const Eigen::AlignedBox2d& box) {
  CellCounts counts;
  for (const FloorBlock& block : plan.floors.at(0).blocks) {
    for (int cell = 0; cell < 64; ++cell) {
      const Eigen::Vector2d middle(block.x * 8 + cell % 8 + 0.5, block.y * 8 + cell / 8 + 0.5);
      if (!box.contains(middle * plan.cell_size_m)) continue;
      counts.free += static_cast<int>(block.free >> cell & 1U);
      counts.occupied += static_cast<int>(block.occupied >> cell & 1U);
    }
  }
  return counts;
}

TEST_P(DatabaseSuite, FloorsAndPlacesHaveWhatWasInferredIfAskedTo) {
  PutWholeAndHalf(db());
  PutWalls(db());
  FloorQuery query = {.profile = Narrow(), .min_area_m2 = 1.0, .cells = true};
  query.inferred = InferredAs::kObstacle;
  STRATA_ASSERT_OK_AND_ASSIGN(const FloorPlan none, db().planning().ListFloors({}, kMap, query));
  EXPECT_THAT(none.message, HasSubstr("nothing is inferred in this map"));
  Complete(db());
  // Around what was inferred in the gap of the walls.
  const Eigen::AlignedBox2d gap(Eigen::Vector2d(2.5, -1.85), Eigen::Vector2d(2.9, -1.5));
  query.inferred = InferredAs::kIgnore;
  STRATA_ASSERT_OK_AND_ASSIGN(const FloorPlan open, db().planning().ListFloors({}, kMap, query));
  EXPECT_THAT(open.message, IsEmpty());
  query.inferred = InferredAs::kObstacle;
  STRATA_ASSERT_OK_AND_ASSIGN(const FloorPlan shut, db().planning().ListFloors({}, kMap, query));
  EXPECT_THAT(shut.message, IsEmpty());
  ASSERT_THAT(open.floors, Not(IsEmpty()));
  ASSERT_THAT(shut.floors, Not(IsEmpty()));
  EXPECT_GT(CellsWithin(open, gap).free, 0);
  EXPECT_EQ(CellsWithin(shut, gap).free, 0);
  EXPECT_GT(CellsWithin(shut, gap).occupied, CellsWithin(open, gap).occupied);
  PlaceQuery places = {.profile = Narrow(), .at = PlanEndpoint{.x_m = 2.7, .y_m = -2.6}};
  const auto area = [&](InferredAs as) {
    places.inferred = as;
    const absl::StatusOr<FloorPlaces> found = db().planning().ListPlaces({}, kMap, places);
    STRATA_EXPECT_OK(found);
    double area_m2 = 0.0;
    for (const Place& place : found.ok() ? found->places : std::vector<Place>()) {
      area_m2 += place.area_m2;
    }
    return area_m2;
  };
  EXPECT_LT(area(InferredAs::kObstacle), area(InferredAs::kIgnore));
}

// Takes what watchers are told.
template <typename T>
class Heard {
 public:
  absl::Status Take(const T& told) {
    absl::MutexLock lock(&mutex_);
    all_.push_back(told);
    return absl::OkStatus();
  }
  // The first of them that `wanted` takes, once it has come.
  template <typename Wanted>
  T Await(Wanted wanted) {
    absl::MutexLock lock(&mutex_);
    const auto come = [&]() ABSL_SHARED_LOCKS_REQUIRED(mutex_) {
      return std::any_of(all_.begin(), all_.end(), wanted);
    };
    mutex_.Await(absl::Condition(&come));
    return *std::find_if(all_.begin(), all_.end(), wanted);
  }

 private:
  absl::Mutex mutex_;
  std::vector<T> all_ ABSL_GUARDED_BY(mutex_);
};

TEST_P(DatabaseSuite, APathThatStandsOnWhatWasInferredIsToldWhenThatChanges) {
  PutWholeAndHalf(db());
  PutWalls(db());
  const PlanResult through = PlanThrough(db(), InferredAs::kIgnore);
  ASSERT_TRUE(through.found());
  PathQuery minds = {
      .waypoints = through.waypoints, .profile = Narrow(), .inferred = InferredAs::kObstacle};
  PathQuery ignores = minds;
  ignores.inferred = InferredAs::kIgnore;
  STRATA_ASSERT_OK_AND_ASSIGN(minds.known, db().planning().CheckPath({}, kMap, minds));
  STRATA_ASSERT_OK_AND_ASSIGN(ignores.known, db().planning().CheckPath({}, kMap, ignores));
  EXPECT_TRUE(minds.known->valid) << minds.known->message;
  Heard<PathCheck> heard;
  const api::Call call;
  std::thread watcher([&] {
    EXPECT_THAT(db().planning().WatchPath(
                    call, kMap, minds, [&](const PathCheck& check) { return heard.Take(check); }),
                StatusIs(Code::kCancelled, _));
  });
  EXPECT_TRUE(heard.Await([](const PathCheck&) { return true; }).valid);
  Complete(db());
  const PathCheck blocked = heard.Await([](const PathCheck& check) { return !check.valid; });
  EXPECT_TRUE(blocked.inferred);
  ASSERT_TRUE(blocked.where.has_value());
  EXPECT_NEAR(blocked.where->x(), 2.65, 0.2);
  STRATA_ASSERT_OK_AND_ASSIGN(const PathCheck known, db().planning().CheckPath({}, kMap, minds));
  EXPECT_FALSE(known.valid);
  EXPECT_GT(known.commit_sequence, minds.known->commit_sequence);
  STRATA_ASSERT_OK_AND_ASSIGN(const PathCheck free, db().planning().CheckPath({}, kMap, ignores));
  EXPECT_TRUE(free.valid) << free.message;
  STRATA_ASSERT_OK(db().scans().Delete({}, kMap, {"run", 1}));
  heard.Await([&](const PathCheck& check) {
    return check.valid && check.commit_sequence > known.commit_sequence;
  });
  call.stop.Request();
  watcher.join();
}

TEST_P(DatabaseSuite, ShapesAndWaysToLookTouchWhatWasInferredIfAskedTo) {
  PutWholeAndHalf(db());
  PutWalls(db());
  Complete(db());
  ShapeQuery query;
  ShapePart part;
  part.size_m = {0.2, 0.1, 0.5};
  part.T_shape_part = Pose(Eigen::Translation3d(0.0, 0.0, 0.25));
  query.shape.parts = {part};
  query.waypoints = {{2.67, -2.6, 0.0}, {2.67, -0.8, 0.0}};
  STRATA_ASSERT_OK_AND_ASSIGN(const ShapeCheck free, db().planning().CheckShape({}, kMap, query));
  EXPECT_TRUE(free.free) << free.message;
  query.inferred = InferredAs::kObstacle;
  STRATA_ASSERT_OK_AND_ASSIGN(const ShapeCheck check, db().planning().CheckShape({}, kMap, query));
  ASSERT_THAT(check.contacts, Not(IsEmpty()));
  EXPECT_TRUE(check.contacts[0].inferred);
  EXPECT_THAT(check.message, HasSubstr("only inferred"));
  ExploreQuery explore;
  explore.from = {.x_m = 2.75, .y_m = -1.72};
  explore.profile = Narrow();
  explore.profile.max_gap_m = 0.0;
  explore.sensor.max_range_m = 4.0;
  STRATA_ASSERT_OK_AND_ASSIGN(const ExploreResult in, db().planning().Explore({}, kMap, explore));
  EXPECT_NE(in.reason, ExploreReason::kStartNotOnSurface) << in.message;
  explore.inferred = InferredAs::kObstacle;
  STRATA_ASSERT_OK_AND_ASSIGN(const ExploreResult out, db().planning().Explore({}, kMap, explore));
  EXPECT_EQ(out.reason, ExploreReason::kStartNotOnSurface) << out.message;
}

TEST_P(DatabaseSuite, WhoWatchesAMapIsToldWhenWhatIsInferredMayBeAnother) {
  PutWholeAndHalf(db());
  Heard<api::MapUpdate> heard;
  const api::Call call;
  std::thread watcher([&] {
    EXPECT_THAT(
        db().maps().Watch(
            call, kMap, {}, [&](const api::MapUpdate& update) { return heard.Take(update); }),
        StatusIs(Code::kCancelled, _));
  });
  const api::MapUpdate first =
      heard.Await([](const api::MapUpdate& update) { return update.whole; });
  EXPECT_FALSE(first.inferred);
  Complete(db());
  const api::MapUpdate made =
      heard.Await([](const api::MapUpdate& update) { return update.inferred; });
  EXPECT_GT(made.commit_sequence, first.commit_sequence);
  EXPECT_THAT(made.tiles, IsEmpty());
  EXPECT_THAT(InferredOf(db()).value(), SizeIs(2));
  STRATA_ASSERT_OK(db().scans().Delete({}, kMap, {"run", 1}));
  // What a worker made may be told once more before that, by who has the map.
  const api::MapUpdate gone = heard.Await(
      [&](const api::MapUpdate& update) { return update.inferred && !update.scans.empty(); });
  EXPECT_THAT(InferredOf(db()).value(), IsEmpty());
  // And whoever comes back later.
  const auto since = [&](std::uint64_t commit_sequence) {
    api::WatchOptions options;
    options.since = commit_sequence;
    options.once = true;
    api::MapUpdate told;
    STRATA_EXPECT_OK(db().maps().Watch({}, kMap, options, [&](const api::MapUpdate& update) {
      told = update;
      return absl::OkStatus();
    }));
    return told.inferred;
  };
  EXPECT_TRUE(since(made.commit_sequence));
  EXPECT_FALSE(since(gone.commit_sequence));
  call.stop.Request();
  watcher.join();
}

TEST_P(DatabaseSuite, WhatWasInferredIsListedByWhereItIs) {
  PutWholeAndHalf(db());
  Complete(db());
  STRATA_ASSERT_OK_AND_ASSIGN(const std::vector<InferredPart> parts, InferredOf(db()));
  ASSERT_THAT(parts, SizeIs(2));
  // East of the box around what was measured of the second block.
  const Eigen::AlignedBox3d beyond(Eigen::Vector3d(2.72, -3, -1), Eigen::Vector3d(4, 0, 3));
  EXPECT_THAT(EntitiesWith(db(), {.region = beyond}), IsEmpty());
  STRATA_ASSERT_OK_AND_ASSIGN(const std::vector<InferredPart> found,
                              InferredOf(db(), {.region = beyond}));
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_EQ(found[0], parts[1]);
  const Eigen::AlignedBox3d above(Eigen::Vector3d(-4, -4, 1.5), Eigen::Vector3d(4, 4, 3));
  EXPECT_THAT(InferredOf(db(), {.region = above}).value(), IsEmpty());
}

}  // namespace
}  // namespace strata::testing
