#include <cstddef>
#include <memory>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/client/sdk/connected_mock.h"

namespace strata::sdk {
namespace {

using ::strata::testing::IsOk;
using ::strata::testing::StatusIs;
using ::testing::_;
using ::testing::HasSubstr;
using ::testing::Return;
using Code = absl::StatusCode;

class PoseGraphTest : public ConnectedMock {
 protected:
  static Constraint SomeConstraint() {
    Constraint constraint;
    constraint.i = {"a", 1};
    constraint.j = {"b", 2};
    constraint.T_i_j = MakePose(Eigen::Quaterniond::Identity(), {1.0, 2.0, 3.0});
    return constraint;
  }
  // More than a message holds.
  static LocalizeQuery LargeQuery() {
    LocalizeQuery query;
    for (int i = 0; i < 90'000; ++i) {
      query.cloud.points.emplace_back(static_cast<float>(i % 300), 1.0F, 0.5F);
    }
    return query;
  }
};

TEST_F(PoseGraphTest, WhatMayHaveHappenedIsNotRepeatedAndTheRestIs) {
  const absl::Status away = absl::UnavailableError("away");
  EXPECT_CALL(behind_.posegraph(), AddConstraint(_, _, _)).WillOnce(Return(away));
  EXPECT_CALL(behind_.posegraph(), RemoveConstraint(_, _, _)).WillOnce(Return(away));
  EXPECT_CALL(behind_.posegraph(), EnableConstraint(_, _, 4, true))
      .WillOnce(Return(away))
      .WillOnce(Return(absl::OkStatus()));
  EXPECT_CALL(behind_.posegraph(), LookupPose(_, _, _))
      .WillOnce(Return(away))
      .WillOnce(Return(api::PoseLookup{true, "", Pose::Identity(), 7}));
  EXPECT_THAT(client_->posegraph().AddConstraint({}, "m", SomeConstraint()),
              StatusIs(Code::kUnavailable, "away"));
  EXPECT_THAT(client_->posegraph().RemoveConstraint({}, "m", 4),
              StatusIs(Code::kUnavailable, "away"));
  EXPECT_THAT(client_->posegraph().EnableConstraint({}, "m", 4, true), IsOk());
  STRATA_ASSERT_OK_AND_ASSIGN(const api::PoseLookup lookup,
                              client_->posegraph().LookupPose({}, "m", {"a", 1}));
  EXPECT_TRUE(lookup.known);
  EXPECT_EQ(lookup.epoch, 7U);
}

TEST_F(PoseGraphTest, AConstraintArrivesAsItIs) {
  Constraint seen;
  ON_CALL(behind_.posegraph(), AddConstraint(_, _, _))
      .WillByDefault([&seen](auto&, auto, const Constraint& constraint) {
        seen = constraint;
        return absl::StatusOr<Constraint>(constraint);
      });
  Constraint constraint = SomeConstraint();
  constraint.enabled = false;
  constraint.note = "tape measure";
  constraint.information.diagonal() << 1, 2, 3, 4, 5, 6;
  STRATA_ASSERT_OK(client_->posegraph().AddConstraint({}, "m", constraint));
  EXPECT_EQ(seen.i, constraint.i);
  EXPECT_EQ(seen.j, constraint.j);
  EXPECT_TRUE(seen.T_i_j.isApprox(constraint.T_i_j, 1e-12));
  EXPECT_EQ(seen.information, constraint.information);
  EXPECT_FALSE(seen.enabled);
  EXPECT_EQ(seen.note, "tape measure");
  constraint.T_i_j.linear() *= 2.0;  // which a quaternion would hide
  EXPECT_THAT(client_->posegraph().AddConstraint({}, "m", constraint),
              StatusIs(Code::kInvalidArgument, _));
}

TEST_F(PoseGraphTest, TheGraphComesWithItsPlanes) {
  api::PoseGraphState state;
  state.epoch = 3;
  state.planes.resize(2);
  state.planes[0].id = 9;
  state.planes[0].plane = {Eigen::Vector3d(0.6, 0.0, 0.8), 2.5};
  state.planes[0].kind = PlaneKind::kSloped;
  state.planes[1].supports.push_back({{"a", 1}, 4.0, 0.01});
  ON_CALL(behind_.posegraph(), Get(_, _)).WillByDefault(Return(state));
  STRATA_ASSERT_OK_AND_ASSIGN(const api::PoseGraphState got, client_->posegraph().Get({}, "m"));
  ASSERT_EQ(got.planes.size(), 2U);
  EXPECT_EQ(got.planes[0].id, 9U);
  EXPECT_NEAR(got.planes[0].plane.distance, 2.5, 1e-12);
  EXPECT_EQ(got.planes[0].kind, PlaneKind::kSloped);
  ASSERT_EQ(got.planes[1].supports.size(), 1U);
  EXPECT_EQ(got.planes[1].supports[0].weight, 4.0);
}

TEST_F(PoseGraphTest, AScanIsSentInPiecesAndAgainWhenTheServerWasAway) {
  const LocalizeQuery query = LargeQuery();
  LocalizeResult found;
  found.found = true;
  found.best.place = {"a", 5};
  EXPECT_CALL(behind_.posegraph(), Localize(_, _, _))
      .WillOnce(Return(absl::UnavailableError("starting")))
      .WillOnce([&](auto&, auto, const LocalizeQuery& seen) {
        EXPECT_EQ(seen.cloud.points, query.cloud.points);
        return absl::StatusOr<LocalizeResult>(found);
      });
  STRATA_ASSERT_OK_AND_ASSIGN(const LocalizeResult result,
                              client_->posegraph().Localize({}, "m", query));
  EXPECT_TRUE(result.found);
  EXPECT_EQ(result.best.place.sequence, 5U);
}

TEST_F(PoseGraphTest, AScanThatIsRefusedIsNotSentAgain) {
  EXPECT_CALL(behind_.posegraph(), Localize(_, _, _)).Times(0);
  LocalizeQuery query = LargeQuery();
  query.guess_radius_m = 0.0;
  EXPECT_THAT(client_->posegraph().Localize({}, "m", query),
              StatusIs(Code::kInvalidArgument, HasSubstr("guess_radius_m")));
  query = LargeQuery();
  while (query.cloud.size() <= 2'000'000) {
    query.cloud.points.insert(query.cloud.points.end(), 500'000, query.cloud.points[0]);
  }
  EXPECT_THAT(client_->posegraph().Localize({}, "m", query),
              StatusIs(Code::kResourceExhausted, HasSubstr("at most 2000000")));
}

// Says of a step that the robot is where odometry has it.
class EchoingTracking final : public api::Tracking {
 public:
  absl::StatusOr<TrackedPose> Step(const TrackStep& step) override {
    points.push_back(step.cloud.size());
    if (points.size() == 3) return absl::UnavailableError("away");
    TrackedPose pose;
    pose.state = TrackState::kPredicted;
    pose.known = true;
    pose.T_map_scan = step.T_odom_scan;
    pose.covariance = Matrix6d::Identity();
    return pose;
  }
  static inline std::vector<std::size_t> points;
};

TEST_F(PoseGraphTest, ARobotIsFollowedOnOneStreamThatIsNotRepeated) {
  EchoingTracking::points.clear();
  TrackStart seen;
  EXPECT_CALL(behind_.posegraph(), Track(_, _, _))
      .WillOnce(Return(absl::UnavailableError("away")))
      .WillOnce([&seen](auto&,
                        auto map,
                        const TrackStart& start) -> absl::StatusOr<std::unique_ptr<api::Tracking>> {
        EXPECT_EQ(map, "m");
        seen = start;
        return std::make_unique<EchoingTracking>();
      });
  TrackStart start;
  start.T_map_scan_guess = MakePose(Eigen::Quaterniond::Identity(), {1.0, 2.0, 3.0});
  STRATA_ASSERT_OK_AND_ASSIGN(const auto tracking, client_->posegraph().Track({}, "m", start));
  EXPECT_EQ(seen.T_map_scan_guess->translation().z(), 3.0);
  TrackStep step;
  step.T_odom_scan.translation().x() = 4.0;
  STRATA_ASSERT_OK_AND_ASSIGN(const TrackedPose pose, tracking->Step(step));
  EXPECT_EQ(pose.T_map_scan.translation().x(), 4.0);
  // In pieces.
  step.cloud = LargeQuery().cloud;
  STRATA_EXPECT_OK(tracking->Step(step).status());
  EXPECT_THAT(EchoingTracking::points, ::testing::ElementsAre(0U, 90'000U));
  // What is no step is not sent.
  TrackStep none;
  none.T_odom_scan.linear() *= 2.0;
  EXPECT_THAT(tracking->Step(none), StatusIs(Code::kInvalidArgument, HasSubstr("odometry")));
  // The end of the stream is the answer from then on.
  EXPECT_THAT(tracking->Step(step), StatusIs(Code::kUnavailable, "away"));
  EXPECT_THAT(tracking->Step(step), StatusIs(Code::kUnavailable, "away"));
}

}  // namespace
}  // namespace strata::sdk
