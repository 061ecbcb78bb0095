// Regions of cells in one plane (thesis 5.2.1, Algorithm 2).
// Internal to core/planes, not installed.
#ifndef STRATA_CORE_PLANES_REGION_GROWING_H_
#define STRATA_CORE_PLANES_REGION_GROWING_H_

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/planes/extraction.h"
#include "core/planes/moments.h"
#include "core/planes/planar_cells.h"

namespace strata {

struct PlanarRegion {
  std::vector<std::uint32_t> cells;  // ascending
  Eigen::Matrix4d moments;           // total weight: the area [m²]
  MomentsFit fit;
};

// Connected regions, each cell in at most one. Unlike the thesis', a region is held against the
// plane through all of it, not against its first normal, it starts with the largest and flattest
// cells instead of random ones, and cells that do not fit its final plane leave it.
// `touching`: see TouchingCells().
std::vector<PlanarRegion> GrowRegions(std::span<const PlanarCell> cells,
                                      const std::vector<std::vector<std::uint32_t>>& touching,
                                      const PlaneExtractionOptions& options);

}  // namespace strata

#endif  // STRATA_CORE_PLANES_REGION_GROWING_H_
