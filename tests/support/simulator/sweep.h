// A robot driven along a path through a drawn world's exact solids: an oracle for paths that knows
// nothing of cells, patches or tiles.
#ifndef STRATA_TESTS_SUPPORT_SIMULATOR_SWEEP_H_
#define STRATA_TESTS_SUPPORT_SIMULATOR_SWEEP_H_

#include <string>
#include <vector>

#include <Eigen/Core>

#include "core/world/robot_profile.h"
#include "tests/support/simulator/scene.h"

namespace strata::testing {

// What a sweep found. `ground` holds the robot's foot points, a few centimetres apart, as far as
// it came.
struct Swept {
  std::string collision;  // empty: the whole path is free
  std::vector<Eigen::Vector3d> ground;
};

// Drives an upright cylinder of the profile's radius and height along the polyline through
// `waypoints` (on surfaces, map frame). It follows the ground from the first waypoint on and must
// pass within 0.15 m in height of every other one, so it cannot change its level unseen. At every
// step, with `slack_m` for range noise and the size of a cell:
//   - ground is there all around the footprint, no higher or lower than steps and slope allow;
//   - nothing stands inside the cylinder above what steps and slope allow, nor hangs into it.
Swept Sweep(const Scene& scene,
            const std::vector<Eigen::Vector3d>& waypoints,
            const RobotProfile& profile,
            double slack_m = 0.05);

}  // namespace strata::testing

#endif  // STRATA_TESTS_SUPPORT_SIMULATOR_SWEEP_H_
