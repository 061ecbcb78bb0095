#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/planes/extraction.h"
#include "core/posegraph/alignment/alignment.h"
#include "core/posegraph/information.h"
#include "tests/core/posegraph/alignment/alignment_world.h"
#include "tests/core/posegraph/random_poses.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using testing::AlignmentTest;
using ::testing::Each;
using ::testing::IsEmpty;
using ::testing::Not;
using testing::RandomPoses;
using testing::YardScans;

// Drives the first robot's way forth and back, 36 scans.
class LongWay final : public AlignmentSource {
 public:
  static constexpr std::size_t kScans = 36;

  explicit LongWay(YardScans& yard) : yard_(yard) {}

  static std::size_t At(std::size_t node) {
    constexpr std::size_t kEnd = YardScans::kFirst - 1;
    const std::size_t along = node % (2 * kEnd);
    return along <= kEnd ? along : 2 * kEnd - along;
  }
  absl::StatusOr<std::shared_ptr<const ScanFeatures>> Features(std::size_t node) override {
    return yard_.Features(node == elsewhere ? At(node + 1) : At(node));
  }
  absl::StatusOr<std::shared_ptr<const ScanPlanes>> Planes(std::size_t node) override {
    return yard_.Planes(node == elsewhere ? At(node + 1) : At(node));
  }

  std::optional<std::size_t> elsewhere;  // the scan that shows what the next one shows

 private:
  YardScans& yard_;
};

TEST_F(AlignmentTest, AJumpOfOdometryPullsNothing) {
  LongWay way(yard());
  RandomPoses random(20261126);
  problem_ = {};
  problem_.trajectories.resize(1);
  for (std::size_t k = 0; k < LongWay::kScans; ++k) {
    problem_.T_map_scan.push_back(yard().truth()[LongWay::At(k)]);
    problem_.trajectories[0].push_back(k);
    if (k == 0) continue;
    const Pose step = TrueStep(LongWay::At(k - 1), LongWay::At(k));
    ScanPair& pair = problem_.pairs.emplace_back(ScanPair{k - 1, k});
    pair.measured = MeasuredPose{step, IsotropicInformation(0.001, 0.01)};
    RelativePoseTerm motion{k - 1, k};
    motion.T_i_j = Retract(step, random.Step(0.001, 0.01));
    if (k == 18) motion.T_i_j.translation().x() += 3.0;
    problem_.odometry.push_back(motion);
  }
  STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult result, Align(way));
  for (std::size_t k = 0; k < LongWay::kScans; ++k) {
    const Pose& truth = yard().truth()[LongWay::At(k)];
    EXPECT_LT((result.T_map_scan[k].translation() - truth.translation()).norm(), 0.02) << k;
  }
}

// A scan of a bare floor that ingest could not place was drawn 1.1 m along a drawn car park,
// between two that were where their robot says.
TEST_F(AlignmentTest, ALostScanOutOfLineIsWhereItsRobotSays) {
  constexpr std::size_t kLost = 22;
  LongWay way(yard());
  way.elsewhere = kLost;
  RandomPoses random(20261130);
  problem_ = {};
  problem_.trajectories.resize(1);
  problem_.lost = {kLost};
  for (std::size_t k = 0; k < LongWay::kScans; ++k) {
    problem_.T_map_scan.push_back(yard().truth()[LongWay::At(k)]);
    problem_.trajectories[0].push_back(k);
    if (k == 0) continue;
    const std::size_t before = k == kLost + 1 ? kLost - 1 : k - 1;
    ScanPair& pair = problem_.pairs.emplace_back(ScanPair{before, k});
    if (k != kLost) {
      pair.measured = MeasuredPose{TrueStep(LongWay::At(before), LongWay::At(k)),
                                   IsotropicInformation(0.001, 0.01)};
    }
    RelativePoseTerm motion{k - 1, k};
    motion.T_i_j = Retract(TrueStep(LongWay::At(k - 1), LongWay::At(k)), random.Step(0.001, 0.01));
    problem_.odometry.push_back(motion);
  }
  problem_.T_map_scan[kLost] = yard().truth()[LongWay::At(kLost + 1)];
  STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult result, Align(way));
  for (std::size_t k = 0; k < LongWay::kScans; ++k) {
    const Pose& truth = yard().truth()[LongWay::At(k)];
    EXPECT_LT((result.T_map_scan[k].translation() - truth.translation()).norm(), 0.05) << k;
    EXPECT_EQ(result.parts[k] == result.parts[0], k != kLost) << k;
  }
}

// Scans behind the jump fit to both sides of it held as one piece, which says nothing of the jump.
TEST_F(AlignmentTest, NothingIsPooledAcrossAStepThatNobodyMeasured) {
  constexpr std::size_t kJump = 3;
  const Pose off = MakePose(Eigen::Quaterniond(Eigen::AngleAxisd(1.0, Eigen::Vector3d::UnitZ())),
                            {2.0, 5.0, 0.0});
  for (std::size_t k = kJump; k < YardScans::kFirst; ++k) {
    problem_.T_map_scan[k] = off * problem_.T_map_scan[k];
  }
  STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult result, Align());
  for (std::size_t k = 0; k < YardScans::kFirst; ++k) {
    EXPECT_EQ(result.parts[k] == result.parts[0], k < kJump) << k;
    EXPECT_EQ(result.parts[k] == result.parts[kJump], k >= kJump) << k;
  }
}

// What says something else than the robot is looked at again once poses have settled, and taken out
// where scans speak against it.
TEST_F(AlignmentTest, AStepThatScansSpeakAgainstIsTheRobotsWord) {
  constexpr std::size_t kJump = 3;
  problem_ = {};
  problem_.trajectories.resize(1);
  Pose off = Pose::Identity();
  for (std::size_t k = 0; k < YardScans::kFirst; ++k) {
    if (k == kJump) off.translation() = Eigen::Vector3d(1.5, 3.0, 0.0);
    problem_.T_map_scan.push_back(off * yard().truth()[k]);
    problem_.trajectories[0].push_back(k);
    if (k == 0) continue;
    const Pose found = problem_.T_map_scan[k - 1].inverse() * problem_.T_map_scan[k];
    ScanPair& pair = problem_.pairs.emplace_back(ScanPair{k - 1, k});
    pair.measured = MeasuredPose{found, IsotropicInformation(0.001, 0.01)};
    problem_.odometry.push_back({k - 1, k, TrueStep(k - 1, k), IsotropicInformation(0.005, 0.05)});
  }
  STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult result, Align());
  for (std::size_t k = 0; k < YardScans::kFirst; ++k) {
    const Pose is = result.T_map_scan[0].inverse() * result.T_map_scan[k];
    EXPECT_LT((is.translation() - TrueStep(0, k).translation()).norm(), 0.1) << k;
    EXPECT_EQ(result.parts[k] == result.parts[0], k < kJump) << k;
  }
  EXPECT_EQ(result.termination, AlignmentTermination::kSettled);
}

// A floor with nothing on it.
class FloorScans final : public AlignmentSource {
 public:
  FloorScans() {
    RandomPoses random(5);
    std::array<std::vector<Eigen::Vector3f>, kFeatureClasses> points;
    std::vector<Eigen::Vector3f>& floor =
        points[static_cast<std::size_t>(FeatureClass::kTraversable)];
    for (int x = -20; x <= 20; ++x) {
      for (int y = -20; y <= 20; ++y) {
        const Eigen::Vector3f shaken = random.Vector(0.05).cast<float>();
        floor.emplace_back(0.3F * static_cast<float>(x) + shaken.x(),
                           0.3F * static_cast<float>(y) + shaken.y(),
                           -1.2F);
      }
    }
    PointCloud cloud;
    cloud.points = floor;
    planes_ = std::make_shared<const ScanPlanes>(ExtractPlanes(cloud));
    features_ = std::make_shared<const ScanFeatures>(ScanFeatures::FromPoints(std::move(points)));
  }
  absl::StatusOr<std::shared_ptr<const ScanFeatures>> Features(std::size_t) override {
    return features_;
  }
  absl::StatusOr<std::shared_ptr<const ScanPlanes>> Planes(std::size_t) override { return planes_; }

 private:
  std::shared_ptr<const ScanFeatures> features_;
  std::shared_ptr<const ScanPlanes> planes_;
};

// A robot that goes straight on over it, and knows how far.
AlignmentProblem OverTheFloor(std::size_t scans) {
  AlignmentProblem floor;
  floor.trajectories.emplace_back();
  for (std::size_t k = 0; k < scans; ++k) {
    floor.trajectories[0].push_back(k);
    floor.T_map_scan.push_back(
        MakePose(Eigen::Quaterniond::Identity(), {0.5 * static_cast<double>(k), 0.0, 1.2}));
    if (k == 0) continue;
    floor.pairs.push_back({k - 1, k});
    floor.odometry.push_back({k - 1,
                              k,
                              floor.T_map_scan[k - 1].inverse() * floor.T_map_scan[k],
                              IsotropicInformation(0.005, 0.05)});
  }
  return floor;
}

TEST_F(AlignmentTest, WhatMayOnlySlideIsNamed) {
  problem_ = OverTheFloor(3);
  FloorScans scans;
  STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult result, Align(scans));
  EXPECT_THAT(result.sliding, ::testing::ElementsAre(1, 2));
  EXPECT_THAT(result.parts, Each(result.parts[0]));
  problem_.lost = {2};  // then it agrees with anything
  STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult apart, Align(scans));
  EXPECT_EQ(apart.parts[1], apart.parts[0]);
  EXPECT_NE(apart.parts[2], apart.parts[0]);
}

// A match that agrees with any place went on agreeing with wherever planes and rounding had moved
// it to, and spoke for that against the robot: drawn robots ended 6 m from where they said.
TEST_F(AlignmentTest, WhatNothingJoinsIsWhereItsRobotSays) {
  constexpr std::size_t kScans = 36;
  constexpr std::size_t kLost = 33;
  problem_ = OverTheFloor(kScans);
  problem_.lost = {kLost};
  for (ScanPair& pair : problem_.pairs) {
    if (pair.j == kLost) continue;
    pair.measured = {problem_.odometry[pair.i].T_i_j, IsotropicInformation(0.001, 0.01)};
  }
  for (std::size_t k = kLost; k < kScans; ++k) problem_.T_map_scan[k].translation().y() += 3.0;
  FloorScans scans;
  STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult result, Align(scans));
  EXPECT_NE(result.parts[kLost], result.parts[kLost - 1]);
  const Pose T_before_lost = result.T_map_scan[kLost - 1].inverse() * result.T_map_scan[kLost];
  EXPECT_LT((T_before_lost.translation() - Eigen::Vector3d(0.5, 0.0, 0.0)).norm(), 0.05);
  EXPECT_THAT(result.planes, Not(IsEmpty()));
  for (const SharedPlane& plane : result.planes) {
    for (const SharedPlane::View& view : plane.views) {
      EXPECT_EQ(result.parts[view.scan], result.parts[plane.views[0].scan]);
    }
  }
}

}  // namespace
}  // namespace strata
