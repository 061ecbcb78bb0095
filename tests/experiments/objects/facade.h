// The facade of the thesis' chapter 11: three kinds of windows, and a tree before two of them.
#ifndef STRATA_TESTS_EXPERIMENTS_OBJECTS_FACADE_H_
#define STRATA_TESTS_EXPERIMENTS_OBJECTS_FACADE_H_

#include <cstdint>
#include <vector>

#include <Eigen/Geometry>

#include "tests/support/simulator/scene.h"
#include "tests/support/simulator/simulator.h"

namespace strata::testing {

inline constexpr std::uint16_t kWallClass = 1, kWindowClass = 2, kGutterClass = 3;

enum class WindowKind : std::uint8_t { kDouble = 0, kRoof = 1, kBasement = 2 };

struct FacadeWindow {
  WindowKind kind = WindowKind::kDouble;
  Eigen::AlignedBox3d box;  // around it, nothing else of its class in it
};

// The wall's face is the plane y = 0, the street y < 0.
struct Facade {
  Scene bare, with_tree;
  std::vector<FacadeWindow> windows;
};

// Columns of windows, two storeys of double ones between smaller ones in the basement and beneath
// the eaves; all of a kind are alike. The tree hides a half or more of two double windows, one
// above the other.
Facade DrawFacade(std::uint64_t seed);

// A pan-tilt scanner's, of 2.2 mrad.
SensorOptions FacadeSensor();

}  // namespace strata::testing

#endif  // STRATA_TESTS_EXPERIMENTS_OBJECTS_FACADE_H_
