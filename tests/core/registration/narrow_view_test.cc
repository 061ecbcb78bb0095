// Depth cameras see a few walls, for a few metres: with exact poses all around it, a scan stays
// where it is, also in the directions that nothing it sees holds.
#include <cmath>
#include <cstdint>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "core/cloud/sensor_model.h"
#include "core/mls/build.h"
#include "core/registration/mls_registration.h"
#include "tests/support/simulator/scene.h"
#include "tests/support/simulator/simulator.h"

namespace strata::testing {
namespace {

// 60° wide, 45° high, up to 6 m.
PointCloud Seen(const Scene& scene, const Pose& T_world_camera, std::uint64_t seed) {
  const SensorOptions sensor = {.rings = 120,
                                .columns = 960,
                                .elevation_min_rad = -0.39,
                                .elevation_max_rad = 0.39,
                                .max_range_m = 6.0,
                                .sigma_per_metre = 0.005};
  PointCloud all = SimulateScan(scene, sensor, T_world_camera, seed);
  PointCloud seen;
  for (const Eigen::Vector3f& p : all.points) {
    if (std::abs(std::atan2(p.y(), p.x())) < 0.52F) seen.points.push_back(p);
  }
  return seen;
}

// How far the last scan is drawn from its place by those before it in theirs, in its frame; it sees
// `scene_now`.
Eigen::Vector3d Drawn(const Scene& scene,
                      const Scene& scene_now,
                      const std::vector<Pose>& poses,
                      const MlsRegistrationOptions& options = {}) {
  std::vector<ScanFeatures> features;
  std::vector<PlacedScan> before;
  features.reserve(poses.size());
  for (const Pose& pose : poses) {
    const bool is_last = features.size() + 1 == poses.size();
    const PointCloud seen = Seen(is_last ? scene_now : scene, pose, features.size() + 1);
    features.push_back(ScanFeatures::FromMap(
        BuildMlsMap(seen, Pose::Identity(), SensorModel(), MlsParameters())->map));
  }
  const Pose& truth = poses.back();
  for (std::size_t i = 0; i + 1 < poses.size(); ++i) before.push_back({&features[i], poses[i]});
  const RegistrationTarget target(before, {.centre = truth.translation()});
  const RegistrationResult match = RegisterScan(features.back(), target, truth, options);
  EXPECT_NE(match.termination, Termination::kTooLittleOverlap);
  return (truth.inverse() * match.T_target_source).translation();
}

Pose At(double x, double y, double heading_rad) {
  return Eigen::Translation3d(x, y, 0.8) *
         Pose(Eigen::AngleAxisd(heading_rad, Eigen::Vector3d::UnitZ()));
}

// From x = 0 to 20, with a wall at its end, and a post in it.
Scene Corridor(double post_x = -9.0) {
  Scene scene;
  scene.Add(Box({post_x, -0.5, 0.0}, {post_x + 0.08, -0.42, 0.7}));
  scene.Add(Box({-1.0, -3.0, -0.3}, {22.0, 3.0, 0.0}));
  scene.Add(Box({-1.0, -3.0, 2.6}, {22.0, 3.0, 2.9}));
  for (const double side : {-1.35, 1.15}) {
    scene.Add(Box({-1.0, side, 0.0}, {22.0, side + 0.2, 2.6}));
  }
  scene.Add(Box({20.0, -1.15, 0.0}, {20.2, 1.15, 2.6}));
  scene.Build();
  return scene;
}

TEST(NarrowViewTest, TheEndOfACorridorThatComesIntoViewDrawsNothing) {
  const Scene corridor = Corridor();
  for (const double short_of_it : {5.4, 5.6, 5.8}) {
    std::vector<Pose> poses;
    for (int k = 5; k >= 0; --k) poses.push_back(At(20.0 - short_of_it - 0.4 * k, 0.05, 0.0));
    EXPECT_LT(Drawn(corridor, corridor, poses).norm(), 0.03) << short_of_it;
  }
}

// What hardly anything holds is held by something false as often as not: a post that was moved.
TEST(NarrowViewTest, AFewFeaturesWeighNoMoreThanARobotThatKnowsItsWay) {
  MlsRegistrationOptions options;
  options.min_hold = 0.0;
  std::vector<Pose> poses;
  for (int k = 5; k >= 0; --k) poses.push_back(At(6.0 - 0.4 * k, 0.05, 0.0));
  const double alone_m = Drawn(Corridor(9.0), Corridor(9.3), poses, options).norm();
  options.guess_sigma_m = 0.02;
  options.guess_sigma_rad = 0.003;
  const double with_guess_m = Drawn(Corridor(9.0), Corridor(9.3), poses, options).norm();
  EXPECT_GT(alone_m, 0.25) << "it follows the post";
  EXPECT_LT(with_guess_m, 0.15);
}

TEST(NarrowViewTest, OneWallHoldsNothingAlongItself) {
  Scene scene;
  scene.Add(Box({4.0, -9.0, -9.0}, {4.2, 9.0, 9.0}));
  scene.Build();
  for (int turn = 0; turn < 8; ++turn) {
    std::vector<Pose> poses;
    for (int k = 0; k < 5; ++k) poses.push_back(At(0.1 * k, 0.3 * k, 0.05 * (turn + k)));
    EXPECT_LT(Drawn(scene, scene, poses).norm(), 0.03) << turn;
  }
}

}  // namespace
}  // namespace strata::testing
