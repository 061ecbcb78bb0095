// The scenes of the thesis' experiments on global constraints (7.4.4) and the views taken of them.
#ifndef STRATA_TESTS_SUPPORT_SIMULATOR_VIEWS_H_
#define STRATA_TESTS_SUPPORT_SIMULATOR_VIEWS_H_

#include <cstdint>
#include <vector>

#include "core/cloud/point_cloud.h"
#include "core/geometry/pose.h"
#include "tests/support/simulator/scene.h"

namespace strata::testing {

// The object of Table 7.1 and Fig. 7.9, 3 m wide (x), 5 m long (y) and 3 m high, standing free
// around the origin: hollow walls with a door and windows on one sill and one lintel height all
// around, a plinth, and a gable roof with overhanging eaves. There is no ground, and from 1.5 m
// above its base no roof: what views share is walls and edges.
Scene SmallHouse();

// The building of Fig. 7.8: 70 × 20 × 11 m, three rows of recessed windows at the same heights on
// all sides, a cornice, on a level yard.
Scene LargeBuilding();

struct View {
  Pose T_world_sensor = Pose::Identity();
  PointCloud cloud;  // organised
};

// Organised scans from `count` places on an ellipse with these half axes, `height_m` above z = 0,
// the first one at `first_angle_rad`, each looking at the centre. The noise is `sigma_m` along the
// beam.
struct Tour {
  double half_x_m = 6.0;
  double half_y_m = 6.0;
  double height_m = 1.5;
  double first_angle_rad = 0.785398;
  double pixel_rad = 0.0087;  // between beams, both ways
  double elevation_min_rad = -0.45;
  double elevation_max_rad = 0.45;
  double sigma_m = 0.01;
};
std::vector<View> TakeViews(const Scene& scene, int count, const Tour& tour, std::uint64_t seed);

// True poses with Gaussian noise of σ_rad about and σ_m along every axis (right-hand steps) on all
// but the first, which is held as the thesis does (7.4.2).
std::vector<Pose> NoisyStart(const std::vector<View>& views,
                             double sigma_rad,
                             double sigma_m,
                             std::uint64_t seed);

// Mean angle and mean distance between poses and truth over all poses but the first, after moving
// everything so that the first ones agree.
struct PoseErrors {
  double angle_rad = 0.0;
  double position_m = 0.0;
};
PoseErrors ErrorsOf(const std::vector<View>& views, const std::vector<Pose>& T_world_sensor);

}  // namespace strata::testing

#endif  // STRATA_TESTS_SUPPORT_SIMULATOR_VIEWS_H_
