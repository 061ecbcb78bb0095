// Where a robot can drive: every surface of a tile judged by the plane through the tops around it
// (thesis 6.2.2, 6.4.2, 6.5.4).
//
// The top of every patch is a candidate, whatever its depth: a deck, a slab or a ramp's toe is a
// thick interval and yet ground. A wall's top fails by the steps beside it.
//
// Rules, for a surface at height z with the limits of one robot. A height difference counts only
// beyond what the σ of both heights explain: 3·√(σ₁² + σ₂²).
//   - Neighbours: in each cell within kPlaneRadiusCells the surface whose top is nearest to z, if
//     it is within reach: the steps a robot could climb on the way (at most half its height), or
//     the steepest slope it could drive, whichever is more. Levels of one cell are never mixed.
//   - Slope and roughness: those of the plane through these tops (LocalPlane). If that plane is too
//     steep and leaves more residual than noise, a step lies in the window; the surface then stands
//     on the quarter of the window that a plane explains best, if σ explains that one's residual.
//   - Step: to each of the eight cells around, when something was measured there. The nearest top
//     may differ by max_step or by the steepest slope over that distance. Where none does: a body
//     that reaches into the robot's height blocks; ground only below is a drop. Cells with nothing,
//     or with surfaces above the robot's head only, say nothing.
//   - Clearance: the underside of the next surface of the same cell is at least clearance_m above.
//   - Undersides (kUnderside) are no ground and part of no plane. Where one is within max_step
//     above the surface, or up to kMaxDeckM below it, a deck goes on whose top was not seen: ground
//     below is no drop. Higher ones are bodies that block. Nor is it a drop through the few cells
//     of a deck that no beam hit, from above or below (DeckGoesOn).
// Traversable: all limits hold. Non-traversable: one does not, or a vertical patch has no plane
// around it (a pole). Unknown: a horizontal patch with too few neighbours to fit a plane to.
#ifndef STRATA_CORE_MLS_TRAVERSABILITY_H_
#define STRATA_CORE_MLS_TRAVERSABILITY_H_

#include <array>
#include <vector>

#include <Eigen/Core>

#include "core/mls/local_plane.h"
#include "core/mls/surface_tile.h"

namespace strata {

inline constexpr int kPlaneRadiusCells = 2;

// What one robot can take; see RobotProfile for the ranges.
struct TraversabilityLimits {
  double max_slope_rad = 0.35;
  double max_step_m = 0.15;
  double max_roughness_m = 0.08;
  double clearance_m = 1.0;
};

// A tile's eight neighbours in the grid, row by row: index (dy + 1)·3 + (dx + 1) for offsets dx, dy
// in {−1, 0, 1}; nullptr where the map has nothing. The middle is not read.
using SurfaceNeighbourhood = std::array<const SurfaceTile*, 9>;

// What was found out about one surface.
struct SurfaceAssessment {
  Traversability traversability = Traversability::kUnknown;
  // The plane's; a zero normal, slope 0 and roughness 0 where there are too few neighbours.
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();
  float slope_rad = 0.0F;
  float roughness_m = 0.0F;
  // Largest height difference to a cell around, beyond noise; +inf next to a wall or a drop.
  float step_m = 0.0F;
  float danger = 0.0F;
};

// The path cost factor of 6.2.2: a step of length l over a surface costs l · (1 + danger). With
// each ratio at most 4,
//   danger = (slope/max_slope)² + (roughness/max_roughness)² + (step/max_step)² + (σ/max_step)²,
// so 0 on certain flat ground, and 1 for each limit that is just reached. Without a plane its slope
// and roughness are taken to be at their limits.
double Danger(double slope_rad,
              double roughness_m,
              double step_m,
              double sigma_m,
              const TraversabilityLimits& limits);

// One entry a surface, in order; that of an underside says just that. A pure function of the
// surfaces (height, σ, depth) of the tile and of its neighbours.
// REQUIRES: surfaces sorted and rows indexed.
std::vector<SurfaceAssessment> AssessSurfaces(const SurfaceTile& tile,
                                              const SurfaceNeighbourhood& neighbours,
                                              double cell_size_m,
                                              const TraversabilityLimits& limits);

// Sets traversability and cost (= danger) of every surface to AssessSurfaces'; undersides stay what
// they are, at cost 0. Thread-safe for
// different tiles as long as nobody changes z, σ or depth of the neighbours.
void AnnotateTraversability(SurfaceTile& tile,
                            const SurfaceNeighbourhood& neighbours,
                            double cell_size_m,
                            const TraversabilityLimits& limits);

// Upward unit normals (12.2.1), one a surface; zero of undersides and where there are too few
// neighbours.
std::vector<Eigen::Vector3f> EstimateNormals(const SurfaceTile& tile,
                                             const SurfaceNeighbourhood& neighbours,
                                             double cell_size_m,
                                             const TraversabilityLimits& limits = {});

}  // namespace strata

#endif  // STRATA_CORE_MLS_TRAVERSABILITY_H_
