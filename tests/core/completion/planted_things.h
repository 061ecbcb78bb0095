// Things of known kinds, as scanners see them.
#ifndef STRATA_TESTS_CORE_COMPLETION_PLANTED_THINGS_H_
#define STRATA_TESTS_CORE_COMPLETION_PLANTED_THINGS_H_

#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

#include <Eigen/Geometry>

#include "core/completion/entities.h"
#include "core/geometry/pose.h"
#include "core/world/things/kind.h"

namespace strata::testing {

// Boxes put together: low and high corners, on the ground at z = 0 [m].
using Solid = std::vector<Eigen::AlignedBox3d>;

// Two or three kinds of each class.
struct PlantedClass {
  std::uint16_t class_id = 0;
  std::vector<Solid> kinds;
};
std::vector<PlantedClass> PlantedClasses();

struct PlantedThing {
  std::uint16_t class_id = 0;
  std::size_t kind = 0;  // of its class
  bool partial = false;
  Pose T_map_kind = Pose::Identity();
  FoundEntity entity;
};

struct PlantedOptions {
  std::size_t of_each = 5;
  std::size_t partial = 2;  // of these
  double noise_m = 0.01;
  double spacing_m = 0.05;
};

// The surface of a solid, a point each `spacing_m` with noise; of a part of it, what lies on this
// side of a plane through it, upright and turned at random.
std::vector<Eigen::Vector3d> SeenOf(const Solid& solid,
                                    bool partial,
                                    const PlantedOptions& options,
                                    std::mt19937_64& random);

// What a finder would make of points in the map.
FoundEntity EntityOf(std::uint16_t class_id, const std::vector<Eigen::Vector3d>& points);

// In no particular order.
std::vector<PlantedThing> PlantThings(const std::vector<PlantedClass>& classes,
                                      const PlantedOptions& options,
                                      std::uint64_t seed);

}  // namespace strata::testing

#endif  // STRATA_TESTS_CORE_COMPLETION_PLANTED_THINGS_H_
