// Conformance: the pose graph.
#include <cstdint>
#include <limits>
#include <optional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/database_suite/database_suite.h"
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

// Of run/2 against run/1, three metres apart.
Constraint TapeMeasure() {
  Constraint constraint;
  constraint.i = {"run", 1};
  constraint.j = {"run", 2};
  constraint.T_i_j = MakePose(Eigen::Quaterniond::Identity(), {3.0, 0.0, 0.0});
  constraint.information = Matrix6d::Identity() * 400.0;
  constraint.note = "tape measure";
  return constraint;
}

TEST_P(DatabaseSuite, ConstraintsAreAddedSwitchedAndRemoved) {
  PutFloor(db(), {"run", 1});
  PutFloor(db(), {"run", 2}, 3.0);
  Constraint said = TapeMeasure();
  said.id = 4711;
  said.origin = ConstraintOrigin::kIngest;
  said.may_be_false = true;
  STRATA_ASSERT_OK_AND_ASSIGN(const Constraint added,
                              db().posegraph().AddConstraint({}, kMap, said));
  EXPECT_EQ(added.origin, ConstraintOrigin::kPerson);
  Constraint prior = TapeMeasure();
  prior.i = {};
  prior.information.topLeftCorner<3, 3>().setZero();  // position only
  prior.enabled = false;
  prior.may_be_false = true;
  STRATA_ASSERT_OK_AND_ASSIGN(const Constraint second,
                              db().posegraph().AddConstraint({}, kMap, prior));
  EXPECT_NE(second.id, added.id);

  const auto find = [this](std::uint64_t id) -> std::optional<Constraint> {
    const auto graph = db().posegraph().Get({}, kMap);
    STRATA_EXPECT_OK(graph);
    if (!graph.ok()) return std::nullopt;
    for (const Constraint& constraint : graph->constraints) {
      if (constraint.id == id) return constraint;
    }
    return std::nullopt;
  };
  std::optional<Constraint> listed = find(added.id);
  ASSERT_TRUE(listed.has_value());
  EXPECT_EQ(listed->i, said.i);
  EXPECT_EQ(listed->j, said.j);
  EXPECT_TRUE(listed->T_i_j.isApprox(said.T_i_j, 1e-12));
  EXPECT_EQ(listed->information, said.information);
  EXPECT_EQ(listed->note, "tape measure");
  EXPECT_TRUE(listed->enabled);
  EXPECT_TRUE(listed->may_be_false);
  EXPECT_EQ(listed->origin, ConstraintOrigin::kPerson);
  listed = find(second.id);
  ASSERT_TRUE(listed.has_value());
  EXPECT_TRUE(listed->is_prior());
  EXPECT_FALSE(listed->enabled);
  EXPECT_TRUE(listed->may_be_false);

  for (const bool enabled : {false, false, true}) {
    STRATA_EXPECT_OK(db().posegraph().EnableConstraint({}, kMap, added.id, enabled));
    EXPECT_EQ(find(added.id)->enabled, enabled);
  }
  STRATA_EXPECT_OK(db().posegraph().RemoveConstraint({}, kMap, added.id));
  EXPECT_EQ(find(added.id), std::nullopt);
  EXPECT_TRUE(find(second.id).has_value());
  EXPECT_THAT(db().posegraph().RemoveConstraint({}, kMap, added.id), StatusIs(Code::kNotFound, _));
  EXPECT_THAT(db().posegraph().EnableConstraint({}, kMap, added.id, true),
              StatusIs(Code::kNotFound, _));
}

TEST_P(DatabaseSuite, WhatIsNoConstraintIsRefused) {
  PutFloor(db(), {"run", 1});
  const auto add = [this](const Constraint& constraint) {
    return db().posegraph().AddConstraint({}, kMap, constraint);
  };
  EXPECT_THAT(add(TapeMeasure()), StatusIs(Code::kNotFound, ::testing::HasSubstr("run/2")));
  Constraint bad = TapeMeasure();
  bad.j = bad.i;
  EXPECT_THAT(add(bad), StatusIs(Code::kInvalidArgument, _));
  bad = TapeMeasure();
  bad.T_i_j = NanPose();
  EXPECT_THAT(add(bad), StatusIs(Code::kInvalidArgument, _));
  bad = TapeMeasure();
  bad.information(2, 2) = -1.0;
  EXPECT_THAT(add(bad), StatusIs(Code::kInvalidArgument, _));
}

TEST_P(DatabaseSuite, APoseIsLookedUp) {
  PutFloor(db(), {"run", 1}, 5.0);
  STRATA_ASSERT_OK_AND_ASSIGN(const api::PoseLookup lookup,
                              db().posegraph().LookupPose({}, kMap, {"run", 1}));
  EXPECT_TRUE(lookup.known) << lookup.message;
  EXPECT_NEAR(lookup.T_map_scan.translation().x(), 5.0, 1e-12);
  STRATA_ASSERT_OK_AND_ASSIGN(const MapStats stats, db().maps().Stats({}, kMap));
  EXPECT_EQ(lookup.epoch, stats.epoch);
  EXPECT_THAT(db().posegraph().LookupPose({}, kMap, {"run", 2}), StatusIs(Code::kNotFound, _));
}

// A floor with a wall along x and a shorter one along y.
PointCloud Corner() {
  constexpr double kSpacingM = 0.05;
  PointCloud cloud = LevelFloor();
  for (int i = 0; i < 140; ++i) {
    for (int k = 1; k < 40; ++k) {
      const auto along = static_cast<float>(i * kSpacingM - 3.5);
      const auto z = static_cast<float>(k * kSpacingM);
      cloud.points.emplace_back(along, 3.0F, z);
      if (along > 0.0F) cloud.points.emplace_back(2.5F, along - 0.5F, z);
    }
  }
  cloud.sensor_origin = Eigen::Vector3f(0.0F, 0.0F, 1.0F);
  return cloud;
}

TEST_P(DatabaseSuite, AScanIsFoundWhereItWasTaken) {
  LocalizeQuery query;
  query.cloud = Corner();
  STRATA_ASSERT_OK(UploadScan(db(), kMap, FloorHeader({"run", 1}, query.cloud, 6.0), query.cloud));
  AwaitIntegration(db(), kMap);
  query.T_map_scan_guess = MakePose(Eigen::Quaterniond::Identity(), {6.3, -0.2, 0.1});
  query.guess_radius_m = 5.0;
  STRATA_ASSERT_OK_AND_ASSIGN(const LocalizeResult result,
                              db().posegraph().Localize({}, kMap, query));
  ASSERT_TRUE(result.found) << result.message;
  EXPECT_EQ(result.best.place, (ScanId{"run", 1}));
  EXPECT_LT((result.best.T_map_scan.translation() - Eigen::Vector3d(6.0, 0.0, 0.0)).norm(), 0.1);
  EXPECT_LT(RotationAngleRad(result.best.T_map_scan), 0.05);
  EXPECT_GT(result.best.confidence, 0.0);
  EXPECT_LE(result.best.confidence, 1.0);
  EXPECT_GT(result.covariance.diagonal().minCoeff(), 0.0);
  // Nothing is within reach of a guess elsewhere.
  query.T_map_scan_guess = MakePose(Eigen::Quaterniond::Identity(), {500.0, 0.0, 0.0});
  STRATA_ASSERT_OK_AND_ASSIGN(const LocalizeResult nowhere,
                              db().posegraph().Localize({}, kMap, query));
  EXPECT_FALSE(nowhere.found);
  EXPECT_NE(nowhere.message, "");
  // Searching leaves no trace.
  EXPECT_THAT(Listed(db(), {}), SizeIs(1));
}

TEST_P(DatabaseSuite, ARobotIsFollowed) {
  TrackStep step;
  step.cloud = Corner();
  STRATA_ASSERT_OK(UploadScan(db(), kMap, FloorHeader({"run", 1}, step.cloud, 6.0), step.cloud));
  AwaitIntegration(db(), kMap);
  TrackStart start;
  start.T_map_scan_guess = MakePose(Eigen::Quaterniond::Identity(), {6.3, -0.2, 0.1});
  start.guess_radius_m = 5.0;
  STRATA_ASSERT_OK_AND_ASSIGN(const auto tracking, db().posegraph().Track({}, kMap, start));
  STRATA_ASSERT_OK_AND_ASSIGN(const TrackedPose found, tracking->Step(step));
  EXPECT_EQ(found.state, TrackState::kTracked) << found.message;
  EXPECT_TRUE(found.found);
  EXPECT_EQ(found.epoch, 1U);
  EXPECT_GT(found.score, 0.5);
  EXPECT_LT((found.T_map_scan.translation() - Eigen::Vector3d(6.0, 0.0, 0.0)).norm(), 0.1);
  EXPECT_GT(found.covariance.diagonal().minCoeff(), 0.0);
  // Odometry goes on alone; a step that is none counts for nothing.
  TrackStep motion;
  motion.T_odom_scan = NanPose();
  EXPECT_THAT(tracking->Step(motion), StatusIs(Code::kInvalidArgument, _));
  motion.T_odom_scan = MakePose(Eigen::Quaterniond::Identity(), {0.5, 0.0, 0.0});
  STRATA_ASSERT_OK_AND_ASSIGN(const TrackedPose moved, tracking->Step(motion));
  EXPECT_EQ(moved.state, TrackState::kPredicted);
  EXPECT_LT((moved.T_map_scan.translation() - Eigen::Vector3d(6.5, 0.0, 0.0)).norm(), 0.1);
  EXPECT_GT(moved.covariance(3, 3), found.covariance(3, 3));
  start.guess_radius_m = -1.0;
  EXPECT_THAT(db().posegraph().Track({}, kMap, start), StatusIs(Code::kInvalidArgument, _));
  // Following leaves no trace.
  EXPECT_THAT(Listed(db(), {}), SizeIs(1));
}

TEST_P(DatabaseSuite, BadSearchesAreRefused) {
  LocalizeQuery query;
  EXPECT_THAT(db().posegraph().Localize({}, kMap, query), StatusIs(Code::kInvalidArgument, _));
  query.cloud = LevelFloor(1.0);
  query.T_map_scan_guess = Pose::Identity();
  query.guess_radius_m = 0.0;
  EXPECT_THAT(db().posegraph().Localize({}, kMap, query), StatusIs(Code::kInvalidArgument, _));
  query.guess_radius_m = 5.0;
  query.T_map_scan_guess = NanPose();
  EXPECT_THAT(db().posegraph().Localize({}, kMap, query), StatusIs(Code::kInvalidArgument, _));
  query.T_map_scan_guess = std::nullopt;
  query.cloud.points[7].y() = std::numeric_limits<float>::infinity();
  EXPECT_THAT(db().posegraph().Localize({}, kMap, query), StatusIs(Code::kInvalidArgument, _));
}

}  // namespace
}  // namespace strata::testing
