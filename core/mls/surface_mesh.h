// Multi-level surface maps as polygons (thesis 6.5.6), for pictures and exports.
#ifndef STRATA_CORE_MLS_SURFACE_MESH_H_
#define STRATA_CORE_MLS_SURFACE_MESH_H_

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/mls/surface_tile.h"

namespace strata {

// Index arrays over one vertex a surface. Faces are counter-clockwise seen from above.
struct SurfaceMesh {
  // The surfaces of the tiles in the order given: middle of the cell, height of the surface [m].
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::uint32_t> first_vertex;  // of each tile
  std::vector<std::array<std::uint32_t, 4>> quads;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::array<std::uint32_t, 2>> lines;  // edges that no face has
  std::vector<std::uint32_t> points;                // vertices without any neighbour

  // What stands below a vertical patch: from its vertex straight down to bottom_m.
  struct VerticalSegment {
    std::uint32_t vertex = 0;
    double bottom_m = 0.0;
    friend bool operator==(const VerticalSegment&, const VerticalSegment&) = default;
  };
  std::vector<VerticalSegment> verticals;
};

struct SurfaceMeshOptions {
  // Neighbouring surfaces may differ by 3·√(σ₁² + σ₂²) and by this slope over the distance of their
  // cells; in [0, 1.5].
  double max_slope_rad = 0.785;
};

// Links every surface with the nearest one in each adjacent cell when both are each other's nearest
// and their heights fit; a surface therefore has at most one link a direction, and levels stay
// apart. In every square of four cells the linked surfaces become a quad if they close, and
// triangles where three are linked around a corner; links without a face become lines, and so do
// diagonals between surfaces that have no other link in their square.
//
// Unlike 6.5.6, which looks from each cell towards +x and +y only, a square whose first cell is
// empty gives a triangle too, no edge of a face is repeated as a line, and a surface that others
// link to is not isolated.
//
// `tiles`: not null, of one level, distinct, surfaces sorted and rows indexed, together below 2³²
// surfaces. Borders between them do not show. `cell_size_m` is that of level 0.
SurfaceMesh MakeSurfaceMesh(std::span<const SurfaceTile* const> tiles,
                            double cell_size_m,
                            const SurfaceMeshOptions& options = {});

}  // namespace strata

#endif  // STRATA_CORE_MLS_SURFACE_MESH_H_
