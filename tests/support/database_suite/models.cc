// Conformance: models of maps.
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/cloud/point_cloud.h"
#include "core/geometry/primitives.h"
#include "tests/support/database_suite/database_suite.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::_;
using ::testing::HasSubstr;
using ::testing::SizeIs;
using Code = absl::StatusCode;

struct FoundModel {
  PlaneModelInfo info;
  std::vector<ModelPlane> planes;
};

absl::StatusOr<FoundModel> ModelOf(api::Database& db) {
  FoundModel model;
  STRATA_ASSIGN_OR_RETURN(model.info,
                          db.models().GetPlaneModel({}, kMap, [&](const ModelPlane& plane) {
                            model.planes.push_back(plane);
                            return absl::OkStatus();
                          }));
  return model;
}

// A floor of 8 x 8 m and a wall at x = 3 with a hole of 1 x 1 m, through which nothing was seen.
PointCloud Room() {
  PointCloud cloud = LevelFloor();
  for (float y = -3.0F; y <= 3.0F; y += 0.05F) {
    for (float z = 0.05F; z <= 3.0F; z += 0.05F) {
      if (std::abs(y) < 0.5F && z > 1.0F && z < 2.0F) continue;
      cloud.points.emplace_back(3.0F, y, z);
    }
  }
  return cloud;
}

TEST_P(DatabaseSuite, PlanesAreFoundAndKeptUntilTheNext) {
  EXPECT_THAT(ModelOf(db()), StatusIs(Code::kNotFound, HasSubstr("planes")));
  const PointCloud room = Room();
  STRATA_ASSERT_OK(UploadScan(db(), kMap, FloorHeader({"run", 1}, room), room));
  AwaitIntegration(db(), kMap);
  const JobInfo job = EndOfJob(db(), "planes");
  ASSERT_EQ(job.state, JobState::kSucceeded) << job.message;
  EXPECT_EQ(job.metrics.at("planes"), 2.0);
  STRATA_ASSERT_OK_AND_ASSIGN(const FoundModel model, ModelOf(db()));
  ASSERT_THAT(model.planes, SizeIs(2));
  EXPECT_EQ(model.info.job, job.id);
  EXPECT_EQ(model.info.planes, 2U);
  EXPECT_EQ(model.info.scans, 1U);
  const ModelPlane& floor = model.planes[0];
  EXPECT_EQ(floor.kind, PlaneKind::kLevel);
  EXPECT_NEAR(floor.plane.distance, 0.0, 0.005);
  ASSERT_THAT(floor.polygons, SizeIs(1));
  EXPECT_NEAR(floor.polygons[0].area_m2, 64.0, 2.0);
  const ModelPlane& wall = model.planes[1];
  EXPECT_EQ(wall.kind, PlaneKind::kWall);
  EXPECT_LT((wall.plane.normal - Eigen::Vector3d(-1, 0, 0)).norm(), 0.005);
  EXPECT_NEAR(wall.plane.distance, -3.0, 0.005);
  ASSERT_THAT(wall.polygons, SizeIs(1));
  EXPECT_NEAR(wall.polygons[0].area_m2, 18.0 - 1.0, 1.0);
  ASSERT_THAT(wall.polygons[0].holes, SizeIs(1));
  EXPECT_FALSE(wall.polygons[0].holes[0].seen_open);

  Reopen();
  STRATA_ASSERT_OK_AND_ASSIGN(const FoundModel kept, ModelOf(db()));
  EXPECT_EQ(kept.planes[1].polygons, wall.polygons);
  const JobInfo again = EndOfJob(db(), "planes", {{"min_area_m2", "30"}});
  ASSERT_EQ(again.state, JobState::kSucceeded) << again.message;
  STRATA_ASSERT_OK_AND_ASSIGN(const FoundModel fewer, ModelOf(db()));
  ASSERT_THAT(fewer.planes, SizeIs(1));
  EXPECT_EQ(fewer.info.job, again.id);
  // Its outline may differ: points at the foot of a wall that is none go to the floor.
  ASSERT_THAT(fewer.planes[0].polygons, SizeIs(1));
  EXPECT_NEAR(fewer.planes[0].polygons[0].area_m2, floor.polygons[0].area_m2, 0.1);
}

TEST_P(DatabaseSuite, AnEmptyMapHasNoPlanes) {
  const JobInfo job = EndOfJob(db(), "planes");
  ASSERT_EQ(job.state, JobState::kSucceeded) << job.message;
  STRATA_ASSERT_OK_AND_ASSIGN(const FoundModel model, ModelOf(db()));
  EXPECT_THAT(model.planes, SizeIs(0));
  EXPECT_EQ(model.info.scans, 0U);
}

TEST_P(DatabaseSuite, PlanesOfARegionOnly) {
  const PointCloud room = Room();
  STRATA_ASSERT_OK(UploadScan(db(), kMap, FloorHeader({"run", 1}, room), room));
  AwaitIntegration(db(), kMap);
  const JobInfo job = EndOfJob(db(), "planes", {{"region", "-4,-4,0,4"}});
  ASSERT_EQ(job.state, JobState::kSucceeded) << job.message;
  STRATA_ASSERT_OK_AND_ASSIGN(const FoundModel half, ModelOf(db()));
  ASSERT_THAT(half.planes, SizeIs(1));
  EXPECT_EQ(half.planes[0].kind, PlaneKind::kLevel);
  EXPECT_NEAR(half.planes[0].area_m2, 32.0, 1.5);
  for (const Eigen::Vector3d& p : half.planes[0].polygons[0].outer) EXPECT_LE(p.x(), 0.01);
  ASSERT_EQ(EndOfJob(db(), "planes", {{"region", "-4,-4,4,4,0.5,9"}}).state, JobState::kSucceeded);
  STRATA_ASSERT_OK_AND_ASSIGN(const FoundModel wall, ModelOf(db()));
  ASSERT_THAT(wall.planes, SizeIs(1));
  EXPECT_EQ(wall.planes[0].kind, PlaneKind::kWall);
  const JobInfo nothing = EndOfJob(db(), "planes", {{"region", "1000,1000,1010,1010"}});
  ASSERT_EQ(nothing.state, JobState::kSucceeded) << nothing.message;
  EXPECT_THAT(nothing.message, HasSubstr("no point lies in the region"));
  STRATA_ASSERT_OK_AND_ASSIGN(const FoundModel none, ModelOf(db()));
  EXPECT_THAT(none.planes, SizeIs(0));
  EXPECT_EQ(none.info.scans, 0U);
  EXPECT_THAT(db().jobs().Start({}, kMap, "planes", {{"region", "4,0,0,1"}}),
              StatusIs(Code::kInvalidArgument, HasSubstr("X0 < X1")));
}

// Surfaces are left of it, so floors are still told.
TEST_P(DatabaseSuite, WhatLooksAtPointsSaysWhereTheyWereDropped) {
  MapParameters parameters;
  parameters.keep_points = false;
  STRATA_ASSERT_OK(db().maps().Create({}, "bare", parameters));
  const PointCloud floor = LevelFloor();
  STRATA_ASSERT_OK(UploadScan(db(), "bare", FloorHeader({"run", 1}, floor), floor));
  AwaitIntegration(db(), "bare");
  for (const char* kind : {"planes", "objects", "complete"}) {
    SCOPED_TRACE(kind);
    EXPECT_THAT(db().jobs().Start({}, "bare", kind, {}),
                StatusIs(Code::kFailedPrecondition, HasSubstr("drops points")));
  }
  const auto sink = [](const ModelPlane&) { return absl::OkStatus(); };
  EXPECT_THAT(db().models().GetPlaneModel({}, "bare", sink),
              StatusIs(Code::kNotFound, HasSubstr("no plane model")));
  STRATA_ASSERT_OK_AND_ASSIGN(const FloorPlan plan, db().planning().ListFloors({}, "bare", {}));
  EXPECT_THAT(plan.floors, SizeIs(1));
}

TEST_P(DatabaseSuite, PlanesByColourTakeScansWithColours) {
  const PointCloud grey = Room();
  STRATA_ASSERT_OK(UploadScan(db(), kMap, FloorHeader({"run", 1}, grey), grey));
  AwaitIntegration(db(), kMap);
  const JobInfo refused = EndOfJob(db(), "planes", {{"colour", "1"}});
  EXPECT_EQ(refused.state, JobState::kFailed);
  EXPECT_THAT(refused.message, HasSubstr("none of 1 scans has colours"));
  EXPECT_THAT(refused.message, HasSubstr("colour=1"));

  PointCloud carpet = LevelFloor();
  for (const Eigen::Vector3f& p : carpet.points) {
    carpet.colour.push_back(p.x() < 1.0F ? Colour{165, 45, 40} : Colour{150, 150, 145});
  }
  STRATA_ASSERT_OK(UploadScan(db(), kMap, FloorHeader({"run", 2}, carpet), carpet));
  AwaitIntegration(db(), kMap);
  const JobInfo job = EndOfJob(db(), "planes", {{"colour", "1"}});
  ASSERT_EQ(job.state, JobState::kSucceeded) << job.message;
  EXPECT_EQ(job.metrics.at("scans_without_colours"), 1.0);
  EXPECT_THAT(job.message, HasSubstr("left out 1 scans without colours"));
  STRATA_ASSERT_OK_AND_ASSIGN(const FoundModel model, ModelOf(db()));
  ASSERT_THAT(model.planes, SizeIs(2));
  EXPECT_EQ(model.info.scans, 1U);
  EXPECT_EQ(model.planes[0].colour, (Colour{165, 45, 40}));
  EXPECT_EQ(model.planes[1].colour, (Colour{150, 150, 145}));
  EXPECT_NEAR(model.planes[0].area_m2, 40.0, 1.5);
  EXPECT_NEAR(model.planes[1].area_m2, 24.0, 1.5);

  ASSERT_EQ(EndOfJob(db(), "planes").state, JobState::kSucceeded);
  STRATA_ASSERT_OK_AND_ASSIGN(const FoundModel plain, ModelOf(db()));
  ASSERT_THAT(plain.planes, SizeIs(2));  // the floor, and the wall of the grey scan
  EXPECT_EQ(plain.planes[0].colour, std::nullopt);
}

TEST_P(DatabaseSuite, PlanesRefuseWhatIsOutOfBoundsAndEndWithTheirSink) {
  EXPECT_THAT(db().jobs().Start({}, kMap, "planes", {{"rho_m", "nan"}}),
              StatusIs(Code::kInvalidArgument, HasSubstr("rho_m")));
  PutFloor(db(), {"run", 1});
  ASSERT_EQ(EndOfJob(db(), "planes").state, JobState::kSucceeded);
  EXPECT_THAT(db().models().GetPlaneModel(
                  {}, kMap, [](const ModelPlane&) { return absl::CancelledError("enough"); }),
              StatusIs(Code::kCancelled, HasSubstr("enough")));
  EXPECT_THAT(
      db().models().GetPlaneModel({}, "none", [](const ModelPlane&) { return absl::OkStatus(); }),
      StatusIs(Code::kNotFound, _));
}

}  // namespace
}  // namespace strata::testing
