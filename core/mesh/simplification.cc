#include "core/mesh/simplification.h"

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>
#include <meshoptimizer.h>

namespace strata {
namespace {

constexpr float kAnyError = 1.0F;  // of the mesh's size

}  // namespace

TriangleMesh Simplify(TriangleMesh mesh, std::size_t target) {
  if (mesh.triangles.size() <= target) return mesh;
  std::vector<Eigen::Vector3f> positions;
  positions.reserve(mesh.vertices.size());
  for (const Eigen::Vector3d& v : mesh.vertices) {
    positions.emplace_back((v - mesh.vertices.front()).cast<float>());
  }
  std::vector<unsigned int> indices;
  indices.reserve(3 * mesh.triangles.size());
  for (const Triangle& t : mesh.triangles) indices.insert(indices.end(), t.begin(), t.end());
  indices.resize(meshopt_simplify(indices.data(),
                                  indices.data(),
                                  indices.size(),
                                  positions.front().data(),
                                  positions.size(),
                                  sizeof(Eigen::Vector3f),
                                  3 * target,
                                  kAnyError,
                                  0,
                                  nullptr));
  mesh.triangles.resize(indices.size() / 3);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    mesh.triangles[i] = {indices[3 * i], indices[3 * i + 1], indices[3 * i + 2]};
  }
  DropUnusedVertices(mesh);
  return mesh;
}

}  // namespace strata
