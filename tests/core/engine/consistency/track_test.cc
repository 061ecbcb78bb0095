#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>

#include <Eigen/LU>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/core/engine/consistency/yard_fixture.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::_;

class TrackTest : public YardTest {
 protected:
  // At their true poses.
  void MakeTrueMap(bool keep_points) {
    MapParameters parameters;
    parameters.keep_points = keep_points;
    MakeMap(parameters);
    for (std::uint64_t k = 1; k <= kScans; ++k) {
      const PointCloud cloud = See(TruthOf(k), k);
      STRATA_EXPECT_OK(Upload(db(), HeaderOf({"run", k}, cloud, TruthOf(k)), cloud));
    }
    WaitIntegrated(db());
  }
  std::unique_ptr<api::Tracking> Track(const TrackStart& start = {}) {
    auto tracking = db().posegraph().Track({}, kMapName, start);
    EXPECT_THAT(tracking, IsOk());
    return tracking.ok() ? *std::move(tracking) : nullptr;
  }
  static TrackStep StepAt(const Pose& truth, std::uint64_t seed, const Pose& T_odom_scan) {
    TrackStep step;
    step.cloud = See(truth, seed);
    step.T_odom_scan = T_odom_scan;
    return step;
  }
  static Pose Between(double k) {
    const auto low = static_cast<std::uint64_t>(k);
    const double share = k - static_cast<double>(low);
    const Pose T = TruthOf(low).inverse() * TruthOf(low + 1);
    return TruthOf(low) *
           PoseAt(share * T.translation().x(), share * T.translation().y(), 0.2 * share);
  }
  void FollowBetweenScans() {
    const std::string digest = Digest();
    const auto tracking = Track();
    std::uint64_t seed = 50;
    for (double k = 1.3; k < 5.9; k += 0.4) {
      // Odometry in a frame of its own that grows too long.
      const Pose T_odom_scan = PoseAt(7.0, -3.0, 1.0) * TruthOf(1).inverse() * Between(k) *
                               PoseAt(0.02 * k, -0.01 * k, 0.004 * k);
      STRATA_ASSERT_OK_AND_ASSIGN(const TrackedPose pose,
                                  tracking->Step(StepAt(Between(k), ++seed, T_odom_scan)));
      EXPECT_EQ(pose.state, TrackState::kTracked) << pose.message;
      EXPECT_EQ(pose.found, seed == 51);
      EXPECT_EQ(pose.epoch, 1U);
      const Pose off = pose.T_map_scan.inverse() * Between(k);
      EXPECT_LT(off.translation().norm(), 0.08);
      EXPECT_LT(RotationAngleRad(off), 0.008);
      Vector6d error;
      error << So3Log(off.linear()), off.translation();
      EXPECT_LT(error.dot(pose.covariance.inverse() * error), 25.0);
    }
    EXPECT_EQ(Digest(), digest);
  }
};

TEST_F(TrackTest, ARobotIsFollowed) {
  MakeTrueMap(true);
  FollowBetweenScans();
}

TEST_F(TrackTest, ARobotIsFollowedWhereThePointsWereDropped) {
  MakeTrueMap(false);
  FollowBetweenScans();
}

TEST_F(TrackTest, ACarriedRobotIsFoundInFiveScansAndOneElsewhereSaysItIsLost) {
  MakeTrueMap(true);
  const auto tracking = Track();
  STRATA_ASSERT_OK(tracking->Step(StepAt(TruthOf(1), 51, Pose::Identity())).status());
  int scans = 0;
  bool found = false;
  while (!found && scans < 5) {
    ++scans;
    STRATA_ASSERT_OK_AND_ASSIGN(const TrackedPose pose,
                                tracking->Step(StepAt(TruthOf(5), 60 + scans, Pose::Identity())));
    found = pose.found;
    if (!found) continue;
    EXPECT_LT((pose.T_map_scan.translation() - TruthOf(5).translation()).norm(), 0.1);
  }
  EXPECT_TRUE(found);
  // A room that no scan of the map has seen.
  TrackStep elsewhere;
  elsewhere.cloud = MakeRoom(3);
  TrackedPose last;
  for (int k = 0; k < 3; ++k) {
    STRATA_ASSERT_OK_AND_ASSIGN(last, tracking->Step(elsewhere));
    EXPECT_NE(last.state, TrackState::kTracked);
  }
  EXPECT_EQ(last.state, TrackState::kLost);
  EXPECT_TRUE(last.known);
  EXPECT_NE(last.message, "");
}

TEST_F(TrackTest, APoseIsOfTheEpochThatItNames) {
  MakeWorld();
  const auto tracking = Track();
  STRATA_ASSERT_OK_AND_ASSIGN(const TrackedPose before,
                              tracking->Step(StepAt(TruthOf(3), 51, Pose::Identity())));
  ASSERT_EQ(before.state, TrackState::kTracked) << before.message;
  EXPECT_EQ(before.epoch, 1U);
  // By hand a metre away, all of them: another epoch, or not, is what the answer says.
  for (std::uint64_t k = 1; k <= kScans; ++k) {
    STRATA_ASSERT_OK(
        db().posegraph().SetPose({}, kMapName, {"run", k}, PoseAt(1.0, 0.0) * TruthOf(k)));
  }
  Optimize();
  const std::uint64_t epoch = Graph().epoch;
  ASSERT_GT(epoch, 1U);
  STRATA_ASSERT_OK_AND_ASSIGN(const TrackedPose after,
                              tracking->Step(StepAt(TruthOf(3), 52, Pose::Identity())));
  EXPECT_EQ(after.epoch, epoch);
  EXPECT_EQ(after.state, TrackState::kTracked) << after.message;
  const Pose off = PoseOf(3).inverse() * after.T_map_scan;
  EXPECT_LT(off.translation().norm(), 0.1);
}

TEST_F(TrackTest, AMapWithoutScansHasNoPlace) {
  MakeMap(MapParameters());
  TrackStart start;
  start.T_map_scan_guess = TruthOf(1);
  const auto tracking = Track(start);
  STRATA_ASSERT_OK_AND_ASSIGN(const TrackedPose pose,
                              tracking->Step(StepAt(TruthOf(1), 51, Pose::Identity())));
  EXPECT_EQ(pose.state, TrackState::kLost);
  EXPECT_FALSE(pose.known);
}

TEST_F(TrackTest, AStepThatIsNoneCountsForNothing) {
  MakeTrueMap(true);
  TrackStart start;
  start.guess_radius_m = -1.0;
  EXPECT_THAT(db().posegraph().Track({}, kMapName, start),
              StatusIs(absl::StatusCode::kInvalidArgument, _));
  EXPECT_THAT(db().posegraph().Track({}, "nowhere", {}), StatusIs(absl::StatusCode::kNotFound, _));
  const auto tracking = Track();
  STRATA_ASSERT_OK(tracking->Step(StepAt(TruthOf(2), 51, Pose::Identity())).status());
  TrackStep bad = StepAt(TruthOf(2), 52, PoseAt(100.0, 0.0));
  bad.cloud.points[5].x() = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(tracking->Step(bad), StatusIs(absl::StatusCode::kInvalidArgument, _));
  STRATA_ASSERT_OK_AND_ASSIGN(const TrackedPose pose,
                              tracking->Step(StepAt(TruthOf(2), 53, Pose::Identity())));
  EXPECT_EQ(pose.state, TrackState::kTracked);
}

}  // namespace
}  // namespace strata::testing
