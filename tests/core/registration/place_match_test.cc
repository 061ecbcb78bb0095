#include "core/registration/place_match.h"

#include <numbers>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/registration/place_descriptor.h"
#include "tests/core/registration/place_scans.h"
#include "tests/support/data_dir.h"
#include "tests/support/pcd.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using testing::Box;
using ::testing::HasSubstr;
using testing::MapAt;
using testing::Scene;
using testing::StandingAt;
using testing::StatusIs;

PlaceHypothesis Around(const Pose& T, double radius_m, double height_m, double heading_rad) {
  return {T, radius_m, height_m, heading_rad};
}

void ExpectNear(const Pose& truth, const Pose& T, double metres, double radians) {
  const Pose error = truth.inverse() * T;
  EXPECT_LT(error.translation().norm(), metres);
  EXPECT_LT(RotationAngleRad(error), radians);
}

class PlaceMatchTest : public ::testing::Test {
 protected:
  static ScanFeatures FeaturesAt(const Scene& scene, const Pose& T, std::uint64_t seed) {
    return ScanFeatures::FromMap(MapAt(scene, T, seed));
  }
  static Pose Off(double yaw, double x, double y, double z) {
    Vector6d step;
    step << 0.0, 0.0, yaw, x, y, z;
    return Retract(Pose::Identity(), step);
  }
};

TEST_F(PlaceMatchTest, FindsThePoseFromARoughGuess) {
  const testing::World world = testing::CampusWorld();
  const Pose T_i = StandingAt(world.scene, 0, 0, 50, 0.2);
  const Pose T_j = StandingAt(world.scene, 4, 1, 50, 1.4);
  const ScanFeatures there = FeaturesAt(world.scene, T_i, 1);
  const ScanFeatures here = FeaturesAt(world.scene, T_j, 2);
  const SeenScan target[] = {{&there}};
  const Pose T_i_j = T_i.inverse() * T_j;
  const PlaceHypothesis guess[] = {Around(T_i_j * Off(0.2, 5.0, -4.0, 1.5), 10.0, 3.0, 0.3)};
  const PlaceMatch match = MatchPlace({&here}, target, guess);
  EXPECT_TRUE(match.matched()) << ToString(match.verdict) << " overlap " << match.overlap;
  ExpectNear(T_i_j, match.T_target_source, 0.1, 0.01);
  EXPECT_GT(match.confidence, 0.2);
  EXPECT_GT(match.information(3, 3), 1.0);
}

TEST_F(PlaceMatchTest, HeadingsOfTheDescriptorAreEnoughOfAGuess) {
  const testing::World world = testing::CampusWorld();
  const Pose T_i = StandingAt(world.scene, 0, 0, 50, 0.2);
  const Pose T_j = StandingAt(world.scene, 3, -1, 50, -2.1);
  const MlsMap map_i = MapAt(world.scene, T_i, 1);
  const MlsMap map_j = MapAt(world.scene, T_j, 2);
  const PlaceSimilarity alike = ComparePlaces(DescribePlace(map_i), DescribePlace(map_j));
  const std::vector<PlaceHypothesis> guesses =
      HypothesesOf(alike, Eigen::Matrix3d::Identity(), Eigen::Matrix3d::Identity());
  ASSERT_EQ(guesses.size(), 2U);
  const ScanFeatures there = ScanFeatures::FromMap(map_i);
  const ScanFeatures here = ScanFeatures::FromMap(map_j);
  const SeenScan target[] = {{&there}};
  const PlaceMatch match = MatchPlace({&here}, target, guesses);
  EXPECT_TRUE(match.matched()) << ToString(match.verdict);
  ExpectNear(T_i.inverse() * T_j, match.T_target_source, 0.1, 0.01);
}

// By a scan a pace from others that made a map; then turned, and at another place.
TEST_F(PlaceMatchTest, AScanAgreesWithAMapWhereItWasTaken) {
  const testing::World world = testing::CampusWorld();
  const Pose T_map_i = StandingAt(world.scene, 0, 0, 50, 0.2);
  const ScanFeatures surfaces = FeaturesAt(world.scene, T_map_i, 1);
  const Pose T_i_j = T_map_i.inverse() * StandingAt(world.scene, 2, 1, 50, 1.4);
  const ScanFeatures scan = FeaturesAt(world.scene, T_map_i * T_i_j, 2);
  const PlacedScan placed[] = {{&surfaces, Pose::Identity()}};
  const RegistrationTarget target(placed, {.from_one_place = false});
  EXPECT_TRUE(target.sensors().empty());
  const MapAgreement there = AgreementWithMap({&scan, T_i_j}, surfaces, target, 0.2);
  EXPECT_GT(there.overlap, 0.8);
  EXPECT_GT(there.close, 0.7);
  EXPECT_LT(there.contradiction, 0.05);
  // Ground holds height and tilt, walls and trees the rest.
  const Eigen::Matrix3d held = there.held.bottomRightCorner<3, 3>();
  EXPECT_NEAR(held.trace(), 1.0, 1e-6);  // of unit normals
  EXPECT_GT(held(2, 2), held(0, 0));
  EXPECT_GT(held(0, 0), 0.01);
  const MapAgreement turned =
      AgreementWithMap({&scan, T_i_j * Off(0.5, 0, 0, 0)}, surfaces, target, 0.2);
  EXPECT_LT(turned.overlap * turned.close, 0.8 * there.overlap * there.close);
  const MapAgreement off =
      AgreementWithMap({&scan, T_i_j * Off(2.0, 15, -9, 0)}, surfaces, target, 0.2);
  EXPECT_LT(off.overlap, there.overlap);
  const MapAgreement nowhere =
      AgreementWithMap({&scan, Off(0.0, 500, 0, 0)}, surfaces, target, 0.2);
  EXPECT_EQ(nowhere.overlap, 0.0);
  EXPECT_TRUE(nowhere.held.isZero());
}

TEST_F(PlaceMatchTest, AnotherPlaceIsRefused) {
  const testing::World world = testing::CampusWorld();
  const ScanFeatures there = FeaturesAt(world.scene, StandingAt(world.scene, 0, 0, 50, 0), 1);
  const SeenScan target[] = {{&there}};
  for (const double x : {-90.0, -50.0, 50.0, 90.0}) {
    const ScanFeatures here = FeaturesAt(world.scene, StandingAt(world.scene, x, 0, 50, 0), 2);
    const PlaceHypothesis guess[] = {Around(Pose::Identity(), 15.0, 3.0, 0.5)};
    const PlaceMatch match = MatchPlace({&here}, target, guess);
    EXPECT_FALSE(match.matched()) << x << " confidence " << match.confidence;
    EXPECT_EQ(match.confidence, 0.0);
  }
}

// Both storeys are in the target; the scan fits on either.
TEST_F(PlaceMatchTest, StoreysThatLookAlikeAreAmbiguous) {
  Scene scene;
  for (const double floor : {0.0, 4.0, 8.0}) {
    scene.Add(Box({-20, -15, floor - 0.3}, {20, 15, floor}));
    for (const double y : {-15.0, 15.0}) {
      scene.Add(Box({-20, y - 0.1, floor}, {20, y + 0.1, floor + 3.7}));
    }
    for (const double x : {-20.0, 20.0}) {
      scene.Add(Box({x - 0.1, -15, floor}, {x + 0.1, 15, floor + 3.7}));
    }
    scene.Add(Box({4, 3, floor}, {6, 8, floor + 3.7}));
    scene.Add(Box({-12, -9, floor}, {-11, -4, floor + 3.7}));
  }
  scene.Build();
  const Pose T_low = StandingAt(scene, 0, 0, 2, 0);
  const Pose T_high = StandingAt(scene, 0, 0, 6, 0);
  const Pose T_here = StandingAt(scene, 2, -2, 2, 0.6);
  const ScanFeatures low = FeaturesAt(scene, T_low, 1);
  const ScanFeatures high = FeaturesAt(scene, T_high, 2);
  const ScanFeatures here = FeaturesAt(scene, T_here, 3);
  const SeenScan both[] = {{&low, T_low}, {&high, T_high}};
  const PlaceHypothesis anywhere[] = {Around(T_low, 5.0, 6.0, 0.8)};
  EXPECT_EQ(MatchPlace({&here}, both, anywhere).verdict, PlaceVerdict::kAmbiguous);
  // Who knows the storey knows the place.
  const PlaceHypothesis below[] = {Around(T_low, 5.0, 1.0, 0.8)};
  const PlaceMatch match = MatchPlace({&here}, both, below);
  EXPECT_TRUE(match.matched()) << ToString(match.verdict);
  ExpectNear(T_here, match.T_target_source, 0.1, 0.01);
}

// Nothing in it tells how far along one stands: neither in a wide window nor in a narrow one.
TEST_F(PlaceMatchTest, ACorridorTellsNoPlace) {
  Scene scene;
  scene.Add(Box({-80, -3, -0.3}, {80, 3, 0}));
  scene.Add(Box({-80, 2, 0}, {80, 2.2, 3}));
  scene.Add(Box({-80, -2.2, 0}, {80, -2, 3}));
  scene.Build();
  const ScanFeatures there = FeaturesAt(scene, StandingAt(scene, 0, 0, 2, 0), 1);
  const ScanFeatures here = FeaturesAt(scene, StandingAt(scene, 3, 0, 2, 0), 2);
  const SeenScan target[] = {{&there}};
  for (const double radius : {0.0, 1.0, 3.0, 10.0}) {
    for (const double off : {0.0, 1.0, 2.0}) {
      const PlaceHypothesis guess[] = {Around(Off(0.0, 3.0 - off, 0.0, 0.0), radius, 1.0, 0.2)};
      const PlaceMatch match = MatchPlace({&here}, target, guess);
      EXPECT_FALSE(match.matched())
          << radius << " m around " << off << " m off, hold " << match.hold << " at "
          << match.T_target_source.translation().transpose();
    }
  }
}

TEST_F(PlaceMatchTest, ScansOfOnePlaceDoNotContradictEachOtherAndOfTwoDo) {
  const testing::World campus = testing::CampusWorld();
  const Pose T_a = StandingAt(campus.scene, 0, 0, 50, 0.2);
  const Pose T_b = StandingAt(campus.scene, 4, 1, 50, 1.4);
  const ScanFeatures a = FeaturesAt(campus.scene, T_a, 1);
  const ScanFeatures b = FeaturesAt(campus.scene, T_b, 2);
  EXPECT_LT(ContradictionOf({&a, T_a}, {&b, T_b}), 0.05);
  // Four metres into a wall.
  const double moved = ContradictionOf({&a, T_a}, {&b, T_b * Off(0.0, 4.0, 4.0, 0.0)});
  EXPECT_GT(moved, ContradictionOf({&a, T_a}, {&b, T_b}));
  Scene room;
  room.Add(Box({-3, -3, -1.5}, {3, 3, -1.2}));
  for (const double side : {-3.0, 3.0}) {
    room.Add(Box({side - 0.1, -3, -1.2}, {side + 0.1, 3, 2}));
    room.Add(Box({-3, side - 0.1, -1.2}, {3, side + 0.1, 2}));
  }
  room.Build();
  const ScanFeatures elsewhere = FeaturesAt(room, Pose::Identity(), 3);
  const double other = ContradictionOf({&a, T_a}, {&elsewhere, T_a});
  EXPECT_GT(other, 0.2);
  EXPECT_EQ(other, ContradictionOf({&elsewhere, T_a}, {&a, T_a}));
  EXPECT_EQ(ContradictionOf({&a, T_a}, {&elsewhere, T_a * Off(0.0, 500.0, 0.0, 0.0)}), 0.0);
}

TEST_F(PlaceMatchTest, WithoutScansOrGuessesThereIsNoFit) {
  const ScanFeatures empty;
  const SeenScan target[] = {{&empty}};
  const PlaceHypothesis guess[] = {Around(Off(0.1, 1, 2, 3), 5.0, 1.0, 0.2)};
  EXPECT_EQ(MatchPlace({&empty}, target, guess).verdict, PlaceVerdict::kNoFit);
  EXPECT_EQ(MatchPlace({&empty}, {}, guess).verdict, PlaceVerdict::kNoFit);
  EXPECT_EQ(MatchPlace({&empty}, target, {}).verdict, PlaceVerdict::kNoFit);
  EXPECT_TRUE(
      MatchPlace({&empty}, target, guess).T_target_source.isApprox(guess[0].T_target_source));
}

// 11.5 m apart, and turned: the closure of a recorded loop of 636 m, without any guess.
TEST_F(PlaceMatchTest, ClosesARecordedLoop) {
  STRATA_REQUIRE_DATA(folder, "nclt_campus_loop");
  const auto scans = testing::ListScans(folder / "scans");
  STRATA_ASSERT_OK_AND_ASSIGN(const auto poses,
                              testing::ReadIndexedPoses(folder / "poses_reference.txt"));
  const auto map_of = [&](int index) {
    return BuildMlsMap(testing::ReadBinaryPcd(scans.at(index)).value(),
                       Pose::Identity(),
                       SensorModel(),
                       MlsParameters())
        ->map;
  };
  const MlsMap first = map_of(0);
  const MlsMap last = map_of(900);
  const ScanFeatures there = ScanFeatures::FromMap(first);
  const ScanFeatures here = ScanFeatures::FromMap(last);
  const SeenScan target[] = {{&there}};
  const PlaceSimilarity alike = ComparePlaces(DescribePlace(first), DescribePlace(last));
  const PlaceMatch match =
      MatchPlace({&here},
                 target,
                 HypothesesOf(alike, Eigen::Matrix3d::Identity(), Eigen::Matrix3d::Identity()));
  EXPECT_TRUE(match.matched()) << ToString(match.verdict);
  ExpectNear(poses.at(0).T_world_scan.inverse() * poses.at(900).T_world_scan,
             match.T_target_source,
             0.15,
             0.01);
}

PlaceMatch Matched(const Pose& T, double overlap, double confidence) {
  PlaceMatch match;
  match.verdict = PlaceVerdict::kMatched;
  match.T_target_source = T;
  match.overlap = overlap;
  match.confidence = confidence;
  return match;
}

TEST(UniquePlaceTest, MatchesElsewhereMakeItNobodysPlace) {
  const Pose here = Pose::Identity();
  Pose there = here;
  there.translation().z() = 3.2;  // the next storey
  EXPECT_EQ(UniquePlace({}), std::nullopt);
  const PlaceMatch one[] = {Matched(here, 0.9, 0.6)};
  EXPECT_EQ(UniquePlace(one), 0U);
  const PlaceMatch agreeing[] = {Matched(here, 0.8, 0.5), Matched(here, 0.9, 0.6)};
  EXPECT_EQ(UniquePlace(agreeing), 1U);
  const PlaceMatch rivals[] = {Matched(here, 0.9, 0.6), Matched(there, 0.85, 0.5)};
  EXPECT_EQ(UniquePlace(rivals), std::nullopt);
  const PlaceMatch weak_rival[] = {Matched(here, 0.9, 0.6), Matched(there, 0.5, 0.5)};
  EXPECT_EQ(UniquePlace(weak_rival), 0U);
}

TEST(SaidHypothesisTest, IsAWindowOnAllSides) {
  const Pose said(Eigen::Translation3d(100.0, -20.0, 3.0) *
                  Eigen::AngleAxisd(2.5, Eigen::Vector3d::UnitZ()));
  const PlaceHypothesis window = SaidHypothesis(said);
  const auto off = [&](double x, double y, double z, double turn) {
    return said * Eigen::Translation3d(x, y, z) * Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ());
  };
  EXPECT_TRUE(IsWithin(said, window));
  EXPECT_TRUE(IsWithin(off(-3.0, 3.5, 1.4, 0.35), window));
  EXPECT_FALSE(IsWithin(off(-3.0, 4.5, 0.0, 0.0), window));
  EXPECT_FALSE(IsWithin(off(0.0, 0.0, -1.6, 0.0), window));
  EXPECT_FALSE(IsWithin(off(0.0, 0.0, 0.0, -0.45), window));
}

TEST(PlaceMatchOptionsTest, NamesWhatIsOutOfRange) {
  PlaceMatchOptions options;
  STRATA_EXPECT_OK(options.Validate());
  options.max_starts = 0;
  EXPECT_THAT(options.Validate(),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("max_starts is 0")));
}

}  // namespace
}  // namespace strata
