// Surfaces as triangles.
#ifndef STRATA_CORE_MESH_TRIANGLE_MESH_H_
#define STRATA_CORE_MESH_TRIANGLE_MESH_H_

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Geometry>

#include "core/cloud/point_cloud.h"

namespace strata {

using Triangle = std::array<std::uint32_t, 3>;

// Indices of vertices, counter-clockwise seen from outside: from where the sensor stood. Metres, in
// the frame of what it was made of.
struct TriangleMesh {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<Colour> colour;  // empty or as long as the vertices
  std::vector<Triangle> triangles;
};

// Twice the triangle's area long, outwards.
inline Eigen::Vector3d AreaNormal(const TriangleMesh& mesh, const Triangle& t) {
  const Eigen::Vector3d& a = mesh.vertices[t[0]];
  return (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a);
}

double AreaOf(const TriangleMesh& mesh);  // [m²]
// What a closed mesh holds [m³]; negative where its triangles face inwards.
double VolumeOf(const TriangleMesh& mesh);
// Unit normals of the vertices: the mean of their triangles' by area; zero where there are none.
std::vector<Eigen::Vector3f> VertexNormals(const TriangleMesh& mesh);

// Takes out vertices that no triangle has; the others keep their order.
void DropUnusedVertices(TriangleMesh& mesh);
// Takes out connected parts of fewer triangles than `least`, and their vertices.
void DropSmallParts(std::size_t least, TriangleMesh& mesh);

}  // namespace strata

#endif  // STRATA_CORE_MESH_TRIANGLE_MESH_H_
