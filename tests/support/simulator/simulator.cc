#include "tests/support/simulator/simulator.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <vector>

#include <Eigen/Geometry>

namespace strata::testing {
namespace {

using Eigen::Vector3d;

constexpr double kWheelBaseMeters = 1.0;
constexpr double kClimbMeters = 0.6;

// The height of the ground at (x, y) for a vehicle that stands at z.
double GroundAt(const Scene& scene, double x, double y, double z) {
  return scene.GroundBelow(x, y, z + kClimbMeters).value_or(z);
}

Pose PoseOnGround(const Scene& scene,
                  const Vector3d& place,
                  const Vector3d& heading,
                  double height) {
  const Vector3d half = 0.5 * kWheelBaseMeters * heading;
  const Vector3d side(-half.y(), half.x(), 0.0);
  const auto foot = [&](const Vector3d& offset) {
    const Vector3d p = place + offset;
    return Vector3d(p.x(), p.y(), GroundAt(scene, p.x(), p.y(), place.z()));
  };
  Eigen::Matrix3d R;
  R.col(0) = (foot(half) - foot(-half)).normalized();
  R.col(1) = foot(side) - foot(-side);
  R.col(2) = R.col(0).cross(R.col(1)).normalized();
  R.col(1) = R.col(2).cross(R.col(0));
  Pose T_world_sensor = Pose::Identity();
  T_world_sensor.linear() = R;
  T_world_sensor.translation() = place + height * R.col(2);
  return T_world_sensor;
}

}  // namespace

std::uint64_t Random::Bits() {
  std::uint64_t z = (state_ += 0x9e3779b97f4a7c15ULL);
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31);
}

double Random::Uniform(double low, double high) {
  return low + (high - low) * (static_cast<double>(Bits() >> 11) * 0x1.0p-53);
}

double Random::Gaussian() {  // Box and Muller
  const double radius = std::sqrt(-2.0 * std::log(1.0 - Uniform(0.0, 1.0)));
  return radius * std::cos(2.0 * std::numbers::pi * Uniform(0.0, 1.0));
}

PointCloud SimulateScan(const Scene& scene,
                        const SensorOptions& sensor,
                        const Pose& T_world_sensor,
                        std::uint64_t seed) {
  Random random(seed);
  PointCloud cloud;
  const double ring_step =
      (sensor.elevation_max_rad - sensor.elevation_min_rad) / std::max(sensor.rings - 1, 1);
  for (int ring = 0; ring < sensor.rings; ++ring) {
    const double elevation = sensor.elevation_min_rad + ring * ring_step;
    for (int column = 0; column < sensor.columns; ++column) {
      const double azimuth = 2.0 * std::numbers::pi * column / sensor.columns;
      const Vector3d beam(std::cos(elevation) * std::cos(azimuth),
                          std::cos(elevation) * std::sin(azimuth),
                          std::sin(elevation));
      const auto hit = scene.Trace(
          T_world_sensor.translation(), T_world_sensor.linear() * beam, sensor.max_range_m);
      const bool seen = hit.has_value() && hit->range >= sensor.min_range_m;
      const bool told = !hit.has_value() && sensor.no_return_m > 0.0;
      if (!seen && !told && !sensor.organised) continue;
      if (seen) {
        const double sigma = sensor.sigma_m + sensor.sigma_per_metre * hit->range;
        cloud.points.emplace_back(((hit->range + sigma * random.Gaussian()) * beam).cast<float>());
      } else if (told) {
        cloud.points.emplace_back((sensor.no_return_m * beam).cast<float>());
      } else {
        cloud.points.emplace_back(
            Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN()));
      }
      if (sensor.labelled) cloud.label.push_back(seen ? hit->label : std::uint16_t{0});
    }
  }
  if (sensor.organised) {
    cloud.rows = static_cast<std::uint32_t>(sensor.rings);
    cloud.columns = static_cast<std::uint32_t>(sensor.columns);
  }
  return cloud;
}

std::vector<Pose> Drive(const Scene& scene,
                        const std::vector<Vector3d>& waypoints,
                        double step_m,
                        double height_m) {
  std::vector<Pose> poses;
  double z = waypoints.front().z();
  double carry = 0.0;  // way driven since the last pose
  for (std::size_t i = 0; i + 1 < waypoints.size(); ++i) {
    Vector3d heading = waypoints[i + 1] - waypoints[i];
    heading.z() = 0.0;
    const double length = heading.norm();
    heading /= length;
    // Follows the surface in small steps, so that the level is never lost on a slope.
    constexpr double kFollow = 0.1;
    const int steps = static_cast<int>(std::ceil(length / kFollow - 1e-9));
    for (int step = 0; step < steps; ++step) {
      Vector3d place = waypoints[i] + step * kFollow * heading;
      z = GroundAt(scene, place.x(), place.y(), z);
      place.z() = z;
      if (poses.empty() || carry >= step_m - 1e-9) {
        poses.push_back(PoseOnGround(scene, place, heading, height_m));
        carry = 0.0;
      }
      carry += kFollow;
    }
  }
  return poses;
}

std::vector<Pose> NoisyOdometry(const std::vector<Pose>& T_world_sensor,
                                const OdometryNoise& noise,
                                std::uint64_t seed) {
  Random random(seed);
  std::vector<Pose> noisy;
  for (std::size_t i = 0; i < T_world_sensor.size(); ++i) {
    if (i == 0) {
      noisy.push_back(T_world_sensor[0]);
      continue;
    }
    Vector6d step;
    for (int axis = 0; axis < 6; ++axis) {
      step[axis] =
          random.Gaussian() * (axis < 3 ? noise.rotation_sigma_rad : noise.translation_sigma_m);
    }
    const Pose T_before_now = T_world_sensor[i - 1].inverse() * T_world_sensor[i];
    noisy.push_back(Normalized(noisy.back() * Retract(T_before_now, step)));
  }
  return noisy;
}

}  // namespace strata::testing
