// Straight polylines out of edgels (thesis 5.2.3 steps 2 to 4).
// Internal to core/planes, not installed.
#ifndef STRATA_CORE_PLANES_EDGE_LINES_H_
#define STRATA_CORE_PLANES_EDGE_LINES_H_

#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/planes/scan_planes.h"

namespace strata {

struct EdgeLineOptions {
  double neighbour_radius_m = 0.5;  // of tangents, and along an edge from edgel to edgel
  double width_m = 0.1;             // across an edge from edgel to edgel
  double min_length_m = 1.0;
};

// Tangents are first principal directions of an edgel's neighbours; where these lie along no line
// the edgel is dropped. Tangents are clustered in a histogram over the half sphere, each cluster by
// region growing in space; a polyline has one vertex for every neighbour_radius_m of its edge.
std::vector<EdgeFeature> FindEdgeLines(std::span<const Eigen::Vector3d> edgels,
                                       const EdgeLineOptions& options);

}  // namespace strata

#endif  // STRATA_CORE_PLANES_EDGE_LINES_H_
