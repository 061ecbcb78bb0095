#include "core/mls/see_through.h"

#include <cstdint>
#include <map>
#include <numbers>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/mls/build.h"
#include "core/mls/join.h"
#include "tests/support/simulator/scene.h"
#include "tests/support/simulator/simulator.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using testing::Box;
using testing::Labelled;
using testing::Post;
using testing::Scene;

// What there is in the yard.
enum : std::uint16_t { kGround = 1, kWall, kPost, kFence, kTable, kPerson, kCar, kHidden };

// A walled yard with things that do not move.
Scene Yard(const std::vector<testing::Solid>& guests) {
  Scene scene;
  scene.SetTerrain(
      Eigen::AlignedBox2d(Eigen::Vector2d(-20.0, -20.0), Eigen::Vector2d(20.0, 20.0)),
      1.0,
      [](double x, double) { return 0.02 * x; },
      kGround);
  scene.Add(Labelled(Box({-15.0, -12.2, -1.0}, {15.0, -12.0, 3.0}), kWall));
  scene.Add(Labelled(Box({-15.0, 12.0, -1.0}, {15.0, 12.2, 3.0}), kWall));
  for (int i = 0; i < 6; ++i) {
    scene.Add(Labelled(Post(-9.0 + 3.0 * i, 6.0, -1.0, 2.5, 0.03), kPost));
  }
  for (int i = 0; i < 40; ++i) {  // a picket fence
    scene.Add(Labelled(Box({-4.0 + 0.2 * i, -7.0, -0.5}, {-3.92 + 0.2 * i, -6.97, 1.0}), kFence));
  }
  scene.Add(Labelled(Box({6.0, -4.0, 0.75}, {7.5, -3.0, 0.8}), kTable));
  for (const testing::Solid& guest : guests) scene.Add(guest);
  scene.Build();
  return scene;
}

struct Scan {
  std::vector<Eigen::Vector3d> points;
  std::vector<std::uint16_t> labels;
  Eigen::Vector3d sensor;
  MlsMap contribution;
};

// What the robot sees of the scene at its i-th stop, with a pose that is a little wrong.
Scan ScanAt(const Scene& scene, int i) {
  testing::Random random(1000 + static_cast<std::uint64_t>(i));
  const auto pose = [&](double wrong_m, double wrong_rad) {
    Pose T = Pose::Identity();
    T.translate(Eigen::Vector3d(-6.0 + 0.9 * i + wrong_m * random.Gaussian(),
                                1.0 + wrong_m * random.Gaussian(),
                                1.2 + wrong_m * random.Gaussian()));
    T.rotate(Eigen::AngleAxisd(0.3 * i + wrong_rad * random.Gaussian(), Eigen::Vector3d::UnitZ()));
    T.rotate(Eigen::AngleAxisd(wrong_rad * random.Gaussian(), Eigen::Vector3d::UnitX()));
    return T;
  };
  testing::SensorOptions sensor;
  sensor.labelled = true;
  const PointCloud cloud =
      testing::SimulateScan(scene, sensor, pose(0.0, 0.0), static_cast<std::uint64_t>(i));
  const Pose T_map_scan = pose(0.02, 0.002);
  Scan scan;
  for (const Eigen::Vector3f& p : cloud.points) {
    scan.points.push_back(T_map_scan * p.cast<double>());
  }
  scan.labels = cloud.label;
  scan.sensor = T_map_scan.translation();
  scan.contribution = BuildMlsMap(cloud, T_map_scan, {}, {}).value().map;
  return scan;
}

// For every scan and point, in order: by how many later scans it was looked through.
std::vector<std::vector<std::uint16_t>> Gone(const std::vector<Scan>& scans,
                                             const SeeThroughOptions& options = {}) {
  MlsMap map;
  for (const Scan& scan : scans) JoinInto(map, scan.contribution);
  SeeThrough see_through(map, options);
  std::vector<std::vector<std::uint16_t>> gone(scans.size());
  for (std::size_t i = scans.size(); i-- > 0;) {
    see_through.BeginScan(scans[i].sensor);
    gone[i] = see_through.TakePoints(scans[i].points);
    see_through.LookAlong(scans[i].points);
    see_through.EndScan();
  }
  return gone;
}

struct Share {
  std::size_t gone = 0, all = 0;
  double value() const { return static_cast<double>(gone) / static_cast<double>(all); }
};

std::map<std::uint16_t, Share> SharesByLabel(const std::vector<Scan>& scans,
                                             const std::vector<std::vector<std::uint16_t>>& gone) {
  std::map<std::uint16_t, Share> shares;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    for (std::size_t k = 0; k < scans[i].labels.size(); ++k) {
      Share& share = shares[scans[i].labels[k]];
      ++share.all;
      share.gone += gone[i][k] != 0 ? 1 : 0;
    }
  }
  return shares;
}

testing::Solid Person() { return Labelled(Post(0.0, 4.0, 0.02, 1.75, 0.25), kPerson); }
testing::Solid Car() { return Labelled(Box({1.0, -4.5, 0.1}, {5.0, -2.8, 1.4}), kCar); }

TEST(SeeThroughTest, WhatHasLeftGoesAndTheRestStays) {
  const Scene before = Yard({Person(), Car()});
  const Scene after = Yard({});
  std::vector<Scan> scans;
  for (int i = 0; i < 14; ++i) scans.push_back(ScanAt(i < 5 ? before : after, i));
  std::map<std::uint16_t, Share> shares = SharesByLabel(scans, Gone(scans));
  // But for what is as low as the ground they stand on.
  EXPECT_GT(shares[kPerson].value(), 0.85);
  EXPECT_GT(shares[kCar].value(), 0.85);
  for (const std::uint16_t label : {kGround, kWall, kPost, kFence}) {
    EXPECT_GT(shares[label].all, 50U) << label;
    EXPECT_LT(shares[label].value(), 0.001) << label << ": " << shares[label].gone;
  }
  EXPECT_LT(shares[kTable].value(), 0.02);  // two points of its edge
}

TEST(SeeThroughTest, WhatWasNotLookedAtAgainStays) {
  // Behind a wall that comes after it: no ray has passed where it was.
  const testing::Solid screen = Labelled(Box({-15.0, 3.0, -1.0}, {15.0, 3.1, 3.0}), kWall);
  const Scene before = Yard({Person()});
  const Scene after = Yard({screen});
  std::vector<Scan> scans;
  for (int i = 0; i < 14; ++i) scans.push_back(ScanAt(i < 5 ? before : after, i));
  EXPECT_EQ(SharesByLabel(scans, Gone(scans))[kPerson].gone, 0U);
}

TEST(SeeThroughTest, WhatIsSeenAgainWasNeverGone) {
  const Scene with = Yard({Car()});
  const Scene without = Yard({});
  std::vector<Scan> scans;
  for (int i = 0; i < 14; ++i) scans.push_back(ScanAt(i < 4 || i >= 12 ? with : without, i));
  const std::vector<std::vector<std::uint16_t>> gone = Gone(scans);
  // But for the sides of it that were not seen again.
  EXPECT_LT(SharesByLabel(scans, gone)[kCar].value(), 0.25);
  EXPECT_THAT(gone[12], ::testing::Each(0));
  EXPECT_THAT(gone[13], ::testing::Each(0));
}

TEST(SeeThroughTest, TooFewScansSayNothing) {
  std::vector<Scan> scans;
  for (int i = 0; i < 5; ++i) scans.push_back(ScanAt(Yard({Person()}), i));
  for (int i = 5; i < 7; ++i) scans.push_back(ScanAt(Yard({}), i));
  EXPECT_LT(SharesByLabel(scans, Gone(scans))[kPerson].value(), 0.02);
  EXPECT_GT(SharesByLabel(scans, Gone(scans, {.scans = 2}))[kPerson].value(), 0.7);
}

TEST(SeeThroughTest, OptionsOutOfRangeAreNamed) {
  EXPECT_THAT(SeeThroughOptions().Validate(), testing::IsOk());
  const absl::Status status = SeeThroughOptions{.scans = 0, .clearance_m = -1.0}.Validate();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), ::testing::HasSubstr("scans = 0"));
}

}  // namespace
}  // namespace strata
