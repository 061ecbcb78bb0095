#include "core/mesh/mesh_check.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace strata {
namespace {

// Its two vertices, the smaller one first, and whether the triangle goes from that to the other.
std::uint64_t HalfEdge(std::uint32_t from, std::uint32_t to) {
  const bool forward = from < to;
  if (!forward) std::swap(from, to);
  return std::uint64_t{from} << 33 | std::uint64_t{to} << 1 | (forward ? 1U : 0U);
}

}  // namespace

MeshCheck CheckMesh(const TriangleMesh& mesh) {
  std::vector<std::uint64_t> halves;
  halves.reserve(3 * mesh.triangles.size());
  std::vector<bool> used(mesh.vertices.size(), false);
  for (const Triangle& t : mesh.triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      halves.push_back(HalfEdge(t[i], t[(i + 1) % 3]));
      used[t[i]] = true;
    }
  }
  std::sort(halves.begin(), halves.end());
  MeshCheck check;
  for (std::size_t i = 0; i < halves.size();) {
    std::size_t end = i + 1;
    while (end < halves.size() && halves[end] >> 1 == halves[i] >> 1) ++end;
    const std::size_t triangles = end - i;
    ++check.edges;
    check.boundary_edges += triangles == 1 ? 1 : 0;
    check.nonmanifold_edges += triangles > 2 ? 1 : 0;
    check.twisted_edges += triangles == 2 && halves[i] == halves[i + 1] ? 1 : 0;
    i = end;
  }
  check.euler_characteristic = std::count(used.begin(), used.end(), true) -
                               static_cast<std::int64_t>(check.edges) +
                               static_cast<std::int64_t>(mesh.triangles.size());
  return check;
}

}  // namespace strata
