// The cells of surface of planes that are known: of each plane its points in each of the largest
// cells, cut by nothing but the grid.
// Internal to core/planes, not installed.
#ifndef STRATA_CORE_PLANES_MODELS_CELLS_OF_PLANES_H_
#define STRATA_CORE_PLANES_MODELS_CELLS_OF_PLANES_H_

#include <vector>

#include <Eigen/Core>

#include "core/planes/extraction.h"
#include "core/planes/models/coloured_cells.h"
#include "core/planes/models/plane_mixture.h"
#include "core/planes/models/plane_model_finder.h"

namespace strata {

// Every point to the nearest of the planes that it is on; the cells are relative to points.origin,
// with ShareBorders(). Left out are planes most of whose points are on larger ones that cross them:
// slivers of several surfaces in one plane. Of no colour. Frame of the mixture: relative to
// `reference`.
std::vector<CellLayer> CellsOfPlanes(const PosedPoints& points,
                                     const Eigen::Vector3d& reference,
                                     const PlaneMixture& mixture,
                                     const PlaneExtractionOptions& options);

}  // namespace strata

#endif  // STRATA_CORE_PLANES_MODELS_CELLS_OF_PLANES_H_
