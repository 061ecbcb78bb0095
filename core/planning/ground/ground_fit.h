// How the ground lies around a surface: its local plane (core/mls/local_plane.h), fitted so that a
// kerb is a step between two grounds and not a steep slope.
#ifndef STRATA_CORE_PLANNING_GROUND_GROUND_FIT_H_
#define STRATA_CORE_PLANNING_GROUND_GROUND_FIT_H_

#include <cstdint>

#include "core/planning/ground/ground_window.h"

namespace strata {

// Cells on each side of a surface that its fit looks at.
inline constexpr int kFitRadius = 2;

struct GroundFit {
  float slope_rad = 0.0F;          // of the plane
  float certain_slope_tan = 0.0F;  // tan of the slope less kNoiseGate σ of it, ≥ 0: for the limit
  float roughness_m = 0.0F;        // LocalPlane::roughness_m: what noise does not explain
};

// The plane through the (2 · kFitRadius + 1)² cells around surface `i`; each cell gives its surface
// nearest in height that is no underside, if |Δz| ≤ 2 d + 5 cm. Where that plane leaves more than
// noise and one of the four corner quadrants has a plane with less than half its residual, the best
// such is taken: the ground is broken there and the surface belongs to that side. Fewer than 4
// cells, or cells in a line: flat and smooth. Independent of a profile. REQUIRES: the surface is at
// least kFitRadius cells inside the window.
GroundFit FitGround(const GroundWindow& window, std::uint32_t i);

}  // namespace strata

#endif  // STRATA_CORE_PLANNING_GROUND_GROUND_FIT_H_
