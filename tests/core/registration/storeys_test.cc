// Storeys of which the robot has seen the undersides before it gets to their tops: with exact poses
// all around it, a scan stays where it is.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <numbers>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "core/cloud/sensor_model.h"
#include "core/mls/build.h"
#include "core/mls/sides.h"
#include "core/registration/mls_registration.h"
#include "core/registration/neighbours.h"
#include "core/registration/upright_frame.h"
#include "tests/support/simulator/scene.h"
#include "tests/support/simulator/simulator.h"

namespace strata::testing {
namespace {

using Eigen::Vector3d;

// As sparse as sensors come: on a ceiling 1.9 m above it lines are metres apart.
constexpr SensorOptions kSixteenBeams = {.rings = 16,
                                         .columns = 900,
                                         .elevation_min_rad = -0.262,
                                         .elevation_max_rad = 0.262,
                                         .sigma_m = 0.02};

class Driven {
 public:
  Driven(const Scene& scene, const SensorOptions& sensor, std::vector<Pose> poses)
      : poses_(std::move(poses)) {
    for (std::size_t i = 0; i < poses_.size(); ++i) {
      clouds_.push_back(SimulateScan(scene, sensor, poses_[i], 17 * i + 1));
      ScanFeatureOptions options;
      options.sample_count = 4000;
      options.up = BelievedUp(clouds_[i].points, UpOf(poses_[i]));
      options.R_map_scan = UprightTurn(options.up);
      maps_.push_back(
          BuildMlsMap(clouds_[i], Pose(options.R_map_scan), SensorModel(), MlsParameters())->map);
      features_.push_back(ScanFeatures::FromMap(maps_[i], options));
    }
  }

  std::size_t size() const { return poses_.size(); }
  const Pose& pose(std::size_t i) const { return poses_[i]; }
  const MlsMap& map(std::size_t i) const { return maps_[i]; }

  // How far scan `i` is drawn away from its place by the nearest ones before it in theirs.
  Vector3d Drawn(std::size_t i) const {
    const std::vector<Pose> before(poses_.begin(), poses_.begin() + static_cast<std::ptrdiff_t>(i));
    std::vector<PlacedScan> placed;
    for (const std::size_t j : SelectNeighbours(before, poses_[i], {})) {
      placed.push_back({&features_[j], poses_[j]});
    }
    const RegistrationTarget target(placed, {.centre = poses_[i].translation()});
    MlsRegistrationOptions options;
    options.max_samples = 4000;
    return RegisterScan(features_[i], target, poses_[i], options).T_target_source.translation() -
           poses_[i].translation();
  }

 private:
  std::vector<Pose> poses_;
  std::vector<PointCloud> clouds_;
  std::vector<MlsMap> maps_;
  std::vector<ScanFeatures> features_;
};

// A ramp that winds up around (0, 0), 3.2 m a turn, 0.25 m thick, with a parapet on both sides.
constexpr double kRadiusM = 8.0;
constexpr double kTurnM = 3.2;

Pose OnTheHelix(double turns) {
  const double angle = 2.0 * std::numbers::pi * turns;
  const double pitch = -std::atan2(kTurnM, 2.0 * std::numbers::pi * kRadiusM);
  Pose T = Pose::Identity();
  T.linear() = (Eigen::AngleAxisd(angle + std::numbers::pi / 2.0, Vector3d::UnitZ()) *
                Eigen::AngleAxisd(pitch, Vector3d::UnitY()))
                   .toRotationMatrix();
  T.translation() =
      Vector3d(kRadiusM * std::cos(angle), kRadiusM * std::sin(angle), kTurnM * turns);
  return T;
}

Scene Helix(double turns) {
  constexpr int kPieces = 36;
  Scene scene;
  scene.Add(Box({-30.0, -30.0, -1.0}, {30.0, 30.0, -0.3}));
  for (int i = 0; i < static_cast<int>(turns * kPieces); ++i) {
    const Pose T = OnTheHelix((i + 0.5) / kPieces);
    scene.Add(OrientedBox(T * Eigen::Translation3d(0.0, 0.0, -0.125), {1.75, 4.4, 0.25}));
    for (const double side : {-2.1, 2.1}) {
      scene.Add(OrientedBox(T * Eigen::Translation3d(0.0, side, 0.45), {1.8, 0.16, 0.9}));
    }
  }
  for (int k = 0; k < 6; ++k) {
    const double angle = k * std::numbers::pi / 3.0 + 0.3;
    scene.Add(Post(5.3 * std::cos(angle), 5.3 * std::sin(angle), -0.3, turns * kTurnM + 1.0, 0.25));
  }
  scene.Build();
  return scene;
}

TEST(StoreysTest, AHelixIsNotDrawnOntoItsOwnUnderside) {
  const Scene scene = Helix(2.6);
  std::vector<Pose> poses;
  for (double turns = 0.05; turns < 1.95; turns += 0.02) {
    poses.push_back(OnTheHelix(turns) * Eigen::Translation3d(0.0, 0.0, 1.2));
  }
  const Driven driven(scene, kSixteenBeams, poses);
  double sum_m = 0.0;
  double worst_m = 0.0;
  int scans = 0;
  for (std::size_t i = driven.size() - 20; i < driven.size(); i += 4) {
    const double down_m = driven.Drawn(i).z();
    sum_m += down_m;
    worst_m = std::max(worst_m, std::abs(down_m));
    ++scans;
  }
  std::printf("%.3f m in the mean, %.3f m at most\n", sum_m / scans, worst_m);
  EXPECT_LT(worst_m, 0.02);  // 0.23 where tops are not told from undersides
}

// Of what lies at the height of an underside, how much is taken for a top.
TEST(StoreysTest, LinesThatBeamsDrawOnACeilingAreNoTops) {
  const Scene scene = Helix(2.6);
  int undersides = 0;
  int tops = 0;
  for (const double turns : {0.3, 0.6, 0.9}) {
    const Pose T = OnTheHelix(turns) * Eigen::Translation3d(0.0, 0.0, 1.2);
    const Driven driven(scene, kSixteenBeams, {T});
    const std::vector<Side> sides = SidesOf(driven.map(0), Vector3d::Zero(), 100.0, UpOf(T));
    std::size_t place = 0;
    for (const MlsTile& tile : driven.map(0).tiles) {
      for (const Patch& patch : tile.patches) {
        const Side side = sides[place++];
        const CellIndex cell = CellOf(tile.key, static_cast<std::uint16_t>(patch.cell));
        const double cell_m = driven.map(0).parameters.cell_size_m;
        const Vector3d p =
            T * Vector3d((cell.x + 0.5) * cell_m, (cell.y + 0.5) * cell_m, patch.mean_m());
        const double p_turns = std::atan2(p.y(), p.x()) / (2.0 * std::numbers::pi);
        const double above_m = std::remainder(p.z() + 0.25 - kTurnM * p_turns, kTurnM);
        const double radius_m = p.head<2>().norm();
        if (patch.vertical() || std::abs(above_m) > 0.06 || radius_m < 6.2 || radius_m > 9.8) {
          continue;
        }
        ++undersides;
        tops += side == Side::kUnderside || side == Side::kDoubtful ? 0 : 1;
      }
    }
  }
  std::printf("%d of %d\n", tops, undersides);
  EXPECT_GT(undersides, 500);
  EXPECT_LT(tops, undersides / 3);  // 1,681 of 1,866 in cubes of 1 m alone
}

// Two flights of stairs beside each other, a landing at the head of the first.
Scene Stairwell() {
  constexpr int kSteps = 10;
  constexpr double kRise = 0.165;
  constexpr double kRun = 0.28;
  Scene scene;
  scene.Add(Box({-22.0, -2.8, -0.3}, {5.2, 2.8, 0.0}));  // a corridor leads to them
  scene.Add(Box({-22.0, -2.8, 3.05}, {-2.0, 2.8, 3.3}));
  scene.Add(Box({-22.2, -2.8, 0.0}, {-22.0, 2.8, 3.05}));
  for (const double side : {-1.0, 1.0}) {
    const Eigen::Vector2d corridor(side * 1.2, side * 2.8);
    scene.Add(Box({-22.0, corridor.minCoeff(), 0.0}, {-2.0, corridor.maxCoeff(), 3.05}));
    const Eigen::Vector2d stairs(side * 2.8, side * 3.0);
    scene.Add(Box({-2.0, stairs.minCoeff(), 0.0}, {5.2, stairs.maxCoeff(), 6.4}));
  }
  scene.Add(Box({5.0, -2.8, 0.0}, {5.2, 2.8, 6.4}));
  scene.Add(Box({-2.2, -2.8, 3.3}, {-2.0, 2.8, 6.4}));
  scene.Add(Box({-2.2, -2.8, 6.4}, {5.2, 2.8, 6.6}));
  for (int i = 0; i < kSteps; ++i) {
    const double low = kRise * i;
    scene.Add(Box({kRun * i, -2.6, low - 0.2}, {kRun * (i + 1), -0.1, low + kRise}));
    const double high = kRise * (kSteps + i);
    scene.Add(
        Box({kRun * (kSteps - i - 1), 0.1, high - 0.2}, {kRun * (kSteps - i), 2.6, high + kRise}));
  }
  scene.Add(Box({2.8, -2.8, 1.45}, {5.0, 2.8, 1.65}));
  scene.Add(Box({-2.0, -2.6, 3.05}, {0.0, 2.6, 3.3}));
  scene.Build();
  return scene;
}

TEST(StoreysTest, StairsAreNotDrawnOntoTheirOwnUndersides) {
  const Scene scene = Stairwell();
  std::vector<Pose> poses;
  const auto level = Eigen::Quaterniond::Identity();
  for (double x = -12.0; x < -2.0; x += 1.0) poses.push_back(MakePose(level, {x, 0.3, 1.2}));
  poses.push_back(MakePose(level, {-2.2, -0.3, 1.2}));
  poses.push_back(MakePose(level, {-1.5, -0.9, 1.2}));
  poses.push_back(MakePose(level, {-0.6, -1.3, 1.2}));
  const Eigen::Quaterniond up(Eigen::AngleAxisd(-0.53, Vector3d::UnitY()));
  for (const double x : {-0.2, 0.6, 1.4, 2.6}) {
    poses.push_back(MakePose(up, {x, -1.3, 0.59 * x + 1.29}));
  }
  double worst_m = 0.0;
  for (const int rings : {16, 32}) {
    SensorOptions sensor = kSixteenBeams;
    sensor.rings = rings;
    const Driven driven(scene, sensor, poses);
    const Vector3d drawn = driven.Drawn(driven.size() - 1);
    std::printf("%d beams: %.3f %.3f %.3f m\n", rings, drawn.x(), drawn.y(), drawn.z());
    worst_m = std::max(worst_m, drawn.norm());
  }
  EXPECT_LT(worst_m, 0.02);  // 0.037 without sides
}

}  // namespace
}  // namespace strata::testing
