#include "core/mesh/triangle_mesh.h"

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "core/common/disjoint_sets.h"

namespace strata {
namespace {

constexpr std::uint32_t kUnused = 0xFFFFFFFF;

}  // namespace

double AreaOf(const TriangleMesh& mesh) {
  double twice = 0.0;
  for (const Triangle& t : mesh.triangles) twice += AreaNormal(mesh, t).norm();
  return 0.5 * twice;
}

double VolumeOf(const TriangleMesh& mesh) {
  if (mesh.vertices.empty()) return 0.0;
  // From a vertex, so that coordinates far from zero lose nothing.
  const Eigen::Vector3d& from = mesh.vertices.front();
  double six_times = 0.0;
  for (const Triangle& t : mesh.triangles) {
    six_times += AreaNormal(mesh, t).dot(mesh.vertices[t[0]] - from);
  }
  return six_times / 6.0;
}

std::vector<Eigen::Vector3f> VertexNormals(const TriangleMesh& mesh) {
  std::vector<Eigen::Vector3f> normals(mesh.vertices.size(), Eigen::Vector3f::Zero());
  for (const Triangle& t : mesh.triangles) {
    const Eigen::Vector3f normal = AreaNormal(mesh, t).cast<float>();
    for (const std::uint32_t v : t) normals[v] += normal;
  }
  for (Eigen::Vector3f& normal : normals) normal.stableNormalize();
  return normals;
}

void DropUnusedVertices(TriangleMesh& mesh) {
  std::vector<std::uint32_t> index(mesh.vertices.size(), kUnused);
  for (const Triangle& t : mesh.triangles) {
    for (const std::uint32_t v : t) index[v] = 0;
  }
  std::uint32_t kept = 0;
  for (std::size_t v = 0; v < index.size(); ++v) {
    if (index[v] == kUnused) continue;
    mesh.vertices[kept] = mesh.vertices[v];
    if (!mesh.colour.empty()) mesh.colour[kept] = mesh.colour[v];
    index[v] = kept++;
  }
  mesh.vertices.resize(kept);
  if (!mesh.colour.empty()) mesh.colour.resize(kept);
  for (Triangle& t : mesh.triangles) {
    for (std::uint32_t& v : t) v = index[v];
  }
}

void DropSmallParts(std::size_t least, TriangleMesh& mesh) {
  DisjointSets parts;
  for (const Triangle& t : mesh.triangles) {
    parts.Join(t[0], t[1]);
    parts.Join(t[0], t[2]);
  }
  std::vector<std::uint32_t> triangles(mesh.vertices.size(), 0);
  for (const Triangle& t : mesh.triangles) ++triangles[parts.Root(t[0])];
  std::erase_if(mesh.triangles,
                [&](const Triangle& t) { return triangles[parts.Root(t[0])] < least; });
  DropUnusedVertices(mesh);
}

}  // namespace strata
