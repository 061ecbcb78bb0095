#include "core/registration/upright_frame.h"

#include <cmath>

#include <gtest/gtest.h>

#include "core/mls/build.h"
#include "core/registration/place_match.h"
#include "core/registration/scan_features.h"
#include "core/registration/upright_offsets.h"
#include "tests/support/simulator/simulator.h"
#include "tests/support/simulator/worlds.h"

namespace strata {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using testing::Random;

TEST(UprightTurnTest, IsTheShortestTurnToTheVerticalWhereASensorIsTilted) {
  Random random(7);
  for (int k = 0; k < 100; ++k) {
    const double tilt = random.Uniform(0.26, 3.1);
    const double towards = random.Uniform(-M_PI, M_PI);
    const Vector3d up(
        std::sin(tilt) * std::cos(towards), std::sin(tilt) * std::sin(towards), std::cos(tilt));
    const Matrix3d R = UprightTurn(up);
    EXPECT_LT((R * up - Vector3d::UnitZ()).norm(), 1e-9);
    EXPECT_NEAR(RotationAngleRad(Pose(R)), tilt, 1e-9);
  }
  EXPECT_LT((UprightTurn(-Vector3d::UnitZ()) * -Vector3d::UnitZ() - Vector3d::UnitZ()).norm(),
            1e-9);
  EXPECT_TRUE(UprightTurn(Vector3d(0.2, 0.0, 1.0)).isIdentity(0.0)) << "a robot on a slope";
  EXPECT_TRUE(UprightTurn(Vector3d::UnitZ()).isIdentity(0.0));
}

// A sensor in the yard of YardScene(), whose ground is z = 0.
class TiltedSensorTest : public ::testing::Test {
 protected:
  static Pose Standing(double x, double y, double heading_rad, const Vector3d& axis, double tilt) {
    return Pose(Eigen::Translation3d(x, y, 1.2)) *
           Pose(Eigen::AngleAxisd(heading_rad, Vector3d::UnitZ())) *
           Pose(Eigen::AngleAxisd(tilt, axis));
  }

  static ScanFeatures FeaturesOf(const Pose& T_map_scan, std::uint64_t seed) {
    const PointCloud cloud = SimulateScan(testing::YardScene(), {}, T_map_scan, seed);
    ScanFeatureOptions options;
    options.up = UpOf(T_map_scan);
    options.R_map_scan = UprightTurn(options.up);
    MlsParameters parameters;
    parameters.cell_size_m = 0.1;
    const auto built = BuildMlsMap(cloud, Pose(options.R_map_scan), SensorModel(), parameters);
    EXPECT_TRUE(built.ok()) << built.status();
    UprightOffsets offsets(built->map, options.samples_per_metre, options.R_map_scan);
    offsets.Add(cloud.points);
    return ScanFeatures::FromMap(built->map, options, &offsets);
  }
};

// Odometry of a level sensor that has drifted in pitch, and a tilted one whose pose is a little
// off.
TEST_F(TiltedSensorTest, IsTiltedOnlyWhereSurfacesAgree) {
  const Pose level = Standing(3.0, 2.0, 0.4, Vector3d::UnitY(), 0.0);
  const auto seen = [](const Pose& T_map_scan) {
    return SimulateScan(testing::YardScene(), {}, T_map_scan, 9).points;
  };
  for (const double off_rad : {0.27, 0.35, 0.45}) {
    const Vector3d said(std::sin(off_rad), 0.0, std::cos(off_rad));
    EXPECT_EQ(BelievedUp(seen(level), said), Vector3d::UnitZ()) << off_rad;
  }
  for (const double tilt : {0.4, 0.6, M_PI / 2, 2.5}) {
    const Pose tilted = Standing(3.0, 2.0, 0.4, Vector3d::UnitY(), tilt);
    const Vector3d said = Pose(Eigen::AngleAxisd(0.05, Vector3d::UnitX())) * UpOf(tilted);
    EXPECT_EQ(BelievedUp(seen(tilted), said), said) << tilt;
  }
  const Vector3d little(0.2, 0.0, std::sqrt(1.0 - 0.2 * 0.2));
  EXPECT_EQ(BelievedUp(seen(level), little), little) << "as good as level";
  EXPECT_EQ(BelievedUp({}, -Vector3d::UnitZ()), -Vector3d::UnitZ()) << "nothing speaks against it";
}

TEST_F(TiltedSensorTest, FeaturesAreThoseOfALevelOneInTheScansFrame) {
  const Pose level = Standing(3.0, 2.0, 0.4, Vector3d::UnitY(), 0.0);
  const Pose tilted = Standing(3.0, 2.0, 0.4, Vector3d::UnitY(), 0.6);
  for (const Pose& T_map_scan : {level, tilted}) {
    const ScanFeatures features = FeaturesOf(T_map_scan, 5);
    const auto& ground = features.points(FeatureClass::kTraversable);
    const auto& walls = features.points(FeatureClass::kVertical);
    ASSERT_GT(ground.size(), 500U);
    ASSERT_GT(walls.size(), 500U);
    std::size_t off_ground = 0;
    for (const Eigen::Vector3f& p : ground) {
      off_ground += std::abs((T_map_scan * p.cast<double>()).z()) > 0.1 ? 1 : 0;
    }
    EXPECT_LT(off_ground, ground.size() / 5) << "tops of sheds and walls aside";
    std::size_t at_ground = 0;
    for (const Eigen::Vector3f& p : walls) {
      at_ground += (T_map_scan * p.cast<double>()).z() < 0.05 ? 1 : 0;
    }
    EXPECT_LT(at_ground, walls.size() / 5);
    EXPECT_LT((T_map_scan.linear() * features.up() - Vector3d::UnitZ()).norm(), 1e-9);
  }
}

// One looks down in front, the other lies on its side; neither's z axis is near the vertical.
TEST_F(TiltedSensorTest, IsFoundFromAnyHeading) {
  const Pose T_map_i = Standing(0.0, 1.0, 0.3, Vector3d::UnitY(), 0.6);
  const Pose T_map_j = Standing(2.0, -1.0, 2.3, Vector3d::UnitX(), M_PI / 2);
  const ScanFeatures there = FeaturesOf(T_map_i, 1);
  const ScanFeatures here = FeaturesOf(T_map_j, 2);
  const Pose T_i_j = T_map_i.inverse() * T_map_j;
  // Turned and moved about the vertical.
  const Pose off = Pose(Eigen::Translation3d(4.0, -3.0, 0.5)) * T_map_j *
                   Pose(Eigen::AngleAxisd(2.0, UpOf(T_map_j)));
  const PlaceHypothesis guess{T_map_i.inverse() * off, 10.0, 2.0, M_PI};
  const SeenScan target[] = {{&there}};
  PlaceMatchOptions options;
  options.min_overlap = 0.3;  // they see little in common
  const PlaceMatch match = MatchPlace({&here}, target, {&guess, 1}, options);
  const Pose error = T_i_j.inverse() * match.T_target_source;
  EXPECT_LT(error.translation().norm(), 0.1) << ToString(match.verdict);
  EXPECT_LT(RotationAngleRad(error), 0.01);
}

}  // namespace
}  // namespace strata
