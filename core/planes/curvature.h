// How much a region of flat cells is bent.
// Internal to core/planes, not installed.
#ifndef STRATA_CORE_PLANES_CURVATURE_H_
#define STRATA_CORE_PLANES_CURVATURE_H_

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/planes/planar_cells.h"

namespace strata {

// `members`, and where they are few also what touches them and lies the same way to
// `max_angle_rad`: one or two cells say nothing of how their surface is bent. `touching`: see
// TouchingCells().
std::vector<std::uint32_t> AroundFew(std::span<const PlanarCell> cells,
                                     const std::vector<std::vector<std::uint32_t>>& touching,
                                     std::span<const std::uint32_t> members,
                                     double max_angle_rad);

// Of the surface that the cells `members` lie on, by where they are and how they are tilted:
// (k_uu, k_uv, k_vv) [1/m] of z = c + gᵀ x + ½ xᵀ K x over the plane of (axis_u, axis_v), unit
// vectors at right angles. Zeros where its larger principal curvature is less than four times its
// own σ, and for fewer than four cells.
Eigen::Vector3d CurvatureOf(std::span<const PlanarCell> cells,
                            std::span<const std::uint32_t> members,
                            const Eigen::Vector3d& axis_u,
                            const Eigen::Vector3d& axis_v);

}  // namespace strata

#endif  // STRATA_CORE_PLANES_CURVATURE_H_
