#include "tests/support/simulator/simulator.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include <gtest/gtest.h>

#include "core/cloud/point_cloud.h"
#include "core/geometry/pose.h"

namespace strata::testing {
namespace {

using Eigen::Vector3d;

// A room of 10 × 8 × 3 m around the origin of the sensor at 1 m.
Scene Room() {
  Scene scene;
  scene.Add(Box({-6, -5, -1}, {6, 5, 0}));
  scene.Add(Box({-6, -5, 3}, {6, 5, 4}));
  scene.Add(Box({5, -5, 0}, {6, 5, 3}));
  scene.Add(Box({-6, -5, 0}, {-5, 5, 3}));
  scene.Add(Box({-6, 4, 0}, {6, 5, 3}));
  scene.Add(Box({-6, -5, 0}, {6, -4, 3}));
  scene.Build();
  return scene;
}

Pose SensorInRoom() {
  Pose T = Pose::Identity();
  T.linear() = Eigen::AngleAxisd(0.4, Vector3d::UnitZ()).toRotationMatrix();
  T.translation() = Vector3d(1.0, -0.5, 1.0);
  return T;
}

double DistanceToRoom(const Vector3d& p) {
  return std::min({5.0 - std::abs(p.x()), 4.0 - std::abs(p.y()), p.z(), 3.0 - p.z()});
}

TEST(SimulatorTest, NoiselessPointsLieOnTheWalls) {
  SensorOptions sensor{.rings = 16, .columns = 90, .sigma_m = 0.0, .sigma_per_metre = 0.0};
  const PointCloud cloud = SimulateScan(Room(), sensor, SensorInRoom(), 1);
  ASSERT_EQ(cloud.size(), 16U * 90U);
  EXPECT_TRUE(ValidateCloud(cloud).ok());
  for (const Eigen::Vector3f& p : cloud.points) {
    EXPECT_NEAR(DistanceToRoom(SensorInRoom() * p.cast<double>()), 0.0, 1e-5);
  }
}

TEST(SimulatorTest, RangeNoiseHasTheSigmaAskedFor) {
  SensorOptions sensor{.rings = 40, .columns = 500, .sigma_m = 0.0, .sigma_per_metre = 0.0};
  const PointCloud exact = SimulateScan(Room(), sensor, SensorInRoom(), 1);
  sensor.sigma_m = 0.02;
  sensor.sigma_per_metre = 0.003;
  const PointCloud noisy = SimulateScan(Room(), sensor, SensorInRoom(), 3);
  ASSERT_EQ(exact.size(), noisy.size());
  double sum = 0.0;
  double squares = 0.0;
  for (std::size_t i = 0; i < exact.size(); ++i) {
    const double range = exact.points[i].norm();
    const double z = (noisy.points[i].norm() - range) / (0.02 + 0.003 * range);
    sum += z;
    squares += z * z;
  }
  const auto n = static_cast<double>(exact.size());  // 20,000: σ of the mean 0.007, of σ 0.005
  EXPECT_NEAR(sum / n, 0.0, 0.03);
  EXPECT_NEAR(std::sqrt(squares / n), 1.0, 0.02);
}

TEST(SimulatorTest, OrganisedScanKeepsItsGridAndTheSamePoints) {
  Scene floor;
  floor.Add(Box({-50, -50, -1}, {50, 50, 0}));
  floor.Build();
  SensorOptions sensor{.rings = 8, .columns = 36, .max_range_m = 5.0};
  Pose T = Pose::Identity();
  T.translation().z() = 1.0;
  const PointCloud plain = SimulateScan(floor, sensor, T, 5);
  sensor.organised = true;
  const PointCloud grid = SimulateScan(floor, sensor, T, 5);
  EXPECT_EQ(grid.rows, 8U);
  EXPECT_EQ(grid.columns, 36U);
  ASSERT_EQ(grid.size(), 8U * 36U);
  EXPECT_TRUE(ValidateCloud(grid).ok());
  EXPECT_EQ(CountFinite(grid), plain.size());
  EXPECT_LT(plain.size(), grid.size());  // the rings above the horizon see nothing
  EXPECT_EQ(grid.points[0], plain.points[0]);
}

TEST(SimulatorTest, SameSeedSameScanOtherSeedOtherScan) {
  const SensorOptions sensor{.rings = 8, .columns = 36};
  const Scene room = Room();
  const auto points = [&](std::uint64_t seed) {
    return SimulateScan(room, sensor, SensorInRoom(), seed).points;
  };
  EXPECT_EQ(points(1), points(1));
  EXPECT_NE(points(1), points(2));
}

TEST(SimulatorTest, DriveStaysAboveTheGroundAndTiltsOnARamp) {
  Scene scene;
  scene.Add(Box({-50, -50, -1}, {50, 50, 0}));
  scene.Add(RampX(0, 20, -3, 3, 0.0, 4.0));
  scene.Build();
  const std::vector<Pose> poses = Drive(scene, {{-10, 0, 0}, {18, 0, 0}}, 1.0, 1.5);
  ASSERT_EQ(poses.size(), 28U);
  const double slope = std::atan(0.2);
  for (const Pose& pose : poses) {
    const Vector3d foot = pose * Vector3d(0, 0, -1.5);
    EXPECT_NEAR(foot.z(), std::max(0.0, 0.2 * foot.x()), 1e-9);
    const double pitch = std::asin(pose.linear()(2, 0));
    if (std::abs(foot.x()) < 1.0) continue;  // the wheels stand on both
    EXPECT_NEAR(pitch, foot.x() > 0.0 ? slope : 0.0, 1e-9);
    EXPECT_NEAR((pose.linear() * pose.linear().transpose() - Eigen::Matrix3d::Identity()).norm(),
                0.0,
                1e-12);
  }
}

TEST(SimulatorTest, NoisyOdometryDriftsFromAnExactStart) {
  Scene scene;
  scene.Add(Box({-1, -50, -1}, {500, 50, 0}));
  scene.Build();
  const std::vector<Pose> truth = Drive(scene, {{0, 0, 0}, {400, 0, 0}}, 1.0, 1.0);
  const OdometryNoise noise{.translation_sigma_m = 0.05, .rotation_sigma_rad = 0.0};
  const std::vector<Pose> noisy = NoisyOdometry(truth, noise, 9);
  ASSERT_EQ(noisy.size(), truth.size());
  EXPECT_TRUE(noisy[0].isApprox(truth[0]));
  double squares = 0.0;
  for (std::size_t i = 1; i < truth.size(); ++i) {
    const Pose error =
        (truth[i - 1].inverse() * truth[i]).inverse() * noisy[i - 1].inverse() * noisy[i];
    squares += error.translation().squaredNorm();
  }
  EXPECT_NEAR(std::sqrt(squares / (3.0 * static_cast<double>(truth.size() - 1))), 0.05, 0.004);
}

TEST(SimulatorTest, LabelsAreThoseOfTheSolids) {
  Scene scene;
  Solid left = Box({-1, 2, -1}, {1, 3, 1});
  left.label = 5;
  scene.Add(left);
  scene.Add(Box({-1, -3, -1}, {1, -2, 1}));
  scene.Build();
  SensorOptions sensor;
  sensor.labelled = true;
  const PointCloud cloud = SimulateScan(scene, sensor, Pose::Identity(), 1);
  ASSERT_EQ(cloud.label.size(), cloud.size());
  ASSERT_GT(cloud.size(), 100U);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    EXPECT_EQ(cloud.label[i], cloud.points[i].y() > 0.0F ? 5 : 0);
  }
  sensor.organised = true;
  const PointCloud grid = SimulateScan(scene, sensor, Pose::Identity(), 1);
  EXPECT_EQ(grid.label.size(), grid.size());
  sensor.labelled = false;
  EXPECT_TRUE(SimulateScan(scene, sensor, Pose::Identity(), 1).label.empty());
}

}  // namespace
}  // namespace strata::testing
