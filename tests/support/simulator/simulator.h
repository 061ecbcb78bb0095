// A spinning multi-beam range sensor carried through a Scene: scans with planted noise and exact
// poses.
#ifndef STRATA_TESTS_SUPPORT_SIMULATOR_SIMULATOR_H_
#define STRATA_TESTS_SUPPORT_SIMULATOR_SIMULATOR_H_

#include <cstdint>
#include <vector>

#include <Eigen/Geometry>

#include "core/cloud/point_cloud.h"
#include "core/geometry/pose.h"
#include "tests/support/simulator/scene.h"

namespace strata::testing {

// Random numbers that are the same on every machine and standard library (SplitMix64).
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  std::uint64_t Bits();
  double Uniform(double low, double high);  // [low, high)
  double Gaussian();                        // mean 0, σ 1

 private:
  std::uint64_t state_;
};

struct SensorOptions {
  int rings = 48;
  int columns = 720;  // azimuth steps of one turn
  double elevation_min_rad = -0.79;
  double elevation_max_rad = 0.44;
  double min_range_m = 0.5;
  double max_range_m = 60.0;
  double sigma_m = 0.01;  // Gaussian, along the beam
  double sigma_per_metre = 0.0005;
  // Where beams that meet nothing within max_range_m are said to end; 0: nothing is said of them.
  double no_return_m = 0.0;
  bool organised = false;  // rows = rings from below, NaN where nothing came back
  bool labelled = false;   // PointCloud::label is that of the solids
};

// One turn in the sensor's frame (x forward, y left, z up), with sensor_origin zero.
PointCloud SimulateScan(const Scene& scene,
                        const SensorOptions& sensor,
                        const Pose& T_world_sensor,
                        std::uint64_t seed);

// Poses of a sensor `height_m` above the ground along a polyline, a pose every `step_m` metres. The
// first waypoint's z says on which level it starts; the vehicle stays on its surface, climbs steps
// up to 0.6 m and tilts with the ground beneath its 1 m wheel base.
std::vector<Pose> Drive(const Scene& scene,
                        const std::vector<Eigen::Vector3d>& waypoints,
                        double step_m,
                        double height_m);

struct OdometryNoise {
  double translation_sigma_m = 0.03;  // per step and axis
  double rotation_sigma_rad = 0.005;  // per step and axis
};
// The chain of noisy relative poses from the exact first one.
std::vector<Pose> NoisyOdometry(const std::vector<Pose>& T_world_sensor,
                                const OdometryNoise& noise,
                                std::uint64_t seed);

}  // namespace strata::testing

#endif  // STRATA_TESTS_SUPPORT_SIMULATOR_SIMULATOR_H_
