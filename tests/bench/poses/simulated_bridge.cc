#include "tests/bench/poses/simulated_bridge.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include <Eigen/Geometry>

namespace strata::bench {
namespace {

constexpr double kMaxRangeM = 80.0;

// Turned about the vertical through its centre.
struct Box {
  Eigen::Vector3d centre;
  Eigen::Vector3d half;
  double yaw_rad = 0.0;
};

double GroundHeight(double x, double y) { return 0.25 * std::sin(x / 11.0) * std::cos(y / 13.0); }

std::vector<Box> BridgeWorld(std::mt19937_64& random) {
  std::vector<Box> boxes;
  // The road runs along x; the bridge crosses it along y at x = 20, 5 m above, with piers,
  // parapets and embankments.
  boxes.push_back({{20, 0, 5.4}, {4.0, 30, 0.4}});
  boxes.push_back({{16.2, 0, 6.3}, {0.15, 30, 0.5}});
  boxes.push_back({{23.8, 0, 6.3}, {0.15, 30, 0.5}});
  for (const double y : {-9.0, 9.0}) {
    for (const double x : {17.5, 22.5}) boxes.push_back({{x, y, 2.5}, {0.4, 0.4, 2.6}});
  }
  for (const double y : {-24.0, 24.0}) boxes.push_back({{20, y, 2.4}, {4.0, 6.0, 2.6}});
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const auto between = [&](double a, double b) { return a + (b - a) * unit(random); };
  for (int i = 0; i < 8; ++i) {  // buildings
    const double side = i % 2 == 0 ? 1.0 : -1.0;
    const double height = between(3.0, 7.0);
    boxes.push_back({{-40.0 + 12.0 * i + between(-2, 2), side * between(22.0, 32.0), height},
                     {between(4, 8), between(4, 7), height},
                     between(-0.3, 0.3)});
  }
  for (int i = 0; i < 24; ++i) {  // trunks, lamps, parked cars
    const double side = i % 2 == 0 ? 1.0 : -1.0;
    const double x = -40.0 + 4.0 * i + between(-1, 1);
    if (i % 3 == 0) {
      boxes.push_back({{x, side * between(5, 7), 0.8}, {2.1, 0.9, 0.75}, between(-0.1, 0.1)});
    } else {
      boxes.push_back({{x, side * between(8, 14), 2.5}, {0.15, 0.15, 3.0}, between(0, 1)});
    }
  }
  return boxes;
}

double RangeToBox(const Eigen::Vector3d& from, const Eigen::Vector3d& direction, const Box& box) {
  const Eigen::AngleAxisd turn(-box.yaw_rad, Eigen::Vector3d::UnitZ());
  const Eigen::Vector3d o = turn * (from - box.centre);
  const Eigen::Vector3d d = turn * direction;
  double enter = 0.0;
  double leave = kMaxRangeM;
  for (int k = 0; k < 3; ++k) {
    const double a = (-box.half[k] - o[k]) / d[k];
    const double b = (box.half[k] - o[k]) / d[k];
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  return enter <= leave && enter > 0.0 ? enter : kMaxRangeM;
}

double RangeToGround(const Eigen::Vector3d& from, const Eigen::Vector3d& direction) {
  if (direction.z() > -0.01) return kMaxRangeM;
  double range = -from.z() / direction.z();
  for (int i = 0; i < 20; ++i) {  // a gentle height field: the fixed point converges
    const Eigen::Vector3d p = from + range * direction;
    range += (GroundHeight(p.x(), p.y()) - p.z()) / direction.z();
  }
  return std::clamp(range, 0.0, kMaxRangeM);
}

PointCloud Scan(const std::vector<Box>& boxes, const Pose& T_world_scan, std::mt19937_64& random) {
  std::normal_distribution<double> noise(0.0, 0.02);
  PointCloud cloud;
  const Eigen::Vector3d from = T_world_scan.translation();
  for (int row = 0; row < 64; ++row) {
    const double elevation = (-25.0 + 35.0 * row / 63.0) * std::numbers::pi / 180.0;
    for (int column = 0; column < 900; ++column) {
      const double azimuth = 2.0 * std::numbers::pi * column / 900.0;
      const Eigen::Vector3d ray(std::cos(elevation) * std::cos(azimuth),
                                std::cos(elevation) * std::sin(azimuth),
                                std::sin(elevation));
      const Eigen::Vector3d direction = T_world_scan.linear() * ray;
      double range = RangeToGround(from, direction);
      for (const Box& box : boxes) range = std::min(range, RangeToBox(from, direction, box));
      if (range < kMaxRangeM) {
        cloud.points.push_back(((range + noise(random)) * ray).cast<float>());
      }
    }
  }
  return cloud;
}

}  // namespace

std::vector<SimulatedScan> SimulateBridge(int count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const std::vector<Box> boxes = BridgeWorld(random);
  std::uniform_real_distribution<double> wobble(-0.02, 0.02);
  std::vector<SimulatedScan> scans(count);
  for (int i = 0; i < count; ++i) {
    const double x = -10.0 + 1.5 * i;
    const double y = 2.0 * std::sin(x / 8.0);
    const double yaw = std::atan(0.25 * std::cos(x / 8.0)) + wobble(random);
    const Eigen::Quaterniond q = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
                                 Eigen::AngleAxisd(wobble(random), Eigen::Vector3d::UnitY()) *
                                 Eigen::AngleAxisd(wobble(random), Eigen::Vector3d::UnitX());
    scans[i].T_world_scan = MakePose(q, {x, y, GroundHeight(x, y) + 1.8});
    scans[i].cloud = Scan(boxes, scans[i].T_world_scan, random);
  }
  return scans;
}

}  // namespace strata::bench
