#include <array>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <map>
#include <vector>

#include <CGAL/Alpha_shape_3.h>
#include <CGAL/Alpha_shape_cell_base_3.h>
#include <CGAL/Alpha_shape_vertex_base_3.h>
#include <CGAL/Delaunay_triangulation_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_data_structure_3.h>
#include <Eigen/Core>

#include "tests/experiments/meshes/mesh_peers.h"

namespace strata::testing {

TriangleMesh CgalAlphaShape(const std::vector<Eigen::Vector3d>& points, double alpha_m2) {
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  using Vertices = CGAL::Alpha_shape_vertex_base_3<Kernel>;
  using Cells = CGAL::Alpha_shape_cell_base_3<Kernel>;
  using Delaunay =
      CGAL::Delaunay_triangulation_3<Kernel, CGAL::Triangulation_data_structure_3<Vertices, Cells>>;
  using Shape = CGAL::Alpha_shape_3<Delaunay>;
  std::vector<Kernel::Point_3> theirs;
  for (const Eigen::Vector3d& p : points) theirs.emplace_back(p.x(), p.y(), p.z());
  Shape shape(theirs.begin(), theirs.end(), alpha_m2, Shape::GENERAL);
  std::vector<Shape::Facet> facets;
  shape.get_alpha_shape_facets(std::back_inserter(facets), Shape::SINGULAR);
  shape.get_alpha_shape_facets(std::back_inserter(facets), Shape::REGULAR);
  TriangleMesh mesh;
  std::map<const void*, std::uint32_t> index;
  for (const Shape::Facet& facet : facets) {
    Triangle triangle{};
    for (int i = 0, k = 0; i < 4; ++i) {
      if (i == facet.second) continue;
      const auto vertex = facet.first->vertex(i);
      const auto [it, fresh] =
          index.emplace(&*vertex, static_cast<std::uint32_t>(mesh.vertices.size()));
      const auto& p = vertex->point();
      if (fresh) mesh.vertices.emplace_back(p.x(), p.y(), p.z());
      triangle[static_cast<std::size_t>(k++)] = it->second;
    }
    mesh.triangles.push_back(triangle);
  }
  return mesh;
}

}  // namespace strata::testing
