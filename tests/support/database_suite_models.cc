// Conformance: models of maps.
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/geometry/primitives.h"
#include "tests/support/database_suite.h"
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

JobInfo RunPlanes(api::Database& db, const JobParameters& parameters = {}) {
  JobInfo last;
  const auto job = db.jobs().Start({}, kMap, "planes", parameters);
  STRATA_EXPECT_OK(job);
  if (!job.ok()) return last;
  STRATA_EXPECT_OK(db.jobs().Watch({}, kMap, job->id, [&last](const JobInfo& now) {
    last = now;
    return absl::OkStatus();
  }));
  return last;
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
  const JobInfo job = RunPlanes(db());
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
  const JobInfo again = RunPlanes(db(), {{"min_area_m2", "30"}});
  ASSERT_EQ(again.state, JobState::kSucceeded) << again.message;
  STRATA_ASSERT_OK_AND_ASSIGN(const FoundModel fewer, ModelOf(db()));
  ASSERT_THAT(fewer.planes, SizeIs(1));
  EXPECT_EQ(fewer.info.job, again.id);
  EXPECT_EQ(fewer.planes[0].polygons, floor.polygons);
}

TEST_P(DatabaseSuite, AnEmptyMapHasNoPlanes) {
  const JobInfo job = RunPlanes(db());
  ASSERT_EQ(job.state, JobState::kSucceeded) << job.message;
  STRATA_ASSERT_OK_AND_ASSIGN(const FoundModel model, ModelOf(db()));
  EXPECT_THAT(model.planes, SizeIs(0));
  EXPECT_EQ(model.info.scans, 0U);
}

TEST_P(DatabaseSuite, PlanesRefuseWhatIsOutOfBoundsAndEndWithTheirSink) {
  EXPECT_THAT(db().jobs().Start({}, kMap, "planes", {{"rho_m", "nan"}}),
              StatusIs(Code::kInvalidArgument, HasSubstr("rho_m")));
  PutFloor(db(), {"run", 1});
  ASSERT_EQ(RunPlanes(db()).state, JobState::kSucceeded);
  EXPECT_THAT(db().models().GetPlaneModel(
                  {}, kMap, [](const ModelPlane&) { return absl::CancelledError("enough"); }),
              StatusIs(Code::kCancelled, HasSubstr("enough")));
  EXPECT_THAT(
      db().models().GetPlaneModel({}, "none", [](const ModelPlane&) { return absl::OkStatus(); }),
      StatusIs(Code::kNotFound, _));
}

}  // namespace
}  // namespace strata::testing
