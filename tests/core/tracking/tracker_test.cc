#include "core/tracking/tracker.h"

#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/LU>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/mls/build.h"
#include "core/mls/surface_tile.h"
#include "tests/support/simulator/simulator.h"
#include "tests/support/simulator/worlds.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::strata::testing::Random;
using ::testing::HasSubstr;

Pose At(double x_m, double y_m, double yaw_rad) {
  return Pose(Eigen::Translation3d(x_m, y_m, 1.2) *
              Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()));
}

class Yard {
 public:
  Yard() : scene_(testing::YardScene()) {}

  PointCloud See(const Pose& T_map_scan, std::uint64_t seed) const {
    testing::SensorOptions sensor;
    sensor.rings = 32;
    sensor.columns = 360;
    return testing::SimulateScan(scene_, sensor, T_map_scan, seed);
  }

 private:
  testing::Scene scene_;
};

MlsMap MapOf(const PointCloud& cloud, const Pose& T_map_scan) {
  MlsParameters parameters;
  parameters.cell_size_m = 0.1;
  MlsScratch scratch;
  auto built = BuildMlsMap(cloud, T_map_scan, SensorModel(), parameters, scratch);
  EXPECT_THAT(built, ::strata::testing::IsOk());
  return built.ok() ? std::move(built->map) : MlsMap();
}

ScanFeatures FeaturesOf(const PointCloud& cloud) {
  return ScanFeatures::FromMap(MapOf(cloud, Pose::Identity()));
}

// A map of the yard's west alone, and a finder that says what it is told.
class FakeMap final : public TrackedMap {
 public:
  explicit FakeMap(const Yard& yard) {
    MapSurfacesCollector collector(Eigen::Vector3d::Zero(), 0.1, true);
    for (int k = 0; k < 6; ++k) {
      const Pose pose = At(-8.0 + 2.0 * k, -3.0 + k, 0.3 * k);
      for (const MlsTile& tile : MapOf(yard.See(pose, 100U + k), pose).tiles) {
        collector.Add(SurfacesOf(tile));
      }
    }
    surfaces_ = std::make_shared<const MapSurfaces>(std::move(collector).Finish());
  }

  absl::StatusOr<std::shared_ptr<const MapSurfaces>> Around(const Eigen::Vector3d&) override {
    return surfaces_;
  }
  absl::StatusOr<LocalizeResult> Find(const std::optional<Pose>& guess, double) override {
    guesses.push_back(guess);
    LocalizeResult result;
    result.message = "nowhere";
    result.found = place.has_value();
    if (!result.found) return result;
    result.best.T_map_scan = *place;
    result.covariance = 1e-3 * Matrix6d::Identity();
    result.message = "there";
    return result;
  }

  std::optional<Pose> place;
  std::vector<std::optional<Pose>> guesses;

 private:
  std::shared_ptr<const MapSurfaces> surfaces_;
};

class TrackerTest : public ::testing::Test {
 protected:
  TrackerTest() : map_(yard_) {}

  TrackedPose Step(Tracker& tracker, const Pose& truth, const Pose& T_odom_scan) {
    TrackStep step;
    step.cloud = yard_.See(truth, ++seed_);
    step.T_odom_scan = T_odom_scan;
    return Answer(tracker.Step(step, FeaturesOf(step.cloud), map_));
  }
  static TrackedPose Answer(const absl::StatusOr<TrackedPose>& pose) {
    EXPECT_THAT(pose, ::strata::testing::IsOk());
    return pose.value_or(TrackedPose());
  }
  static Tracker NewTracker() { return {TrackStart(), MlsRegistrationOptions()}; }

  Yard yard_;
  FakeMap map_;
  std::uint64_t seed_ = 0;
};

void ExpectAt(const TrackedPose& pose, const Pose& truth) {
  const Pose off = truth.inverse() * pose.T_map_scan;
  EXPECT_LT(off.translation().norm(), 0.1) << pose.message;
  EXPECT_LT(RotationAngleRad(off), 0.01);
}

TEST_F(TrackerTest, FollowsARobotByItsOdometryAndItsScans) {
  Tracker tracker = NewTracker();
  EXPECT_EQ(tracker.pose(), std::nullopt);
  map_.place = At(-6.0, -2.0, 0.0);
  const Pose T_map_odom = At(100.0, 3.0, 2.0);
  Random random(5);
  double nees = 0.0;
  Pose odometry = Pose::Identity();
  Pose last = *map_.place;
  for (int k = 0; k < 12; ++k) {
    const Pose truth = At(-6.0 + 0.8 * k, -2.0 + 0.4 * k, 0.1 * k);
    Vector6d noise;
    const Pose motion = last.inverse() * truth;
    for (int i = 0; i < 6; ++i) {
      noise[i] = random.Gaussian() * std::sqrt(MotionCovariance(motion)(i, i));
    }
    odometry = Normalized(odometry * (k == 0 ? motion : Retract(motion, noise)));
    last = truth;
    const TrackedPose pose = Step(tracker, truth, T_map_odom.inverse() * odometry);
    EXPECT_EQ(pose.state, TrackState::kTracked) << pose.message;
    EXPECT_EQ(pose.found, k == 0);
    EXPECT_GT(pose.score, 0.5);
    ExpectAt(pose, truth);
    const Pose off = pose.T_map_scan.inverse() * truth;
    Vector6d error;
    error << So3Log(off.linear()), off.translation();
    nees += error.dot(pose.covariance.inverse() * error) / 12.0;
  }
  EXPECT_LT(nees, 9.0);
  EXPECT_EQ(map_.guesses.size(), 1U);
}

TEST_F(TrackerTest, OdometryAloneIsAPredictionThatGrowsLessSure) {
  Tracker tracker = NewTracker();
  map_.place = At(-6.0, -2.0, 0.0);
  const TrackedPose begun = Step(tracker, *map_.place, Pose::Identity());
  ASSERT_EQ(begun.state, TrackState::kTracked) << begun.message;
  TrackStep step;
  double sigma = begun.covariance(3, 3);
  for (int k = 1; k <= 3; ++k) {
    step.T_odom_scan.translation().x() = 0.5 * k;
    const TrackedPose pose = Answer(tracker.Step(step, ScanFeatures(), map_));
    EXPECT_EQ(pose.state, TrackState::kPredicted);
    EXPECT_EQ(pose.score, 0.0);
    ExpectAt(pose, At(-6.0 + 0.5 * k, -2.0, 0.0));
    EXPECT_GT(pose.covariance(3, 3), sigma);
    sigma = pose.covariance(3, 3);
  }
}

TEST_F(TrackerTest, ARobotThatWasCarriedAwayIsLostAndFoundAgain) {
  Tracker tracker = NewTracker();
  map_.place = At(-6.0, -2.0, 0.0);
  ASSERT_EQ(Step(tracker, *map_.place, Pose::Identity()).state, TrackState::kTracked);
  const Pose there = At(2.0, 2.0, 2.5);
  map_.place.reset();
  map_.guesses.clear();
  const TrackedPose first = Step(tracker, there, Pose::Identity());
  EXPECT_EQ(first.state, TrackState::kPredicted) << first.message;
  EXPECT_THAT(map_.guesses, ::testing::IsEmpty());
  const TrackedPose second = Step(tracker, there, Pose::Identity());
  EXPECT_EQ(second.state, TrackState::kLost);
  EXPECT_TRUE(second.known);
  EXPECT_EQ(second.score, 0.0);
  EXPECT_EQ(second.message, "nowhere");
  // Near where it may be, then anywhere.
  ASSERT_EQ(map_.guesses.size(), 2U);
  EXPECT_TRUE(map_.guesses[0].has_value());
  EXPECT_FALSE(map_.guesses[1].has_value());
  map_.place = there;
  const TrackedPose third = Step(tracker, there, Pose::Identity());
  EXPECT_EQ(third.state, TrackState::kTracked) << third.message;
  EXPECT_TRUE(third.found);
  ExpectAt(third, there);
}

TEST_F(TrackerTest, APlaceThatTheSurfacesDenyIsNone) {
  Tracker tracker = NewTracker();
  map_.place = At(2.0, 2.0, 2.5);
  const TrackedPose pose = Step(tracker, At(-6.0, -2.0, 0.0), Pose::Identity());
  EXPECT_EQ(pose.state, TrackState::kLost);
  EXPECT_FALSE(pose.known);
  EXPECT_NE(pose.message, "");
  EXPECT_TRUE(pose.covariance.isZero());
}

TEST_F(TrackerTest, ARobotThatStaysLostIsLookedForLessOften) {
  Tracker tracker = NewTracker();
  for (int k = 0; k < 15; ++k) {
    EXPECT_EQ(Step(tracker, At(-6.0, -2.0, 0.0), Pose::Identity()).state, TrackState::kLost);
  }
  EXPECT_EQ(map_.guesses.size(), 7U);  // the first five, and two of the other ten
}

TEST_F(TrackerTest, TheGuessGoesAlongUntilTheRobotIsFound) {
  TrackStart start;
  start.T_map_scan_guess = At(-6.0, -2.0, 0.0);
  Tracker tracker(start, MlsRegistrationOptions());
  Pose T_odom_scan = Pose::Identity();
  Step(tracker, At(-6.0, -2.0, 0.0), T_odom_scan);
  T_odom_scan.translation().x() = 1.0;
  Step(tracker, At(-5.0, -2.0, 0.0), T_odom_scan);
  ASSERT_EQ(map_.guesses.size(), 2U);
  ASSERT_TRUE(map_.guesses[1].has_value());
  EXPECT_TRUE(map_.guesses[1]->isApprox(At(-5.0, -2.0, 0.0), 1e-12));
}

TEST_F(TrackerTest, SameStepsGiveSamePoses) {
  std::vector<Eigen::Matrix4d> poses[2];
  for (auto& run : poses) {
    seed_ = 0;
    Tracker tracker = NewTracker();
    map_.place = At(-6.0, -2.0, 0.0);
    for (int k = 0; k < 3; ++k) {
      Pose T_odom_scan = Pose::Identity();
      T_odom_scan.translation().x() = 0.7 * k;
      run.push_back(Step(tracker, At(-6.0 + 0.75 * k, -2.0, 0.0), T_odom_scan).T_map_scan.matrix());
    }
  }
  EXPECT_EQ(poses[0], poses[1]);
}

}  // namespace
}  // namespace strata
