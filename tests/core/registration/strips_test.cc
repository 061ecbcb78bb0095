// Sparse rings draw level lines on walls, whose heights go with the distance of the sensor.
#include <array>
#include <cmath>
#include <cstdint>

#include <Eigen/Core>
#include <gtest/gtest.h>

#include "core/cloud/sensor_model.h"
#include "core/common/random.h"
#include "core/mls/build.h"
#include "core/registration/mls_registration.h"
#include "tests/support/simulator/scene.h"
#include "tests/support/simulator/simulator.h"

namespace strata::testing {
namespace {

constexpr std::uint64_t kSeed = 1;

// A flat street with houses on both sides of it and beyond its ends.
Scene Street() {
  Scene scene;
  scene.Add(Box({-120.0, -120.0, -1.0}, {120.0, 120.0, 0.0}));
  SplitMix64 random(kSeed);
  for (double x = -80.0; x < 80.0; x += 25.0) {
    for (const double side : {-1.0, 1.0}) {
      const double near = 12.0 + 8.0 * random.Uniform();
      const double from = x + 8.0 * random.Uniform();
      const Eigen::Vector2d y(side * near, side * (near + 10.0));
      scene.Add(Box({from, y.minCoeff(), 0.0}, {from + 12.0, y.maxCoeff(), 9.0}));
    }
  }
  scene.Add(Box({45.0, -12.0, 0.0}, {55.0, 10.0, 10.0}));
  scene.Add(Box({-55.0, -10.0, 0.0}, {-45.0, 12.0, 10.0}));
  scene.Build();
  return scene;
}

ScanFeatures FeaturesFrom(const Scene& scene, const Pose& T_world_scan, std::uint64_t seed) {
  SensorOptions sensor;
  sensor.rings = 18;
  sensor.columns = 400;
  MlsParameters parameters;
  parameters.cell_size_m = 0.2;
  return ScanFeatures::FromMap(BuildMlsMap(SimulateScan(scene, sensor, T_world_scan, seed),
                                           Pose::Identity(),
                                           SensorModel(),
                                           parameters)
                                   ->map);
}

TEST(StripsTest, AChainOfScansDoesNotBendUpwards) {
  const Scene scene = Street();
  const auto at = [](double x) {
    Pose T = Pose::Identity();
    T.translation() = Eigen::Vector3d(x, 0.0, 1.2);
    return T;
  };
  double pitch_rad = 0.0;
  double climb_m = 0.0;
  constexpr int kPairs = 12;
  for (int k = 0; k < kPairs; ++k) {
    const double x = -20.0 + 3.0 * k;
    const ScanFeatures before = FeaturesFrom(scene, at(x), 2 * k + 1);
    const ScanFeatures after = FeaturesFrom(scene, at(x + 2.5), 2 * k + 2);
    const std::array<PlacedScan, 1> placed = {{{&before, Pose::Identity()}}};
    const Pose truth = at(x).inverse() * at(x + 2.5);
    const RegistrationResult result = RegisterScan(after, RegistrationTarget(placed), truth);
    const Pose off = truth.inverse() * result.T_target_source;
    pitch_rad += So3Log(off.linear()).y() / kPairs;
    climb_m += off.translation().z() / kPairs;
  }
  RecordProperty("pitch_urad", static_cast<int>(1e6 * pitch_rad));
  EXPECT_LT(std::abs(pitch_rad), 0.0015);  // 0.006 with the strips, 0.0025 with matches of lines
  EXPECT_LT(std::abs(climb_m), 0.0015);    // 0.005, 0.002
}

}  // namespace
}  // namespace strata::testing
