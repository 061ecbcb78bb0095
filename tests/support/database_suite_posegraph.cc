// Conformance: the pose graph.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/database_suite.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::_;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using Code = absl::StatusCode;

TEST_P(DatabaseSuite, PosesAreSetByHand) {
  PutFloor(db(), {"run", 1});
  const Pose moved = MakePose(Eigen::Quaterniond::Identity(), {60.0, 0.0, 1.0});
  STRATA_ASSERT_OK(db().posegraph().SetPose({}, kMap, {"run", 1}, moved));
  STRATA_ASSERT_OK_AND_ASSIGN(const api::PoseGraphState graph, db().posegraph().Get({}, kMap));
  ASSERT_THAT(graph.nodes, SizeIs(1));
  EXPECT_TRUE(graph.nodes[0].T_map_scan.isApprox(moved, 1e-12));
  EXPECT_TRUE(graph.nodes[0].T_map_scan_uploaded.isApprox(Pose::Identity(), 1e-12));
  STRATA_ASSERT_OK_AND_ASSIGN(
      const auto columns,
      db().planning().SampleSurfaces({}, kMap, {Eigen::Vector2d(0.0, 0.0), {60.05, 0.05}}));
  EXPECT_THAT(columns[0].surfaces, IsEmpty());
  ASSERT_THAT(columns[1].surfaces, SizeIs(1));
  EXPECT_NEAR(columns[1].surfaces[0].z_m, 1.0, 1e-3);
  EXPECT_THAT(db().posegraph().SetPose({}, kMap, {"run", 2}, moved), StatusIs(Code::kNotFound, _));
  EXPECT_THAT(db().posegraph().SetPose({}, kMap, {"run", 1}, NanPose()),
              StatusIs(Code::kInvalidArgument, _));
}

}  // namespace
}  // namespace strata::testing
