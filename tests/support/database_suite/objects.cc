// Conformance: the things in maps.
#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/cloud/point_cloud.h"
#include "core/world/things/entity.h"
#include "tests/support/database_suite/database_suite.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::_;
using ::testing::HasSubstr;
using ::testing::SizeIs;
using Code = absl::StatusCode;

constexpr std::uint16_t kFloorClass = 1;
constexpr std::uint16_t kCrateClass = 2;

struct FoundThings {
  EntitiesInfo info;
  std::vector<Entity> entities;
};

absl::StatusOr<FoundThings> ThingsOf(api::Database& db, const EntityQuery& query = {}) {
  FoundThings things;
  STRATA_ASSIGN_OR_RETURN(things.info,
                          db.objects().ListEntities({}, kMap, query, [&](const Entity& entity) {
                            things.entities.push_back(entity);
                            return absl::OkStatus();
                          }));
  return things;
}

// The front of a crate of 1 × 1 m.
void AddCrate(float x, float y, PointCloud& cloud) {
  for (float across = 0.0F; across < 1.0F; across += 0.04F) {
    for (float up = 0.1F; up < 1.1F; up += 0.04F) {
      cloud.points.emplace_back(x, y + across, up);
      cloud.label.push_back(kCrateClass);
    }
  }
}

// A floor with crates at these places of the scan.
PointCloud FloorWithCrates(const std::vector<Eigen::Vector2f>& places) {
  PointCloud cloud = LevelFloor();
  cloud.label.assign(cloud.size(), kFloorClass);
  for (const Eigen::Vector2f& place : places) AddCrate(place.x(), place.y(), cloud);
  return cloud;
}

void PutCrates(api::Database& db, std::uint64_t sequence, const std::vector<Eigen::Vector2f>& at) {
  const PointCloud cloud = FloorWithCrates(at);
  STRATA_ASSERT_OK(UploadScan(db, kMap, FloorHeader({"run", sequence}, cloud), cloud));
  AwaitIntegration(db, kMap);
}

TEST_P(DatabaseSuite, ThingsAreFoundAcrossScansAndKeptUntilTheNext) {
  EXPECT_THAT(ThingsOf(db()), StatusIs(Code::kNotFound, HasSubstr("objects find")));
  PutCrates(db(), 1, {{-2.0F, -2.0F}, {2.0F, 1.0F}});
  PutCrates(db(), 2, {{-2.0F, -2.0F}});
  STRATA_ASSERT_OK(db().maps().SetClass({}, kMap, {kCrateClass, "crate", {200, 90, 20}}));
  const JobInfo job = EndOfJob(db(), "objects");
  ASSERT_EQ(job.state, JobState::kSucceeded) << job.message;
  EXPECT_EQ(job.metrics.at("entities"), 3.0);
  STRATA_ASSERT_OK_AND_ASSIGN(const FoundThings things, ThingsOf(db()));
  ASSERT_THAT(things.entities, SizeIs(3));
  EXPECT_EQ(things.info.job, job.id);
  EXPECT_EQ(things.info.scans, 2U);
  EXPECT_EQ(things.info.entities, 3U);
  EXPECT_THAT(things.info.reaches, SizeIs(2));
  EXPECT_EQ(things.entities[0].class_id, kFloorClass);
  const Entity& crate = things.entities[1];  // that both scans saw
  EXPECT_EQ(crate.id, 2U);
  EXPECT_EQ(crate.class_id, kCrateClass);
  ASSERT_THAT(crate.scans, SizeIs(2));
  EXPECT_EQ(crate.scans[1].scan, (ScanId{"run", 2}));
  EXPECT_EQ(crate.scans[0].points + crate.scans[1].points, crate.points);
  EXPECT_LT((crate.box.centre - Eigen::Vector3d(-2.0, -1.5, 0.6)).norm(), 0.05);
  EXPECT_LT((crate.box.size - Eigen::Vector3d(1.0, 0.0, 1.0)).norm(), 0.1);
  EXPECT_NEAR(crate.box.yaw_rad, 1.5708, 0.01);

  Reopen();
  STRATA_ASSERT_OK_AND_ASSIGN(const FoundThings kept, ThingsOf(db()));
  EXPECT_EQ(kept.entities[1].box, crate.box);
  EXPECT_EQ(kept.entities[1].scans, crate.scans);
  const JobInfo again = EndOfJob(db(), "objects", {{"class", "crate"}});
  ASSERT_EQ(again.state, JobState::kSucceeded) << again.message;
  STRATA_ASSERT_OK_AND_ASSIGN(const FoundThings crates, ThingsOf(db()));
  ASSERT_THAT(crates.entities, SizeIs(2));
  EXPECT_EQ(crates.info.job, again.id);
  EXPECT_EQ(crates.entities[0].box, crate.box);
}

TEST_P(DatabaseSuite, ThingsOfAClassOrARegionAlone) {
  PutCrates(db(), 1, {{-2.0F, -2.0F}, {2.0F, 1.0F}});
  ASSERT_EQ(EndOfJob(db(), "objects").state, JobState::kSucceeded);
  STRATA_ASSERT_OK_AND_ASSIGN(const FoundThings crates, ThingsOf(db(), {.class_id = kCrateClass}));
  EXPECT_THAT(crates.entities, SizeIs(2));
  const Eigen::AlignedBox3d east(Eigen::Vector3d(1, 0, 0.2), Eigen::Vector3d(3, 3, 3));
  STRATA_ASSERT_OK_AND_ASSIGN(const FoundThings one, ThingsOf(db(), {.region = east}));
  ASSERT_THAT(one.entities, SizeIs(1));
  EXPECT_GT(one.entities[0].box.centre.x(), 0.0);

  const JobInfo nothing = EndOfJob(db(), "objects", {{"region", "1000,1000,1010,1010"}});
  ASSERT_EQ(nothing.state, JobState::kSucceeded) << nothing.message;
  EXPECT_THAT(nothing.message, HasSubstr("no point in the region has a class"));
  STRATA_ASSERT_OK_AND_ASSIGN(const FoundThings none, ThingsOf(db()));
  EXPECT_THAT(none.entities, SizeIs(0));
  const JobInfo sparse = EndOfJob(db(), "objects", {{"min_points", "1000000"}});
  EXPECT_THAT(sparse.message, HasSubstr("smaller min_points"));
}

TEST_P(DatabaseSuite, WithoutLabelsThereAreNoThingsAndTheJobSaysWhatToDo) {
  const JobInfo empty = EndOfJob(db(), "objects");
  EXPECT_EQ(empty.state, JobState::kSucceeded) << empty.message;
  PutFloor(db(), {"run", 1});
  const JobInfo job = EndOfJob(db(), "objects");
  EXPECT_EQ(job.state, JobState::kFailed);
  EXPECT_THAT(job.message, HasSubstr("no point of 1 scans has a class"));
  EXPECT_THAT(job.message, HasSubstr("classify"));
  EXPECT_THAT(db().jobs().Start({}, kMap, "objects", {{"class", "zeppelin"}}),
              StatusIs(Code::kNotFound, HasSubstr("zeppelin")));
  EXPECT_THAT(db().jobs().Start({}, kMap, "objects", {{"distance_m", "9"}}),
              StatusIs(Code::kInvalidArgument, HasSubstr("distance_m")));
}

TEST_P(DatabaseSuite, WhatOnlyADeletedScanSawIsForgotten) {
  PutCrates(db(), 1, {{-2.0F, -2.0F}, {2.0F, 1.0F}});
  PutCrates(db(), 2, {{-2.0F, -2.0F}});
  ASSERT_EQ(EndOfJob(db(), "objects", {{"class", "2"}}).state, JobState::kSucceeded);
  STRATA_ASSERT_OK_AND_ASSIGN(const FoundThings before, ThingsOf(db()));
  ASSERT_THAT(before.entities, SizeIs(2));
  STRATA_ASSERT_OK(db().scans().Delete({}, kMap, {"run", 1}));
  STRATA_ASSERT_OK_AND_ASSIGN(const FoundThings after, ThingsOf(db()));
  ASSERT_THAT(after.entities, SizeIs(1));
  EXPECT_EQ(after.entities[0].id, before.entities[0].id);
  ASSERT_THAT(after.entities[0].scans, SizeIs(1));
  EXPECT_EQ(after.entities[0].scans[0].scan, (ScanId{"run", 2}));
  EXPECT_EQ(after.entities[0].points, after.entities[0].scans[0].points);
}

TEST_P(DatabaseSuite, ThingsEndWithTheirSinkAndARebuildForgetsThem) {
  PutCrates(db(), 1, {{1.0F, 1.0F}});
  ASSERT_EQ(EndOfJob(db(), "objects").state, JobState::kSucceeded);
  EXPECT_THAT(db().objects().ListEntities(
                  {}, kMap, {}, [](const Entity&) { return absl::CancelledError("enough"); }),
              StatusIs(Code::kCancelled, HasSubstr("enough")));
  EXPECT_THAT(
      db().objects().ListEntities({}, "none", {}, [](const Entity&) { return absl::OkStatus(); }),
      StatusIs(Code::kNotFound, _));
  const auto rebuild = db().jobs().Start({}, kMap, "rebuild", {});
  STRATA_ASSERT_OK(rebuild);
  STRATA_ASSERT_OK(
      db().jobs().Watch({}, kMap, rebuild->id, [](const JobInfo&) { return absl::OkStatus(); }));
  EXPECT_THAT(ThingsOf(db()), StatusIs(Code::kNotFound, HasSubstr("objects find")));
}

}  // namespace
}  // namespace strata::testing
