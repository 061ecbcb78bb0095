#include "core/mesh/mesh_check.h"

#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/mesh/triangle_mesh.h"
#include "tests/core/mesh/shapes.h"

namespace strata {
namespace {

using testing::TetrahedronMesh;

TEST(MeshCheckTest, TetrahedronIsClosedAndRoundItself) {
  const TriangleMesh mesh = TetrahedronMesh();
  const MeshCheck check = CheckMesh(mesh);
  EXPECT_EQ(check.edges, 6);
  EXPECT_TRUE(check.closed());
  EXPECT_TRUE(check.manifold());
  EXPECT_EQ(check.euler_characteristic, 2);
  EXPECT_NEAR(VolumeOf(mesh), 1.0 / 6.0, 1e-12);
  EXPECT_NEAR(AreaOf(mesh), 1.5 + std::sqrt(3.0) / 2.0, 1e-12);
}

TEST(MeshCheckTest, MissingTriangleIsABorderOfThree) {
  TriangleMesh mesh = TetrahedronMesh();
  mesh.triangles.pop_back();
  const MeshCheck check = CheckMesh(mesh);
  EXPECT_EQ(check.boundary_edges, 3);
  EXPECT_FALSE(check.closed());
  EXPECT_TRUE(check.manifold());
  EXPECT_EQ(check.euler_characteristic, 1);
}

TEST(MeshCheckTest, TurnedTriangleIsTwisted) {
  TriangleMesh mesh = TetrahedronMesh();
  std::swap(mesh.triangles[0][0], mesh.triangles[0][1]);
  const MeshCheck check = CheckMesh(mesh);
  EXPECT_EQ(check.twisted_edges, 3);
  EXPECT_TRUE(check.closed());
  EXPECT_FALSE(check.manifold());
}

TEST(MeshCheckTest, FinOnAnEdgeIsNotManifold) {
  TriangleMesh mesh = TetrahedronMesh();
  mesh.vertices.emplace_back(1, 1, 1);
  mesh.triangles.push_back({0, 1, 4});
  const MeshCheck check = CheckMesh(mesh);
  EXPECT_EQ(check.nonmanifold_edges, 1);
  EXPECT_EQ(check.boundary_edges, 2);
}

TEST(MeshCheckTest, NothingIsNotClosed) {
  EXPECT_FALSE(CheckMesh({}).closed());
  EXPECT_EQ(CheckMesh({}).euler_characteristic, 0);
}

TEST(TriangleMeshTest, DropsUnusedVerticesAndKeepsColours) {
  TriangleMesh mesh = TetrahedronMesh();
  mesh.vertices.insert(mesh.vertices.begin(), Eigen::Vector3d(9, 9, 9));
  mesh.colour = {{9, 9, 9}, {0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {3, 3, 3}};
  for (Triangle& t : mesh.triangles) {
    for (std::uint32_t& v : t) ++v;
  }
  DropUnusedVertices(mesh);
  EXPECT_EQ(mesh.vertices, TetrahedronMesh().vertices);
  EXPECT_EQ(mesh.triangles, TetrahedronMesh().triangles);
  EXPECT_EQ(mesh.colour.front(), (Colour{0, 0, 0}));
}

TEST(TriangleMeshTest, DropsSmallPartsOnly) {
  TriangleMesh mesh = TetrahedronMesh();
  mesh.vertices.insert(mesh.vertices.end(), {{5, 5, 5}, {6, 5, 5}, {5, 6, 5}});
  mesh.triangles.push_back({4, 5, 6});
  DropSmallParts(4, mesh);
  EXPECT_EQ(mesh.triangles, TetrahedronMesh().triangles);
  EXPECT_EQ(mesh.vertices.size(), 4);
  DropSmallParts(5, mesh);
  EXPECT_TRUE(mesh.triangles.empty());
}

TEST(TriangleMeshTest, NormalsOfVerticesPointOutwards) {
  const TriangleMesh mesh = TetrahedronMesh();
  const auto normals = VertexNormals(mesh);
  for (std::size_t v = 0; v < normals.size(); ++v) {
    EXPECT_NEAR(normals[v].norm(), 1.0, 1e-6);
    EXPECT_GT(normals[v].cast<double>().dot(mesh.vertices[v] - Eigen::Vector3d(0.2, 0.2, 0.2)),
              0.0);
  }
}

}  // namespace
}  // namespace strata
