// Robots on storeys of a house that look alike, and alike after half a turn: walls and doors are
// the same, only what stands in the rooms is not.
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include <Eigen/Core>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/core/engine/engine_fixture.h"
#include "tests/support/simulator/scene.h"
#include "tests/support/simulator/simulator.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::HasSubstr;

constexpr double kStoreyM = 3.3;
constexpr double kSlabM = 0.3;

// 30 x 20 m of three rooms a storey, the middle ones joined by a void of 6 x 6 m.
Scene House(std::uint64_t seed) {
  Scene scene;
  const auto box = [&scene](double x0, double y0, double z0, double x1, double y1, double z1) {
    scene.Add(Box({x0, y0, z0}, {x1, y1, z1}));
  };
  box(-15, -10, -kSlabM, 15, 10, 0);
  box(-15, -10, kStoreyM - kSlabM, -3, 10, kStoreyM);
  box(3, -10, kStoreyM - kSlabM, 15, 10, kStoreyM);
  box(-3, -10, kStoreyM - kSlabM, 3, -3, kStoreyM);
  box(-3, 3, kStoreyM - kSlabM, 3, 10, kStoreyM);
  box(-15, -10, 2 * kStoreyM - kSlabM, 15, 10, 2 * kStoreyM);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  for (const double z : {0.0, kStoreyM}) {
    const double top = z + kStoreyM - kSlabM;
    for (const double side : {-1.0, 1.0}) {
      box(-15, 10 * side - 0.1, z, 15, 10 * side + 0.1, top);
      box(15 * side - 0.1, -10, z, 15 * side + 0.1, 10, top);
      box(9 * side - 0.1, -10, z, 9 * side + 0.1, -1.5, top);
      box(9 * side - 0.1, 1.5, z, 9 * side + 0.1, 10, top);
    }
    for (int k = 0; k < 8; ++k) {
      const double x = (k % 2 == 0 ? 1.0 : -1.0) * (4.5 + 9.0 * share(random));
      const double y = (k % 4 < 2 ? 1.0 : -1.0) * (5.5 + 3.0 * share(random));
      box(x, y, z, x + 0.5 + share(random), y + 0.5 + share(random), z + 0.4 + share(random));
    }
  }
  scene.Build();
  return scene;
}

// Once around through all three rooms.
std::vector<Pose> WayAt(double z) {
  constexpr std::array<std::array<double, 2>, 10> kCorners = {{{-13, 0},
                                                               {-6, 0},
                                                               {-5, 4.2},
                                                               {5, 4.2},
                                                               {6, 0},
                                                               {13, 0},
                                                               {6, 0},
                                                               {5, -4.2},
                                                               {-5, -4.2},
                                                               {-6, 0}}};
  std::vector<Pose> way;
  for (std::size_t k = 1; k < kCorners.size(); ++k) {
    const Eigen::Vector2d from(kCorners[k - 1].data()), to(kCorners[k].data());
    const Eigen::Vector2d leg = to - from;
    for (double along = 0.0; along < leg.norm(); along += 1.0) {
      const Eigen::Vector2d at = from + leg.normalized() * along;
      Pose pose = PoseAt(at.x(), at.y(), std::atan2(leg.y(), leg.x()));
      pose.translation().z() = z + 1.0;
      way.push_back(pose);
    }
  }
  return way;
}

using AlikeStoreysTest = EngineTest;

TEST_F(AlikeStoreysTest, RobotsStayOnTheirStoreys) {
  SensorOptions sensor;
  sensor.rings = 24;
  sensor.columns = 360;
  for (const std::uint64_t seed : {1, 2, 3}) {
    const std::string map = absl::StrCat("house", seed);
    SCOPED_TRACE(map);
    const Scene house = House(seed);
    MakeMap(MapParameters(), map);
    for (const double z : {0.0, kStoreyM}) {
      const Pose T_said = z > 0.0 ? PoseAt(0.7, -0.7, 0.05) : Pose::Identity();
      std::uint64_t k = 0;
      for (const Pose& truth : WayAt(z)) {
        const PointCloud cloud = SimulateScan(house, sensor, truth, 1000 * seed + k);
        const ScanId id{z > 0.0 ? "above" : "below", ++k};
        STRATA_ASSERT_OK(
            Upload(db(), HeaderOf(id, cloud, T_said * truth, Alignment::kOn), cloud, 6000, map));
      }
    }
    WaitIntegrated(db(), map);
    const JobInfo job = RunJob(db(), "optimize", {}, map);
    EXPECT_LT(job.metrics.at("shift_max_m"), 3.0) << job.message;
    if (job.metrics.at("parts_apart") > 0) {
      EXPECT_THAT(job.message, HasSubstr("Nothing joins"));
    }
  }
}

}  // namespace
}  // namespace strata::testing
