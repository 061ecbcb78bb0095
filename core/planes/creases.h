// Edges where two flat regions meet.
// Internal to core/planes, not installed.
#ifndef STRATA_CORE_PLANES_CREASES_H_
#define STRATA_CORE_PLANES_CREASES_H_

#include <span>
#include <vector>

#include "core/planes/extraction.h"
#include "core/planes/planar_cells.h"
#include "core/planes/region_growing.h"
#include "core/planes/scan_planes.h"

namespace strata {

// The pieces of the intersection lines of any two regions that both reach, at least
// min_edge_length_m long. Planes that meet at less than 20° give no line worth having.
std::vector<EdgeFeature> FindCreases(std::span<const PlanarCell> cells,
                                     std::span<const PlanarRegion> regions,
                                     const PlaneExtractionOptions& options);

}  // namespace strata

#endif  // STRATA_CORE_PLANES_CREASES_H_
