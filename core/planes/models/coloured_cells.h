// The flat cells of points, each of one colour where the points have colours (thesis 5.5).
// Internal to core/planes, not installed.
#ifndef STRATA_CORE_PLANES_MODELS_COLOURED_CELLS_H_
#define STRATA_CORE_PLANES_MODELS_COLOURED_CELLS_H_

#include <vector>

#include "core/planes/extraction.h"
#include "core/planes/models/plane_colour.h"
#include "core/planes/models/plane_model_finder.h"
#include "core/planes/planar_cells.h"

namespace strata {

struct CellColour {
  LabColour mean = LabColour::Zero();
  double variance = 0.0;  // of the points about it, all three together
};

struct CellLayer {
  std::vector<PlanarCell> cells;    // which do not overlap
  std::vector<CellColour> colours;  // of each
};

// Points without colours make one layer of FindPlanarCells(). With colours, where a place has
// several, cells of several layers may overlap. In each of the largest cells the points fall into
// parts wherever their colours do: else a carpet and the floor around it were one cell, as flat as
// either alone. A part has at most so much surface as its share of the points allows: those of a
// reflection are few, wherever they lie.
//
// All of them with ShareBorders().
//
// REQUIRES: options.sensor is the same at any range.
std::vector<CellLayer> FindColouredCells(const PosedPoints& points,
                                         const PlaneExtractionOptions& options);

// A surface along a border of the cells' grid is in cells on both sides of it, each as wide as all
// of it: of what they both cover, seen across the border, they share the area as they share the
// points there. Else it counted twice, and the side with few points drew the plane to itself as
// much as the other, by millimetres, as a carpet is thick. Of colours that are not alike there are
// two surfaces.
void ShareBorders(std::vector<CellLayer>& layers);

}  // namespace strata

#endif  // STRATA_CORE_PLANES_MODELS_COLOURED_CELLS_H_
