// Whether triangles are the surface of a solid.
#ifndef STRATA_CORE_MESH_MESH_CHECK_H_
#define STRATA_CORE_MESH_MESH_CHECK_H_

#include <cstddef>
#include <cstdint>

#include "core/mesh/triangle_mesh.h"

namespace strata {

struct MeshCheck {
  std::size_t edges = 0;
  std::size_t boundary_edges = 0;     // of one triangle
  std::size_t nonmanifold_edges = 0;  // of three and more
  std::size_t twisted_edges = 0;      // of two triangles that face opposite ways
  // Vertices that have triangles − edges + triangles: 2 for each closed part without handles.
  std::int64_t euler_characteristic = 0;

  // Without a border: each edge has two triangles or more.
  bool closed() const { return edges > 0 && boundary_edges == 0; }
  bool manifold() const { return nonmanifold_edges == 0 && twisted_edges == 0; }
};

// Counts edges once. REQUIRES: fewer than 2³¹ vertices, indices of vertices. Takes 24 bytes a
// triangle beside the mesh.
MeshCheck CheckMesh(const TriangleMesh& mesh);

}  // namespace strata

#endif  // STRATA_CORE_MESH_MESH_CHECK_H_
