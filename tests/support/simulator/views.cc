#include "tests/support/simulator/views.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "core/geometry/pose.h"
#include "tests/support/simulator/scene.h"
#include "tests/support/simulator/simulator.h"
#include "tests/support/simulator/walls.h"

namespace strata::testing {
namespace {

using Eigen::Vector3d;

// The triangle of a gable: over x from −half to half at `low`, its tip at x = 0 and `high`, between
// two y.
Solid Gable(double half, double y_min, double y_max, double low, double high) {
  Solid solid;
  const Vector3d right = Vector3d(high - low, 0.0, half).normalized();
  const Vector3d left(-right.x(), 0.0, right.z());
  const Vector3d tip(0.0, 0.0, high);
  solid.faces = {{right, right.dot(tip)},
                 {left, left.dot(tip)},
                 {-Vector3d::UnitZ(), -low},
                 {Vector3d::UnitY(), y_max},
                 {-Vector3d::UnitY(), -y_min}};
  solid.box = {Vector3d(-half, y_min, low), Vector3d(half, y_max, high)};
  return solid;
}

// One half of the roof: a slab that falls from (0, ridge) to (side · reach, eave).
Solid RoofHalf(
    double side, double reach, double eave, double ridge, double half_length, double thickness) {
  const double run = std::hypot(reach, ridge - eave);
  Pose T = Pose::Identity();
  T.linear() = Eigen::AngleAxisd(side * std::atan2(ridge - eave, reach), Vector3d::UnitY())
                   .toRotationMatrix();
  const Vector3d middle(side * reach / 2, 0.0, (eave + ridge) / 2);
  T.translation() = middle - T.linear() * Vector3d(0.0, 0.0, thickness / 2);
  return OrientedBox(T, {run, 2 * half_length, thickness});
}

}  // namespace

Scene SmallHouse() {
  constexpr double kHalfX = 1.3, kHalfY = 2.3, kEaves = 2.2, kRidge = 3.0, kWall = 0.12;
  constexpr double kSill = 0.9, kLintel = 1.8;
  Scene scene;
  const std::vector<Opening> long_side = {
      {-1.7, -0.9, kSill, kLintel}, {-0.3, 0.5, kSill, kLintel}, {1.1, 1.9, kSill, kLintel}};
  const std::vector<Opening> door_side = {
      {-1.7, -0.9, kSill, kLintel}, {-0.2, 0.7, 0.3, kLintel}, {1.2, 1.8, kSill, kLintel}};
  const std::vector<Opening> front = {{-0.8, -0.2, kSill, kLintel}, {0.3, 0.9, kSill, kLintel}};
  const std::vector<Opening> back = {{-0.5, 0.6, kSill, kLintel}};
  AddWall(scene, {true, -kHalfY, kHalfY, kHalfX, -1.0}, 0.0, kEaves, kWall, long_side, 0.0);
  AddWall(scene, {true, -kHalfY, kHalfY, -kHalfX, 1.0}, 0.0, kEaves, kWall, door_side, 0.0);
  AddWall(scene, {false, -kHalfX, kHalfX, kHalfY, -1.0}, 0.0, kEaves, kWall, front, 0.0);
  AddWall(scene, {false, -kHalfX, kHalfX, -kHalfY, 1.0}, 0.0, kEaves, kWall, back, 0.0);
  scene.Add(Gable(kHalfX, kHalfY - kWall, kHalfY, kEaves, kRidge - 0.1));
  scene.Add(Gable(kHalfX, -kHalfY, -kHalfY + kWall, kEaves, kRidge - 0.1));
  for (const double side : {-1.0, 1.0}) scene.Add(RoofHalf(side, 1.5, 2.1, kRidge, 2.5, 0.08));
  scene.Add(Box({-kHalfX - 0.1, -kHalfY - 0.1, 0.0}, {kHalfX + 0.1, kHalfY + 0.1, 0.3}));  // plinth
  scene.Build();
  return scene;
}

Scene LargeBuilding() {
  constexpr double kHalfX = 35.0, kHalfY = 10.0, kTop = 10.6, kWall = 0.6, kPane = 0.55;
  Scene scene;
  scene.Add(Box({-120.0, -95.0, -1.0}, {120.0, 95.0, 0.0}));
  const auto windows = [](double half, double width, double pitch, double storey) {
    std::vector<Opening> row;
    for (double x = -half + 2.0; x + width < half - 1.0; x += pitch) {
      row.push_back({x, x + width, storey + 1.0, storey + 2.6});
    }
    return row;
  };
  for (int storey = 0; storey < 3; ++storey) {
    const double low = 3.5 * storey;
    const double high = storey < 2 ? low + 3.5 : kTop;
    for (const double side : {-1.0, 1.0}) {
      AddWall(scene,
              {false, -kHalfX, kHalfX, side * kHalfY, -side},
              low,
              high,
              kWall,
              windows(kHalfX, 1.4, 3.8, low),
              kPane);
      AddWall(scene,
              {true, -kHalfY, kHalfY, side * kHalfX, -side},
              low,
              high,
              kWall,
              windows(kHalfY, 1.2, 3.1, low),
              kPane);
    }
  }
  scene.Add(Box({-kHalfX - 0.4, -kHalfY - 0.4, kTop}, {kHalfX + 0.4, kHalfY + 0.4, 11.0}));
  scene.Build();
  return scene;
}

std::vector<View> TakeViews(const Scene& scene, int count, const Tour& tour, std::uint64_t seed) {
  SensorOptions sensor;
  sensor.organised = true;
  sensor.columns = static_cast<int>(std::lround(2 * std::numbers::pi / tour.pixel_rad));
  sensor.rings = static_cast<int>(
      std::lround((tour.elevation_max_rad - tour.elevation_min_rad) / tour.pixel_rad));
  sensor.elevation_min_rad = tour.elevation_min_rad;
  sensor.elevation_max_rad = tour.elevation_max_rad;
  sensor.max_range_m = 150.0;
  sensor.sigma_m = tour.sigma_m;
  sensor.sigma_per_metre = 0.0;
  std::vector<View> views;
  for (int i = 0; i < count; ++i) {
    const double angle = tour.first_angle_rad + 2 * std::numbers::pi * i / count;
    const Vector3d at(
        tour.half_x_m * std::cos(angle), tour.half_y_m * std::sin(angle), tour.height_m);
    const Eigen::AngleAxisd turn(std::atan2(-at.y(), -at.x()), Vector3d::UnitZ());
    View view;
    view.T_world_sensor = MakePose(Eigen::Quaterniond(turn), at);
    view.cloud =
        SimulateScan(scene, sensor, view.T_world_sensor, seed + static_cast<std::uint64_t>(i));
    views.push_back(std::move(view));
  }
  return views;
}

std::vector<Pose> NoisyStart(const std::vector<View>& views,
                             double sigma_rad,
                             double sigma_m,
                             std::uint64_t seed) {
  Random random(seed);
  std::vector<Pose> poses = {views.front().T_world_sensor};
  for (std::size_t i = 1; i < views.size(); ++i) {
    Vector6d step;
    for (int k = 0; k < 6; ++k) step(k) = (k < 3 ? sigma_rad : sigma_m) * random.Gaussian();
    poses.push_back(Retract(views[i].T_world_sensor, step));
  }
  return poses;
}

PoseErrors ErrorsOf(const std::vector<View>& views, const std::vector<Pose>& T_world_sensor) {
  const Pose gauge = views.front().T_world_sensor * T_world_sensor.front().inverse();
  PoseErrors errors;
  const auto n = static_cast<double>(views.size() - 1);
  for (std::size_t i = 1; i < views.size(); ++i) {
    const Pose& truth = views[i].T_world_sensor;
    const Pose moved = gauge * T_world_sensor[i];
    errors.angle_rad += RotationAngleRad(truth.inverse() * moved) / n;
    errors.position_m += (truth.translation() - moved.translation()).norm() / n;
  }
  return errors;
}

}  // namespace strata::testing
