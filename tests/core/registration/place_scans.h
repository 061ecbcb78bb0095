// Scans of drawn worlds for the tests of places.
#ifndef STRATA_TESTS_CORE_REGISTRATION_PLACE_SCANS_H_
#define STRATA_TESTS_CORE_REGISTRATION_PLACE_SCANS_H_

#include <cstdint>

#include <Eigen/Geometry>

#include "core/cloud/sensor_model.h"
#include "core/geometry/pose.h"
#include "core/mls/build.h"
#include "tests/support/simulator/simulator.h"
#include "tests/support/simulator/worlds.h"

namespace strata::testing {

// The local map of a scan taken at `T_world_scan`.
inline MlsMap MapAt(const Scene& scene,
                    const Pose& T_world_scan,
                    std::uint64_t seed,
                    const SensorOptions& sensor = {.columns = 480}) {
  return BuildMlsMap(SimulateScan(scene, sensor, T_world_scan, seed),
                     Pose::Identity(),
                     SensorModel(),
                     MlsParameters())
      ->map;
}

// 1.2 m above the ground below (x, y, z).
inline Pose StandingAt(
    const Scene& scene, double x, double y, double z, double heading_rad, double tilt_rad = 0.0) {
  Pose T = Pose::Identity();
  T.linear() = (Eigen::AngleAxisd(heading_rad, Eigen::Vector3d::UnitZ()) *
                Eigen::AngleAxisd(tilt_rad, Eigen::Vector3d(0.6, 0.8, 0.0)))
                   .toRotationMatrix();
  T.translation() = Eigen::Vector3d(x, y, scene.GroundBelow(x, y, z).value_or(z) + 1.2);
  return T;
}

}  // namespace strata::testing

#endif  // STRATA_TESTS_CORE_REGISTRATION_PLACE_SCANS_H_
