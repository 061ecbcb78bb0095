// Scans with exact poses: a scanner drives under and past a bridge between buildings and trees.
#ifndef STRATA_TESTS_BENCH_SIMULATED_BRIDGE_H_
#define STRATA_TESTS_BENCH_SIMULATED_BRIDGE_H_

#include <cstdint>
#include <vector>

#include "core/cloud/point_cloud.h"
#include "core/geometry/pose.h"

namespace strata::bench {

struct SimulatedScan {
  PointCloud cloud;
  Pose T_world_scan = Pose::Identity();
};

// `count` scans of a 64-row spinning scanner, about 1.5 m apart, with 2 cm range noise.
std::vector<SimulatedScan> SimulateBridge(int count, std::uint64_t seed);

}  // namespace strata::bench

#endif  // STRATA_TESTS_BENCH_SIMULATED_BRIDGE_H_
