#include "core/posegraph/alignment/alignment.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/cloud/sensor_model.h"
#include "core/mls/build.h"
#include "core/planes/extraction.h"
#include "core/posegraph/information.h"
#include "tests/core/posegraph/random_poses.h"
#include "tests/support/simulator/simulator.h"
#include "tests/support/simulator/worlds.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::testing::_;
using ::testing::Each;
using ::testing::Gt;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using testing::RandomPoses;
using testing::StatusIs;
using Code = absl::StatusCode;

// What a robot saw on its way through the yard and a second one after it, a scan every 2 m.
class YardScans final : public AlignmentSource {
 public:
  static constexpr std::size_t kFirst = 6;
  static constexpr std::size_t kScans = 10;

  YardScans() {
    const testing::Scene yard = testing::YardScene();
    testing::SensorOptions sensor;
    sensor.rings = 32;
    sensor.columns = 360;
    for (std::size_t k = 0; k < kScans; ++k) {
      const bool first = k < kFirst;
      const double along = 2.0 * static_cast<double>(first ? k : k - kFirst) + (first ? 0.0 : 1.0);
      const Eigen::AngleAxisd turn(first ? 0.05 * along : 2.0, Eigen::Vector3d::UnitZ());
      truth_.push_back(
          MakePose(Eigen::Quaterniond(turn), {along, first ? 0.0 : -1.5, first ? 1.2 : 1.5}));
      Take(testing::SimulateScan(yard, sensor, truth_.back(), 100 + k));
    }
  }

  absl::StatusOr<std::shared_ptr<const ScanFeatures>> Features(std::size_t node) override {
    return features_[node];
  }
  absl::StatusOr<std::shared_ptr<const ScanPlanes>> Planes(std::size_t node) override {
    return planes_[node];
  }
  const std::vector<Pose>& truth() const { return truth_; }

 private:
  void Take(const PointCloud& cloud) {
    const absl::StatusOr<MlsBuildResult> local =
        BuildMlsMap(cloud, Pose::Identity(), SensorModel(), MlsParameters());
    STRATA_EXPECT_OK(local);
    ScanFeatureOptions options;
    options.sample_count = 1000;
    features_.push_back(
        std::make_shared<const ScanFeatures>(ScanFeatures::FromMap(local->map, options)));
    planes_.push_back(std::make_shared<const ScanPlanes>(ExtractPlanes(cloud)));
  }

  std::vector<Pose> truth_;
  std::vector<std::shared_ptr<const ScanFeatures>> features_;
  std::vector<std::shared_ptr<const ScanPlanes>> planes_;
};

// Of translation [m] and rotation [rad] of all but the first, relative to the first.
struct Errors {
  double mean_m = 0.0, max_m = 0.0, max_rad = 0.0;
};

class AlignmentTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { yard_ = new YardScans; }
  static void TearDownTestSuite() { delete yard_; }

  AlignmentTest() {
    problem_.T_map_scan = yard().truth();
    problem_.trajectories.resize(2);
    for (std::size_t k = 0; k < YardScans::kScans; ++k) {
      problem_.trajectories[k < YardScans::kFirst ? 0 : 1].push_back(k);
      if (k != 0 && k != YardScans::kFirst) problem_.pairs.push_back({k - 1, k});
    }
    // Both know that they are in one frame.
    problem_.relative.push_back(
        {0, YardScans::kFirst, TrueStep(0, YardScans::kFirst), Matrix6d::Identity() * 1e-6});
    options_.max_rounds = 4;
    options_.registration.max_samples = 1000;
  }

  static YardScans& yard() { return *yard_; }

  void Disturb(std::uint64_t seed, double sigma_rad = 0.015, double sigma_m = 0.1) {
    RandomPoses random(seed);
    for (std::size_t k = 1; k < YardScans::kScans; ++k) {
      problem_.T_map_scan[k] = Retract(problem_.T_map_scan[k], random.Step(sigma_rad, sigma_m));
    }
  }

  absl::StatusOr<AlignmentResult> Align(AlignmentSource& source, ForEach for_each = ForEachInTurn) {
    return AlignScans(
        problem_, source, options_, for_each, [](double) { return absl::OkStatus(); }, Stop());
  }
  absl::StatusOr<AlignmentResult> Align() { return Align(yard()); }

  static Pose TrueStep(std::size_t i, std::size_t j) {
    return yard().truth()[i].inverse() * yard().truth()[j];
  }

  static Errors ErrorsOf(const std::vector<Pose>& T_map_scan) {
    Errors errors;
    for (std::size_t k = 1; k < T_map_scan.size(); ++k) {
      const Pose off = TrueStep(0, k).inverse() * T_map_scan[0].inverse() * T_map_scan[k];
      const double distance = off.translation().norm();
      errors.mean_m += distance / static_cast<double>(T_map_scan.size() - 1);
      errors.max_m = std::max(errors.max_m, distance);
      errors.max_rad = std::max(errors.max_rad, RotationAngleRad(off));
    }
    return errors;
  }

  AlignmentProblem problem_;
  AlignmentOptions options_;

 private:
  static YardScans* yard_;
};

YardScans* AlignmentTest::yard_ = nullptr;

TEST_F(AlignmentTest, DisturbedPosesComeBack) {
  for (const std::uint64_t seed : {1, 2}) {
    SCOPED_TRACE(::testing::Message() << "seed " << seed);
    problem_.T_map_scan = yard().truth();
    Disturb(seed);
    ASSERT_GT(ErrorsOf(problem_.T_map_scan).max_m, 0.15);
    STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult result, Align());
    const Errors errors = ErrorsOf(result.T_map_scan);
    RecordProperty("max_mm", static_cast<int>(1000 * errors.max_m));
    EXPECT_LT(errors.max_m, 0.02);
    EXPECT_LT(errors.max_rad, 0.002);
    EXPECT_TRUE(result.T_map_scan[0].isApprox(yard().truth()[0], 1e-9));  // the gauge
    EXPECT_THAT(result.planes, Not(IsEmpty()));
    EXPECT_THAT(result.rejected, IsEmpty());
    for (const RelativePoseTerm& term : result.measured) {
      const Pose off = TrueStep(term.i, term.j).inverse() * term.T_i_j;
      EXPECT_LT(off.translation().norm(), 0.05) << term.i << " " << term.j;
    }
    EXPECT_LT(result.rounds.back().max_shift_m, result.rounds.front().max_shift_m);
  }
}

TEST_F(AlignmentTest, WhereNothingMovesCorrespondencesAreKept) {
  options_.settled_m = 0.002;
  options_.settled_rad = 0.0002;
  STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult result, Align());
  EXPECT_EQ(result.rounds.front().registered, result.rounds.front().matches);
  EXPECT_LT(result.rounds.back().registered, result.rounds.front().registered / 2);
  EXPECT_LT(ErrorsOf(result.T_map_scan).max_m, 0.02);
}

// Counts how often planes are asked for.
class CountedPlanes final : public AlignmentSource {
 public:
  explicit CountedPlanes(AlignmentSource& source) : source_(source) {}
  absl::StatusOr<std::shared_ptr<const ScanFeatures>> Features(std::size_t node) override {
    return source_.Features(node);
  }
  absl::StatusOr<std::shared_ptr<const ScanPlanes>> Planes(std::size_t node) override {
    ++count;
    return source_.Planes(node);
  }
  std::size_t count = 0;

 private:
  AlignmentSource& source_;
};

TEST_F(AlignmentTest, PlanesAreKeptOncePosesAreNearlyRight) {
  options_.settled_m = 0.0;
  options_.settled_rad = 0.0;
  CountedPlanes source(yard());
  STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult result, Align(source));
  ASSERT_GT(result.rounds.size(), 1U);
  EXPECT_EQ(source.count, std::size_t{YardScans::kScans});
  EXPECT_EQ(result.rounds.back().planes, result.rounds.front().planes);
}

TEST_F(AlignmentTest, WhatWideGatesFoundIsSortedOutOncePosesHaveSettled) {
  options_.max_rounds = 10;
  CountedPlanes source(yard());
  options_.shared_planes.pose_sigma_m *= 10.0;
  options_.shared_planes.pose_sigma_rad *= 10.0;
  STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult result, Align(source));
  EXPECT_EQ(result.termination, AlignmentTermination::kSettled);
  EXPECT_EQ(source.count, std::size_t{2 * YardScans::kScans}) << "once wide, once narrow";
}

TEST_F(AlignmentTest, PlanesDoNoHarm) {
  for (const std::uint64_t seed : {1, 2}) {
    SCOPED_TRACE(::testing::Message() << "seed " << seed);
    problem_.T_map_scan = yard().truth();
    Disturb(seed);
    options_.planes = true;
    STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult with, Align());
    options_.planes = false;
    STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult without, Align());
    EXPECT_THAT(without.planes, IsEmpty());
    EXPECT_EQ(without.rounds.back().supports, 0U);
    EXPECT_LT(ErrorsOf(with.T_map_scan).mean_m, ErrorsOf(without.T_map_scan).mean_m + 0.002);
  }
}

TEST_F(AlignmentTest, PlanesAreThoseOfTheYard) {
  Disturb(3);
  STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult result, Align());
  bool ground = false;
  bool south_wall = false;
  for (const SharedPlane& plane : result.planes) {
    const Plane& found = plane.plane;
    ground |= found.normal.z() > 0.9999 && std::abs(found.distance) < 0.02;
    south_wall |= found.normal.y() > 0.9999 && std::abs(found.distance + 14.0) < 0.03;
    EXPECT_GE(plane.views.size(), 2U);
  }
  EXPECT_TRUE(ground);
  EXPECT_TRUE(south_wall);
}

TEST_F(AlignmentTest, AnExcludedPlaneIsNotUsed) {
  STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult all, Align());
  ASSERT_THAT(all.planes, Not(IsEmpty()));
  const SharedPlane& first = all.planes.front();
  const auto same = [&first](const SharedPlane& plane) {
    return plane.plane.normal.dot(first.plane.normal) > 0.999 &&
           std::abs(plane.plane.distance - first.plane.distance) < 0.1;
  };
  ASSERT_EQ(std::count_if(all.planes.begin(), all.planes.end(), same), 1);
  problem_.excluded_planes = {{first.plane, {first.views.front().scan}}};
  STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult without, Align());
  EXPECT_EQ(std::count_if(without.planes.begin(), without.planes.end(), same), 0);
  EXPECT_THAT(without.planes, Not(IsEmpty()));
  EXPECT_EQ(without.rounds.back().planes, without.planes.size());
  // Where no scan supports it, it is another one.
  problem_.excluded_planes[0].nodes.clear();
  STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult others, Align());
  EXPECT_EQ(others.planes.size(), all.planes.size());
}

TEST_F(AlignmentTest, WhatWasMeasuredAtIngestStaysInForce) {
  Matrix6d sure = 1e6 * Matrix6d::Identity();
  RandomPoses random(5);
  for (ScanPair& pair : problem_.pairs) {
    pair.measured =
        MeasuredPose{Retract(TrueStep(pair.i, pair.j), random.Step(0.0005, 0.005)), sure};
  }
  Disturb(5, 0.003, 0.02);
  STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult result, Align());
  for (const ScanPair& pair : problem_.pairs) {
    const auto same = [&pair](const RelativePoseTerm& term) {
      return term.i == pair.i && term.j == pair.j &&
             term.T_i_j.isApprox(pair.measured->T_i_j, 1e-12);
    };
    EXPECT_EQ(std::count_if(result.measured.begin(), result.measured.end(), same), 1)
        << pair.i << " " << pair.j;
  }
  // Nothing of a robot's own way is measured again.
  const std::size_t own = std::count_if(
      result.measured.begin(), result.measured.end(), [](const RelativePoseTerm& term) {
        return (term.i < YardScans::kFirst) == (term.j < YardScans::kFirst);
      });
  EXPECT_EQ(own, problem_.pairs.size());
  EXPECT_LT(ErrorsOf(result.T_map_scan).max_m, 0.03);
}

TEST_F(AlignmentTest, WhatThePosesContradictIsMeasuredAgain) {
  for (ScanPair& pair : problem_.pairs) {
    Pose wrong = TrueStep(pair.i, pair.j);
    if (pair.j == 3) wrong.translation().x() += 0.5;
    pair.measured = MeasuredPose{wrong, 1e6 * Matrix6d::Identity()};
  }
  STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult result, Align());
  for (const RelativePoseTerm& term : result.measured) {
    EXPECT_LT((TrueStep(term.i, term.j).inverse() * term.T_i_j).translation().norm(), 0.1);
  }
  const bool again =
      std::any_of(result.measured.begin(), result.measured.end(), [](const RelativePoseTerm& term) {
        return term.j == 3 && term.i < 3;
      });
  EXPECT_TRUE(again);
  EXPECT_LT(ErrorsOf(result.T_map_scan).max_m, 0.02);
}

TEST_F(AlignmentTest, AFalseClosureMovesNothingUnlessItMustBeTrue) {
  RelativePoseTerm lie{1, 8, TrueStep(1, 8), 1e6 * Matrix6d::Identity(), true};
  lie.T_i_j.translation().y() += 3.0;
  problem_.relative = {lie};
  Disturb(6);
  STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult result, Align());
  EXPECT_LT(ErrorsOf(result.T_map_scan).max_m, 0.02);
  ASSERT_FALSE(result.rejected.empty());
  EXPECT_TRUE(result.rejected[0].given);
  EXPECT_EQ(result.rejected[0].term.j, 8U);
  EXPECT_GT(result.rejected[0].chi2, 1e5);
  for (std::size_t k = 1; k < result.rejected.size(); ++k) {
    EXPECT_FALSE(result.rejected[k].given);
  }
  for (const RelativePoseTerm& term : result.measured) {
    EXPECT_FALSE(term.T_i_j.isApprox(lie.T_i_j));  // it was given
  }
  problem_.relative[0].may_be_false = false;
  options_.max_rounds = 1;
  STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult believed, Align());
  EXPECT_GT(ErrorsOf(believed.T_map_scan).max_m, 0.5);
}

TEST_F(AlignmentTest, ExcludedPairsAreNotMeasured) {
  for (std::size_t i = 0; i < YardScans::kFirst; ++i) {
    for (std::size_t j = YardScans::kFirst; j < YardScans::kScans; ++j) {
      problem_.excluded_pairs.emplace_back(j, i);
    }
  }
  STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult result, Align());
  for (const RelativePoseTerm& term : result.measured) {
    EXPECT_EQ(term.i < YardScans::kFirst, term.j < YardScans::kFirst) << term.i << " " << term.j;
  }
  EXPECT_THAT(result.parts, Each(0U));  // they are said to be in one frame
}

TEST_F(AlignmentTest, RobotsThatNothingJoinsAreNotMatchedAndStayWhereTheyAre) {
  problem_.relative.clear();
  for (std::size_t k = 0; k < YardScans::kFirst; ++k) {
    problem_.T_map_scan[k].translation().x() += 0.3;
  }
  STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult result, Align());
  for (const std::size_t first : {std::size_t{0}, YardScans::kFirst}) {
    EXPECT_TRUE(result.T_map_scan[first].isApprox(problem_.T_map_scan[first], 1e-12)) << first;
  }
  ASSERT_EQ(result.parts.size(), std::size_t{YardScans::kScans});
  for (std::size_t k = 0; k < YardScans::kScans; ++k) {
    EXPECT_EQ(result.parts[k], k < YardScans::kFirst ? 0U : YardScans::kFirst) << k;
  }
}

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

TEST_F(AlignmentTest, TheResultDoesNotDependOnTheOrderOfWork) {
  Disturb(7);
  options_.max_rounds = 2;
  STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult forward, Align());
  const auto backward = [](std::size_t count,
                           absl::FunctionRef<absl::Status(std::size_t)> body) -> absl::Status {
    absl::Status status;
    for (std::size_t k = count; k > 0; --k) status.Update(body(k - 1));
    return status;
  };
  STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult result, Align(yard(), backward));
  ASSERT_EQ(result.T_map_scan.size(), forward.T_map_scan.size());
  for (std::size_t k = 0; k < result.T_map_scan.size(); ++k) {
    EXPECT_EQ(result.T_map_scan[k].matrix(), forward.T_map_scan[k].matrix()) << k;
  }
  EXPECT_EQ(result.measured.size(), forward.measured.size());
  EXPECT_EQ(result.planes.size(), forward.planes.size());
}

TEST_F(AlignmentTest, FixedScansStayAndPriorsMoveTheWorld) {
  const Pose shift = MakePose(Eigen::Quaterniond::Identity(), {0.3, 0.0, 0.0});
  for (const std::size_t node : {0, 5, 9}) {
    problem_.priors.push_back({node, shift * yard().truth()[node], 1e8 * Matrix6d::Identity()});
  }
  STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult moved, Align());
  for (std::size_t k = 0; k < YardScans::kScans; ++k) {
    const Pose expected = shift * yard().truth()[k];
    EXPECT_LT((moved.T_map_scan[k].translation() - expected.translation()).norm(), 0.03) << k;
  }
  problem_.fixed.assign(YardScans::kScans, true);
  STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult held, Align());
  for (std::size_t k = 0; k < YardScans::kScans; ++k) {
    EXPECT_TRUE(held.T_map_scan[k].isApprox(yard().truth()[k], 1e-12)) << k;
  }
  EXPECT_EQ(held.termination, AlignmentTermination::kSettled);
  EXPECT_EQ(held.rounds.size(), 1U);
}

// One scan's features or planes cannot be had.
class SpoiltSource final : public AlignmentSource {
 public:
  SpoiltSource(AlignmentSource& whole, std::size_t node, absl::Status error)
      : whole_(whole), node_(node), error_(std::move(error)) {}
  absl::StatusOr<std::shared_ptr<const ScanFeatures>> Features(std::size_t node) override {
    if (node == node_) return error_;
    return whole_.Features(node);
  }
  absl::StatusOr<std::shared_ptr<const ScanPlanes>> Planes(std::size_t node) override {
    if (node == node_) return error_;
    return whole_.Planes(node);
  }

 private:
  AlignmentSource& whole_;
  const std::size_t node_;
  const absl::Status error_;
};

TEST_F(AlignmentTest, ADamagedScanKeepsItsPlaceOnItsWayAndHarmsNoOther) {
  SpoiltSource spoilt(yard(), 3, absl::DataLossError("points of scan 3"));
  Disturb(8);
  STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult result, Align(spoilt));
  for (const RelativePoseTerm& term : result.measured) {
    if (term.i != 3 && term.j != 3) continue;
    EXPECT_EQ(term.i, 2U);  // what its odometry says; the one after is held by others
    EXPECT_EQ(term.j, 3U);
  }
  const Pose step = problem_.T_map_scan[2].inverse() * problem_.T_map_scan[3];
  EXPECT_TRUE((result.T_map_scan[2].inverse() * result.T_map_scan[3]).isApprox(step, 1e-6));
  for (std::size_t k = 1; k < YardScans::kScans; ++k) {
    if (k == 3) continue;
    const Pose off = yard().truth()[k].inverse() * result.T_map_scan[k];
    EXPECT_LT(off.translation().norm(), 0.02) << k;
  }
}

TEST_F(AlignmentTest, ItEndsWithWhatItIsToldToEndWith) {
  SpoiltSource broken(yard(), 3, absl::UnavailableError("no disk"));
  EXPECT_THAT(Align(broken), StatusIs(Code::kUnavailable, HasSubstr("no disk")));
  const Stop stop;
  stop.Request();
  EXPECT_THAT(
      AlignScans(
          problem_, yard(), options_, ForEachInTurn, [](double) { return absl::OkStatus(); }, stop),
      StatusIs(Code::kCancelled, _));
  std::vector<double> told;
  EXPECT_THAT(AlignScans(
                  problem_,
                  yard(),
                  options_,
                  ForEachInTurn,
                  [&told](double progress) {
                    told.push_back(progress);
                    return progress > 0.0 ? absl::AbortedError("enough") : absl::OkStatus();
                  },
                  Stop()),
              StatusIs(Code::kAborted, "enough"));
  EXPECT_THAT(told, ::testing::ElementsAre(0.0, Gt(0.0)));
}

TEST_F(AlignmentTest, BadProblemsAreRefused) {
  const AlignmentProblem good = problem_;
  const auto refused = [this, &good](const char* what) {
    EXPECT_THAT(Align(), StatusIs(Code::kInvalidArgument, HasSubstr(what)));
    problem_ = good;
  };
  problem_.pairs.push_back({2, YardScans::kScans});
  refused("pair");
  problem_.pairs.push_back({2, 2});
  refused("pair");
  problem_.trajectories[0].push_back(YardScans::kScans);
  refused("trajectories");
  problem_.trajectories[1].push_back(0);
  refused("trajectories");
  problem_.trajectories[0].pop_back();
  refused("trajectories");
  problem_.T_map_scan[4].translation().x() = std::numeric_limits<double>::quiet_NaN();
  refused("");
}

TEST(AlignmentOfNothingTest, AnEmptyWorldIsSettled) {
  class Nothing final : public AlignmentSource {
    absl::StatusOr<std::shared_ptr<const ScanFeatures>> Features(std::size_t) override {
      return absl::InternalError("asked");
    }
    absl::StatusOr<std::shared_ptr<const ScanPlanes>> Planes(std::size_t) override {
      return absl::InternalError("asked");
    }
  } nothing;
  STRATA_ASSERT_OK_AND_ASSIGN(
      const AlignmentResult result,
      AlignScans(
          {}, nothing, {}, ForEachInTurn, [](double) { return absl::OkStatus(); }, Stop()));
  EXPECT_THAT(result.T_map_scan, IsEmpty());
  EXPECT_EQ(result.termination, AlignmentTermination::kSettled);
}

}  // namespace
}  // namespace strata
