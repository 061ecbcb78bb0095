// The alpha shape beside CGAL's.
#include <algorithm>
#include <array>
#include <cstddef>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include <CGAL/Alpha_shape_3.h>
#include <CGAL/Alpha_shape_cell_base_3.h>
#include <CGAL/Alpha_shape_vertex_base_3.h>
#include <CGAL/Delaunay_triangulation_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_data_structure_3.h>
#include <Eigen/Core>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/mesh/alpha_shape.h"
#include "tests/core/mesh/shapes.h"
#include "tests/support/simulator/simulator.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using Eigen::Vector3d;
using Place = std::array<double, 3>;
using Facets = std::set<std::array<Place, 3>>;

Facets FacetsOf(const TriangleMesh& mesh) {
  Facets facets;
  for (const Triangle& t : mesh.triangles) {
    std::array<Place, 3> facet;
    for (std::size_t i = 0; i < 3; ++i) {
      const Vector3d& v = mesh.vertices[t[i]];
      facet[i] = {v.x(), v.y(), v.z()};
    }
    std::sort(facet.begin(), facet.end());
    facets.insert(facet);
  }
  return facets;
}

Facets PeersFacets(const std::vector<Vector3d>& points, double alpha_m2) {
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  using Vertices = CGAL::Alpha_shape_vertex_base_3<Kernel>;
  using Cells = CGAL::Alpha_shape_cell_base_3<Kernel>;
  using Delaunay =
      CGAL::Delaunay_triangulation_3<Kernel, CGAL::Triangulation_data_structure_3<Vertices, Cells>>;
  using Shape = CGAL::Alpha_shape_3<Delaunay>;
  std::vector<Kernel::Point_3> theirs;
  for (const Vector3d& p : points) theirs.emplace_back(p.x(), p.y(), p.z());
  Shape shape(theirs.begin(), theirs.end(), alpha_m2, Shape::GENERAL);
  std::vector<Shape::Facet> found;
  shape.get_alpha_shape_facets(std::back_inserter(found), Shape::SINGULAR);
  shape.get_alpha_shape_facets(std::back_inserter(found), Shape::REGULAR);
  Facets facets;
  for (const Shape::Facet& f : found) {
    std::array<Place, 3> facet;
    for (int i = 0, k = 0; i < 4; ++i) {
      if (i == f.second) continue;
      const auto& p = f.first->vertex(i)->point();
      facet[static_cast<std::size_t>(k++)] = {p.x(), p.y(), p.z()};
    }
    std::sort(facet.begin(), facet.end());
    facets.insert(facet);
  }
  return facets;
}

std::vector<Vector3d> InACube(std::size_t count, std::uint64_t seed) {
  testing::Random random(seed);
  std::vector<Vector3d> points;
  for (std::size_t i = 0; i < count; ++i) {
    points.emplace_back(random.Uniform(0, 1), random.Uniform(0, 1), random.Uniform(0, 1));
  }
  return points;
}

std::vector<Vector3d> OnANoisySphere(std::size_t count, std::uint64_t seed) {
  testing::Random random(seed);
  std::vector<Vector3d> points = testing::SpherePoints(count, 1.0, Vector3d::Zero());
  for (Vector3d& p : points) p *= 1.0 + 0.01 * random.Gaussian();
  return points;
}

TEST(AlphaShapeOracleTest, FacetsAreCgals) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    for (const auto& points : {InACube(600, seed), OnANoisySphere(800, seed)}) {
      for (const double alpha_m2 : {1e-4, 0.002, 0.006, 0.02, 0.3, 10.0}) {
        const auto shape = MakeAlphaShape(points, {.alpha_m2 = alpha_m2}, Stop());
        STRATA_ASSERT_OK(shape);
        const Facets theirs = PeersFacets(points, alpha_m2);
        EXPECT_EQ(FacetsOf(shape->mesh), theirs) << "seed " << seed << ", α " << alpha_m2;
      }
    }
  }
}

}  // namespace
}  // namespace strata
