// Upright walls with windows, for drawn houses.
#ifndef STRATA_TESTS_SUPPORT_SIMULATOR_WALLS_H_
#define STRATA_TESTS_SUPPORT_SIMULATOR_WALLS_H_

#include <cstdint>
#include <vector>

#include "tests/support/simulator/scene.h"

namespace strata::testing {

// A wall of a rectangular house along x (outer face at y = `face`) or, with x and y exchanged,
// along y. `from` to `to` along it, `inwards` is the sign of the way to the inside.
struct Wall {
  bool along_y = false;
  double from = 0.0, to = 0.0;
  double face = 0.0;
  double inwards = 1.0;
  std::uint16_t label = 0;
  std::uint16_t pane_label = 0;
};

struct Opening {
  double from = 0.0, to = 0.0;  // along the wall
  double sill = 0.0, lintel = 0.0;
};

// Adds the wall from `low` up to `high` with its openings, which come in order and do not overlap;
// at `pane_depth` behind the face they are closed by a pane (0: they are holes).
void AddWall(Scene& scene,
             const Wall& wall,
             double low,
             double high,
             double thickness,
             const std::vector<Opening>& openings,
             double pane_depth);

}  // namespace strata::testing

#endif  // STRATA_TESTS_SUPPORT_SIMULATOR_WALLS_H_
