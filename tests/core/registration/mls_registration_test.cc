#include "core/registration/mls_registration.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <random>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Eigenvalues>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/cloud/sensor_model.h"
#include "core/mls/build.h"
#include "core/mls/features.h"
#include "tests/support/data_dir.h"
#include "tests/support/pcd.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using testing::StatusIs;

// A yard: ground, two walls at a right angle, a shed and posts, drawn once and scanned with noise.
PointCloud Yard(const Pose& T_world_scan, std::uint64_t seed, bool walls = true) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> wide(-15.0, 15.0);
  std::uniform_real_distribution<double> tall(0.0, 4.0);
  std::normal_distribution<double> noise(0.0, 0.01);
  const Pose T_scan_world = T_world_scan.inverse();
  PointCloud cloud;
  const auto add = [&](double x, double y, double z) {
    cloud.points.push_back((T_scan_world * Eigen::Vector3d(x, y, z)).cast<float>());
  };
  for (int i = 0; i < 60000; ++i) add(wide(random), wide(random), noise(random));
  for (int i = 0; walls && i < 60000; ++i) {
    const double along = wide(random);
    const double z = tall(random);
    switch (i % 4) {
      case 0:
        add(along, 12.0 + noise(random), z);
        break;
      case 1:
        add(-11.0 + noise(random), along, z);
        break;
      case 2:  // shed
        add(4.0 + noise(random), 0.2 * along, 0.6 * z);
        break;
      default:  // posts
        add(std::round(along / 5.0) * 5.0 + noise(random), -6.0 + noise(random), z);
    }
  }
  return cloud;
}

ScanFeatures Features(const PointCloud& cloud, const ScanFeatureOptions& options = {}) {
  return ScanFeatures::FromMap(
      BuildMlsMap(cloud, Pose::Identity(), SensorModel(), MlsParameters())->map, options);
}

RegistrationTarget TargetOf(const ScanFeatures& features, const Pose& T = Pose::Identity()) {
  const PlacedScan placed[] = {{&features, T}};
  return RegistrationTarget(placed, {.centre = T.translation()});
}

Pose Step(double roll, double pitch, double yaw, double x, double y, double z) {
  Vector6d step;
  step << roll, pitch, yaw, x, y, z;
  return Retract(Pose::Identity(), step);
}

const Pose kTruth = Step(0.01, -0.02, 0.1, 0.8, -0.5, 0.05);
const Pose kOff = Step(0.03, 0.02, -0.04, 0.3, 0.3, -0.25);

TEST(ScanFeaturesTest, OneFeatureAPatchAndFourAMetreOfWall) {
  MlsMap map;
  const std::uint8_t sigma = SigmaCode(0.01);
  map.tiles.resize(1);
  const std::uint16_t cell = CellInTile({3, 5});
  Patch wall = PatchOfMeasurement(cell, 0, sigma);
  for (int z = 0; z <= 2 * kTicksPerMetre; z += kTicksPerMetre / 2) {
    wall = Join(wall, PatchOfMeasurement(cell, z, sigma), map.parameters);
  }
  map.tiles[0].patches = {wall, PatchOfMeasurement(cell, 4 * kTicksPerMetre, sigma)};
  map.tiles[0].IndexRows();
  const ScanFeatures features = ScanFeatures::FromMap(map);
  ASSERT_EQ(features.points(FeatureClass::kTraversable).size(), 1U);
  EXPECT_TRUE(features.points(FeatureClass::kTraversable)[0].isApprox(
      Eigen::Vector3f(0.35F, 0.55F, 4.0F), 1e-6F));
  ASSERT_EQ(features.points(FeatureClass::kVertical).size(), 8U);
  EXPECT_NEAR(features.points(FeatureClass::kVertical)[0].z(), 0.125, 1e-6);
  EXPECT_NEAR(features.points(FeatureClass::kVertical)[7].z(), 1.875, 1e-6);
}

TEST(ScanFeaturesTest, SampleIsReproducedAndHasNormals) {
  const PointCloud yard = Yard(Pose::Identity(), 1);
  const ScanFeatures a = Features(yard);
  const ScanFeatures b = Features(yard);
  ASSERT_EQ(a.sample().size(), 2000U);
  int upright = 0;
  int horizontal = 0;
  for (std::size_t i = 0; i < a.sample().size(); ++i) {
    EXPECT_EQ(a.sample()[i].element.point, b.sample()[i].element.point);
    EXPECT_EQ(a.sample()[i].element.normal, b.sample()[i].element.normal);
    if (a.sample()[i].feature_class != FeatureClass::kTraversable) continue;
    ++horizontal;
    upright += static_cast<int>(std::abs(a.sample()[i].element.normal.z()) > 0.95F);
  }
  EXPECT_GT(upright, 0.9 * horizontal);
}

TEST(ScanFeaturesTest, FarFeaturesAreLeftOut) {
  ScanFeatureOptions options;
  options.max_range_m = 5.0;
  const ScanFeatures features = Features(Yard(Pose::Identity(), 1), options);
  for (const auto c : {FeatureClass::kTraversable, FeatureClass::kVertical}) {
    for (const Eigen::Vector3f& p : features.points(c)) EXPECT_LE(p.head<2>().norm(), 5.0F);
  }
}

TEST(ScanFeaturesTest, AnnotationMakesThreeClasses) {
  const MlsMap map =
      BuildMlsMap(Yard(Pose::Identity(), 1), Pose::Identity(), SensorModel(), MlsParameters())->map;
  // Every other patch cannot be driven on.
  std::vector<Traversability> annotation(map.patch_count(), Traversability::kTraversable);
  for (std::size_t i = 0; i < annotation.size(); i += 2) {
    annotation[i] = Traversability::kNonTraversable;
  }
  STRATA_ASSERT_OK_AND_ASSIGN(const auto extracted, ExtractFeatures(map, {}, annotation));
  const ScanFeatures features = ScanFeatures::FromFeatures(extracted);
  std::size_t horizontal = 0;
  for (const MlsTile& tile : map.tiles) {
    for (const Patch& patch : tile.patches)
      horizontal += static_cast<std::size_t>(!patch.vertical());
  }
  const std::size_t free = features.points(FeatureClass::kTraversable).size();
  const std::size_t blocked = features.points(FeatureClass::kNonTraversable).size();
  EXPECT_EQ(free + blocked, horizontal);
  EXPECT_GT(free, horizontal / 3);
  EXPECT_GT(blocked, horizontal / 3);
  EXPECT_GT(features.points(FeatureClass::kVertical).size(), 1000U);
  int sampled[kFeatureClasses] = {};
  for (const SampledFeature& s : features.sample()) ++sampled[static_cast<int>(s.feature_class)];
  EXPECT_GT(sampled[1], 100);
}

// The yard with one side of a deck of 10 × 10 m.
PointCloud YardWithDeck(const Pose& T_world_scan, std::uint64_t seed, double deck_z) {
  PointCloud cloud = Yard(T_world_scan, seed);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> across(-5.0, 5.0);
  std::normal_distribution<double> noise(0.0, 0.01);
  const Pose T_scan_world = T_world_scan.inverse();
  for (int i = 0; i < 60000; ++i) {
    const Eigen::Vector3d p(across(random), across(random), deck_z + noise(random));
    cloud.points.push_back((T_scan_world * p).cast<float>());
  }
  return cloud;
}

TEST(ScanFeaturesTest, WhatWasSeenFromBelowIsNotWhatWasSeenFromAbove) {
  const Pose T_world_below = Step(0, 0, 0, 1, 0, 1);
  const ScanFeatures below = Features(YardWithDeck(T_world_below, 1, 3.0));
  const auto at_the_deck = [&](FeatureClass c) {
    return std::ranges::count_if(
        below.points(c), [](const Eigen::Vector3f& p) { return std::abs(p.z() - 2.0F) < 0.1F; });
  };
  EXPECT_GT(at_the_deck(FeatureClass::kNonTraversable), 9000);
  EXPECT_LT(at_the_deck(FeatureClass::kTraversable), 90);
  // A sensor elsewhere than its frame's origin.
  ScanFeatureOptions options;
  options.sensor_origin = {0, 0, 5};
  const ScanFeatures above = Features(YardWithDeck(Pose::Identity(), 2, 3.4), options);
  EXPECT_THAT(above.points(FeatureClass::kNonTraversable), IsEmpty());
}

TEST(ScanFeaturesTest, WhatMayBePartOfACeilingIsNoGround) {
  PointCloud cloud = YardWithDeck(Step(0, 0, 0, 1, 0, 1), 1, 3.0);
  const std::size_t whole = cloud.size();
  for (int i = 0; i < 40; ++i) {  // single points of the same deck, far off, and twigs above it
    cloud.points.emplace_back(
        20.0F + 2.0F * static_cast<float>(i % 8), 2.0F * static_cast<float>(i / 8), 2.0F);
    cloud.points.emplace_back(
        20.0F + 2.0F * static_cast<float>(i % 8), 2.0F * static_cast<float>(i / 8), 4.0F);
  }
  ASSERT_GT(cloud.size(), whole);
  const ScanFeatures features = Features(cloud);
  const auto at = [&](float z) {
    return std::ranges::count_if(
        features.points(FeatureClass::kTraversable),
        [z](const Eigen::Vector3f& p) { return p.x() > 15.0F && std::abs(p.z() - z) < 0.1F; });
  };
  EXPECT_EQ(at(2.0F), 0);
  EXPECT_EQ(at(4.0F), 40);
}

TEST(ScanFeaturesTest, AHillsideIsSeenFromAbove) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> wide(-15.0, 15.0);
  std::normal_distribution<double> noise(0.0, 0.02);
  PointCloud hill;  // rises by 20 %: most of its upper half is above the sensor
  for (int i = 0; i < 60000; ++i) {
    const double x = wide(random);
    hill.points.emplace_back(
        Eigen::Vector3d(x, wide(random), 0.2 * x - 0.7 + noise(random)).cast<float>());
  }
  const ScanFeatures features = Features(hill);
  EXPECT_LT(features.points(FeatureClass::kNonTraversable).size(), features.size() / 20);
}

TEST(RegisterScanTest, UndersideOfADeckIsNotDrawnOntoItsTop) {
  const Pose T_world_below = Step(0, 0, 0, 1, 0, 1);
  const Pose T_world_above = Step(0, 0, 0, -1, 1, 5);
  const ScanFeatures below = Features(YardWithDeck(T_world_below, 1, 3.0));
  const ScanFeatures above = Features(YardWithDeck(T_world_above, 2, 3.15));
  const auto r = RegisterScan(below, TargetOf(above, T_world_above), T_world_below * kOff);
  EXPECT_LT((T_world_below.inverse() * r.T_target_source).translation().norm(), 0.01);
}

// A hut with walls of 0.1 m, drawn as a scan from outside and one from inside see it.
PointCloud Hut(double half_m, const Pose& T_world_scan, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> along(-half_m, half_m);
  std::uniform_real_distribution<double> tall(0.0, 2.5);
  std::normal_distribution<double> noise(0.0, 0.005);
  PointCloud cloud;
  const Pose T_scan_world = T_world_scan.inverse();
  for (int i = 0; i < 20000; ++i) {
    const double across = half_m + noise(random);
    const double a = along(random);
    const Eigen::Vector3d p = i % 2 == 0 ? Eigen::Vector3d(across, a, tall(random))
                                         : Eigen::Vector3d(a, across, tall(random));
    cloud.points.push_back((T_scan_world * p).cast<float>());
  }
  return cloud;
}

TEST(RegisterScanTest, TheTwoSidesOfAThinWallAreNotDrawnOntoEachOther) {
  const Pose outside = MakePose(Eigen::Quaterniond::Identity(), {6.0, 7.0, 1.2});
  const Pose inside = MakePose(Eigen::Quaterniond::Identity(), {0.0, 0.0, 1.2});
  const ScanFeatures from_outside = Features(Hut(3.0, outside, 1));
  const ScanFeatures from_inside = Features(Hut(2.9, inside, 2));
  const RegistrationTarget target = TargetOf(from_outside);
  const Pose truth = outside.inverse() * inside;
  const RegistrationResult result = RegisterScan(from_inside, target, truth);
  EXPECT_EQ(result.termination, Termination::kTooLittleOverlap);
  // Seen from the same side it is one.
  const ScanFeatures again = Features(Hut(3.0, outside, 3));
  EXPECT_TRUE(RegisterScan(again, target, Pose::Identity()).inliers > 500);
}

// The level surface of a deck as a scan sees it that was taken at `p_scan`, all of it a top: as the
// lines are that sparse beams draw on an underside.
ScanFeatures Deck(double z, const Eigen::Vector3d& p_scan) {
  std::array<std::vector<Eigen::Vector3f>, kFeatureClasses> points;
  for (int x = -40; x < 40; ++x) {
    for (int y = -10; y < 10; ++y) {
      points[0].push_back((Eigen::Vector3d(0.2 * x, 0.2 * y, z) - p_scan).cast<float>());
    }
  }
  return ScanFeatures::FromPoints(points);
}

TEST(RegisterScanTest, WhatSeveralScansSawFromBelowIsNotMatchedToATop) {
  const std::vector<Eigen::Vector3d> places = {{0.0, -3.0, 1.2}, {1.0, 3.0, 1.2}, {4.0, 0.0, 6.7}};
  const std::vector<ScanFeatures> scans = {
      Deck(5.15, places[0]), Deck(5.15, places[1]), Deck(5.5, places[2])};
  std::vector<PlacedScan> placed;
  for (std::size_t k = 0; k < scans.size(); ++k) {
    placed.push_back({&scans[k], Pose(Eigen::Translation3d(places[k]))});
  }
  const Pose above = MakePose(Eigen::Quaterniond::Identity(), {-1.0, 0.0, 6.7});
  const ScanFeatures source = Deck(5.5, above.translation());
  const RegistrationTarget from_below(std::span<const PlacedScan>(placed).first(2));
  EXPECT_EQ(RegisterScan(source, from_below, above).termination, Termination::kTooLittleOverlap);
  // Where one of them stood on the deck it is one.
  EXPECT_GT(RegisterScan(source, RegistrationTarget(placed), above).overlap, 0.95);
}

TEST(RegisterScanTest, ClassesAreMatchedAmongThemselvesOnly) {
  std::array<std::vector<Eigen::Vector3f>, kFeatureClasses> points;
  for (int i = 0; i < 400; ++i) {
    points[0].emplace_back(0.1F * (i % 20), 0.1F * (i / 20), 0.0F);
    points[1].emplace_back(0.1F * (i % 20), 0.1F * (i / 20), 1.0F);
    points[2].emplace_back(0.1F * (i % 20), 3.0F, 0.1F * (i / 20));
  }
  const ScanFeatures source = ScanFeatures::FromPoints(points);
  std::swap(points[0], points[1]);  // what was free is blocked: only the wall is left
  const ScanFeatures target = ScanFeatures::FromPoints(points);
  MlsRegistrationOptions options;
  options.metric = MlsErrorMetric::kPointToPoint;
  options.max_samples = 0;
  options.initial_gate_m = 0.5;
  options.min_overlap = 0.5;
  const auto r = RegisterScan(source, TargetOf(target), Pose::Identity(), options);
  EXPECT_EQ(r.termination, Termination::kTooLittleOverlap);
  EXPECT_NEAR(r.overlap, 1.0 / 3.0, 1e-9);
  EXPECT_EQ(RegisterScan(source, TargetOf(source), Pose::Identity(), options).overlap, 1.0);
}

class MlsMetricTest : public ::testing::TestWithParam<MlsErrorMetric> {};

TEST_P(MlsMetricTest, PlantedPoseIsFoundBothWays) {
  const ScanFeatures target = Features(Yard(Pose::Identity(), 1));
  const ScanFeatures source = Features(Yard(kTruth, 2));
  MlsRegistrationOptions options;
  options.metric = GetParam();
  options.max_iterations = 100;
  const double bound = GetParam() == MlsErrorMetric::kPlaneToPlane ? 0.01 : 0.1;
  const auto there = RegisterScan(source, TargetOf(target), kTruth * kOff, options);
  EXPECT_LT((kTruth.inverse() * there.T_target_source).translation().norm(), bound);
  EXPECT_LT(RotationAngleRad(kTruth.inverse() * there.T_target_source), 0.2 * bound);
  EXPECT_GT(there.overlap, 0.8);
  const auto back = RegisterScan(target, TargetOf(source), kTruth.inverse() * kOff, options);
  EXPECT_LT((kTruth * back.T_target_source).translation().norm(), bound);
}

INSTANTIATE_TEST_SUITE_P(Metrics,
                         MlsMetricTest,
                         ::testing::Values(MlsErrorMetric::kPlaneToPlane,
                                           MlsErrorMetric::kPointToPoint));

TEST(RegisterScanTest, ConvergesAndSaysSo) {
  const ScanFeatures target = Features(Yard(Pose::Identity(), 1));
  const auto r = RegisterScan(Features(Yard(kTruth, 2)), TargetOf(target), kTruth * kOff);
  EXPECT_EQ(r.termination, Termination::kConverged);
  EXPECT_LT(r.rms_m, 0.1);
  EXPECT_THAT(r.degenerate_directions, IsEmpty());
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<Matrix6d>(r.information).eigenvalues()[0], 0.0);
}

TEST(RegisterScanTest, WhatSurfacesHoldIsNotDrawnToTheGuess) {
  const ScanFeatures target = Features(Yard(Pose::Identity(), 1));
  MlsRegistrationOptions options;
  options.guess_sigma_m = 0.02;
  options.guess_sigma_rad = 0.003;
  const Pose guess = kTruth * Step(0.006, 0.004, -0.008, 0.04, 0.04, -0.03);
  const auto r = RegisterScan(Features(Yard(kTruth, 2)), TargetOf(target), guess, options);
  EXPECT_EQ(r.termination, Termination::kConverged);
  EXPECT_LT((kTruth.inverse() * r.T_target_source).translation().norm(), 0.01);
}

TEST(RegisterScanTest, SeveralScansMakeOneTarget) {
  std::vector<ScanFeatures> scans;
  std::vector<Pose> poses;
  for (int i = 0; i < 4; ++i) {
    poses.push_back(Step(0, 0, 0.2 * i, i - 1.5, 0.5 * i, 0));
    scans.push_back(Features(Yard(poses.back(), 10 + i)));
  }
  std::vector<PlacedScan> placed;
  for (int i = 0; i < 4; ++i) placed.push_back({&scans[i], poses[i]});
  const RegistrationTarget target(placed);
  EXPECT_LT(target.size(), scans[0].size() + scans[1].size() + scans[2].size() + scans[3].size());
  const auto r = RegisterScan(Features(Yard(kTruth, 2)), target, kTruth * kOff);
  EXPECT_EQ(r.termination, Termination::kConverged);
  EXPECT_LT((kTruth.inverse() * r.T_target_source).translation().norm(), 0.01);
}

TEST(RegisterScanTest, FarFromTheOriginGivesTheSame) {
  const ScanFeatures target = Features(Yard(Pose::Identity(), 1));
  const ScanFeatures source = Features(Yard(kTruth, 2));
  const Pose T_map_local = MakePose(Eigen::Quaterniond::Identity(), {4.5e5, 5.4e6, 300.0});
  const auto near = RegisterScan(source, TargetOf(target), kTruth * kOff);
  const auto far = RegisterScan(source, TargetOf(target, T_map_local), T_map_local * kTruth * kOff);
  const Pose difference = (T_map_local * near.T_target_source).inverse() * far.T_target_source;
  EXPECT_LT(difference.translation().norm(), 1e-3);
}

TEST(RegisterScanTest, BareGroundIsDegenerateAndDoesNotSlide) {
  const ScanFeatures ground = Features(Yard(Pose::Identity(), 1, /*walls=*/false));
  MlsRegistrationOptions options;
  options.tangent_sigma_m = 2.0;  // or cell centres would pull sideways
  const Pose guess = Step(0, 0, 0, 0, 0, 0.3);
  const auto r = RegisterScan(ground, TargetOf(ground), guess, options);
  EXPECT_EQ(r.termination, Termination::kDegenerate);
  EXPECT_THAT(r.degenerate_directions, Not(IsEmpty()));
  EXPECT_NEAR(r.T_target_source.translation().z(), 0.0, 0.02);
  EXPECT_NEAR(r.T_target_source.translation().head<2>().norm(), 0.0, 0.05);
}

TEST(RegisterScanTest, ElsewhereIsTooLittleOverlap) {
  const ScanFeatures yard = Features(Yard(Pose::Identity(), 1));
  const Pose guess = Step(0, 0, 0, 28, 28, 0);
  const auto r = RegisterScan(yard, TargetOf(yard), guess);
  EXPECT_EQ(r.termination, Termination::kTooLittleOverlap);
  EXPECT_TRUE(r.T_target_source.isApprox(guess));
}

TEST(RegisterScanTest, NothingOverlapsWithNothing) {
  const ScanFeatures none;
  const ScanFeatures yard = Features(Yard(Pose::Identity(), 1));
  for (const MlsErrorMetric metric :
       {MlsErrorMetric::kPlaneToPlane, MlsErrorMetric::kPointToPoint}) {
    MlsRegistrationOptions options;
    options.metric = metric;
    EXPECT_EQ(RegisterScan(none, TargetOf(yard), Pose::Identity(), options).termination,
              Termination::kTooLittleOverlap);
    EXPECT_EQ(RegisterScan(yard, RegistrationTarget(), Pose::Identity(), options).termination,
              Termination::kTooLittleOverlap);
  }
}

TEST(RegisterScanTest, TooFarAMoveIsDiverged) {
  const ScanFeatures target = Features(Yard(Pose::Identity(), 1));
  MlsRegistrationOptions options;
  options.max_translation_m = 0.05;
  const auto r = RegisterScan(Features(Yard(kTruth, 2)), TargetOf(target), kTruth * kOff, options);
  EXPECT_EQ(r.termination, Termination::kDiverged);
  EXPECT_TRUE(r.T_target_source.isApprox(kTruth * kOff));
}

TEST(RegisterScanTest, InfiniteGuessIsDiverged) {
  const ScanFeatures yard = Features(Yard(Pose::Identity(), 1));
  Pose guess = Pose::Identity();
  guess.translation().x() = std::numeric_limits<double>::infinity();
  EXPECT_EQ(RegisterScan(yard, TargetOf(yard), guess).termination, Termination::kDiverged);
}

TEST(RegistrationOptionsTest, ValidateNamesEveryViolation) {
  STRATA_EXPECT_OK(MlsRegistrationOptions().Validate());
  STRATA_EXPECT_OK(ScanFeatureOptions().Validate());
  STRATA_EXPECT_OK(TargetOptions().Validate());
  MlsRegistrationOptions options;
  options.final_gate_m = 3.0;
  options.min_inliers = 1;
  EXPECT_THAT(options.Validate(),
              StatusIs(absl::StatusCode::kInvalidArgument,
                       AllOf(HasSubstr("final_gate_m is 3, must be in [0.001, 2]"),
                             HasSubstr("min_inliers is 1"))));
  ScanFeatureOptions features;
  features.neighbours = 100;
  EXPECT_THAT(features.Validate(),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("neighbours is 100")));
}

TEST(RegisterScanTest, RecordedDriveAgreesWithItsReference) {
  STRATA_REQUIRE_DATA(path, "kitti_city_drive");
  STRATA_ASSERT_OK_AND_ASSIGN(const auto poses,
                              testing::ReadIndexedPoses(path / "poses_reference_icp.txt"));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto a, testing::ReadBinaryPcd(path / "scans" / "003.pcd"));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto b, testing::ReadBinaryPcd(path / "scans" / "006.pcd"));
  const Pose truth = poses.at(3).T_world_scan.inverse() * poses.at(6).T_world_scan;
  const auto r = RegisterScan(Features(b), TargetOf(Features(a)), truth * kOff);
  EXPECT_EQ(r.termination, Termination::kConverged);
  EXPECT_LT((truth.inverse() * r.T_target_source).translation().norm(), 0.03);
}

}  // namespace
}  // namespace strata
