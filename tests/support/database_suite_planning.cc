// Conformance: planning.
#include <cmath>
#include <string>

#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/database_suite.h"
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
