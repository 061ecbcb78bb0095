// The flat cells of points that no plane explains: what is left at borders, in corners and of small
// faces, where cells of an octree hold several surfaces or too few points.
// Internal to core/planes, not installed.
#ifndef STRATA_CORE_PLANES_MODELS_PEELED_CELLS_H_
#define STRATA_CORE_PLANES_MODELS_PEELED_CELLS_H_

#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/planes/extraction.h"
#include "core/planes/models/coloured_cells.h"

namespace strata {

// Of each of the largest cells the plane that most of `left` are near (RANSAC: Fischler and Bolles
// 1981), then that of the rest, while they are flat and few points are just beside them. The k-th
// of all places are the k-th layer, of no colour. Where the points of `known` planes are by far
// more, what is left is how they scatter, and no cell.
std::vector<CellLayer> PeelCells(std::span<const Eigen::Vector3f> left,
                                 std::span<const Eigen::Vector3f> known,
                                 const PlaneExtractionOptions& options);

}  // namespace strata

#endif  // STRATA_CORE_PLANES_MODELS_PEELED_CELLS_H_
