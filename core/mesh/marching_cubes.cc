#include "core/mesh/marching_cubes.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include <Eigen/Core>
#include <pcl/surface/marching_cubes.h>

#include "core/common/hash_map.h"
#include "core/common/status.h"

namespace strata {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;

constexpr std::size_t kSide = kBlockEdge + 1;  // a block with the first nodes of the next ones
using Values = std::array<float, kSide * kSide * kSide>;
constexpr std::size_t kMostVertices = std::size_t{1} << 31;
// Vertices stay off the nodes, or triangles would have no area.
constexpr double kOffNode = 1e-3;

// As PCL's tables (Bourke's) number them.
constexpr std::array<std::array<int, 3>, 8> kCorners = {
    {{0, 0, 0}, {1, 0, 0}, {1, 0, 1}, {0, 0, 1}, {0, 1, 0}, {1, 1, 0}, {1, 1, 1}, {0, 1, 1}}};
// The node from which an edge of the cube goes, and the axis along which.
struct CubeEdge {
  std::array<int, 3> from;
  int axis;
};
constexpr std::array<CubeEdge, 12> kEdges = {{{{0, 0, 0}, 0},
                                              {{1, 0, 0}, 2},
                                              {{0, 0, 1}, 0},
                                              {{0, 0, 0}, 2},
                                              {{0, 1, 0}, 0},
                                              {{1, 1, 0}, 2},
                                              {{0, 1, 1}, 0},
                                              {{0, 1, 0}, 2},
                                              {{0, 0, 0}, 1},
                                              {{1, 0, 0}, 1},
                                              {{1, 0, 1}, 1},
                                              {{0, 0, 1}, 1}}};

std::size_t ValueIndex(int x, int y, int z) {
  return (static_cast<std::size_t>(z) * kSide + static_cast<std::size_t>(y)) * kSide +
         static_cast<std::size_t>(x);
}

bool Crosses(float a, float b) {
  return !std::isnan(a) && !std::isnan(b) && (a < 0.0F) != (b < 0.0F);
}

// Which edges from a block's nodes have a vertex, and the number of the first.
struct BlockVertices {
  std::array<std::uint64_t, 3 * kBlockNodes / 64> has{};
  std::uint32_t first = 0;

  void Set(std::size_t edge) { has[edge / 64] |= std::uint64_t{1} << edge % 64; }
  std::uint32_t IndexOf(std::size_t edge) const {
    std::uint32_t index = first;
    for (std::size_t word = 0; word < edge / 64; ++word) {
      index += static_cast<std::uint32_t>(std::popcount(has[word]));
    }
    const std::uint64_t below = (std::uint64_t{1} << edge % 64) - 1;
    return index + static_cast<std::uint32_t>(std::popcount(has[edge / 64] & below));
  }
};

class CubeMarcher {
 public:
  CubeMarcher(const std::vector<BlockKey>& keys,
              NodeReader read,
              float outside,
              float steepest,
              const NodeGrid& grid,
              const BlockBox* only)
      : read_(read), outside_(outside), steepest_(steepest), grid_(grid), only_(only) {
    for (std::size_t i = 0; i < keys.size(); ++i) source_.emplace(keys[i], i);
    bases_ = keys;
    if (!std::isnan(outside)) AddBlocksBefore();
    std::sort(bases_.begin(), bases_.end());
    bases_.erase(std::unique(bases_.begin(), bases_.end()), bases_.end());
    for (std::size_t i = 0; i < bases_.size(); ++i) base_.emplace(bases_[i], i);
    vertices_.resize(bases_.size());
  }

  absl::StatusOr<TriangleMesh> March(const Stop& stop) {
    for (std::size_t i = 0; i < bases_.size(); ++i) {
      if (i % 256 == 0) STRATA_RETURN_IF_ERROR(stop.status());
      if (mesh_.vertices.size() >= kMostVertices - 3 * kBlockNodes) {
        return absl::ResourceExhaustedError(
            "the mesh would have more than 2147483648 vertices: mesh a smaller part, or with "
            "larger "
            "voxels");
      }
      AddVertices(i);
    }
    for (std::size_t i = 0; i < bases_.size(); ++i) {
      if (i % 256 == 0) STRATA_RETURN_IF_ERROR(stop.status());
      if (only_ == nullptr || only_->Contains(bases_[i])) AddTriangles(i);
    }
    DropUnusedVertices(mesh_);
    return std::move(mesh_);
  }

 private:
  // Cubes reach from outside into the first nodes of a block.
  void AddBlocksBefore() {
    const std::size_t count = bases_.size();
    for (std::size_t i = 0; i < count; ++i) {
      const BlockKey key = bases_[i];
      for (int n = 1; n < 8; ++n) {
        bases_.push_back({key.x - (n & 1), key.y - (n >> 1 & 1), key.z - (n >> 2)});
      }
    }
  }

  // The values of a block and of the first nodes of those that follow it.
  const Values& Gather(const BlockKey& key) {
    for (int n = 0; n < 8; ++n) {
      const int dx = n & 1, dy = n >> 1 & 1, dz = n >> 2;
      const auto it = source_.find({key.x + dx, key.y + dy, key.z + dz});
      const int to_x = dx == 0 ? kBlockEdge : 1;
      const int to_y = dy == 0 ? kBlockEdge : 1;
      const int to_z = dz == 0 ? kBlockEdge : 1;
      for (int z = 0; z < to_z; ++z) {
        for (int y = 0; y < to_y; ++y) {
          for (int x = 0; x < to_x; ++x) {
            values_[ValueIndex(x + dx * kBlockEdge, y + dy * kBlockEdge, z + dz * kBlockEdge)] =
                it == source_.end() ? outside_ : read_(it->second, NodeInBlock({x, y, z}));
          }
        }
      }
    }
    return values_;
  }

  void AddVertices(std::size_t base) {
    const BlockKey& key = bases_[base];
    const Values& values = Gather(key);
    BlockVertices& own = vertices_[base];
    own.first = static_cast<std::uint32_t>(mesh_.vertices.size());
    const Vector3i first(key.x * kBlockEdge, key.y * kBlockEdge, key.z * kBlockEdge);
    for (std::size_t node = 0; node < kBlockNodes; ++node) {
      const Vector3i local(node & 7, node >> 3 & 7, node >> 6);
      const float here = values[ValueIndex(local.x(), local.y(), local.z())];
      for (int axis = 0; axis < 3; ++axis) {
        const Vector3i next = local + Vector3i::Unit(axis);
        const float there = values[ValueIndex(next.x(), next.y(), next.z())];
        if (!Crosses(here, there)) continue;
        own.Set(3 * node + static_cast<std::size_t>(axis));
        const double share =
            std::clamp(double{here} / (double{here} - double{there}), kOffNode, 1.0 - kOffNode);
        const Vector3d at = (first + local).cast<double>() + share * Vector3d::Unit(axis);
        mesh_.vertices.emplace_back(grid_.origin + grid_.spacing_m * at);
      }
    }
  }

  // The case of the cube from a node of the block gathered last; nullopt where a corner is unknown
  // or a jump too steep.
  std::optional<unsigned> CaseOf(int x, int y, int z) const {
    unsigned cube = 0;
    for (std::size_t corner = 0; corner < 8; ++corner) {
      const auto& [dx, dy, dz] = kCorners[corner];
      const float value = values_[ValueIndex(x + dx, y + dy, z + dz)];
      if (std::isnan(value)) return std::nullopt;
      if (value < 0.0F) cube |= 1U << corner;
    }
    if (cube == 0 || cube == 0xFF) return cube;
    for (const CubeEdge& e : kEdges) {
      const Vector3i from(x + e.from[0], y + e.from[1], z + e.from[2]);
      const Vector3i to = from + Vector3i::Unit(e.axis);
      const float a = values_[ValueIndex(from.x(), from.y(), from.z())];
      const float b = values_[ValueIndex(to.x(), to.y(), to.z())];
      if (Crosses(a, b) && std::abs(a - b) > steepest_) return std::nullopt;
    }
    return cube;
  }

  std::uint32_t VertexOn(const Vector3i& cube, int edge) const {
    const CubeEdge& e = kEdges[static_cast<std::size_t>(edge)];
    const Vector3i node = cube + Vector3i(e.from[0], e.from[1], e.from[2]);
    const BlockVertices& owner = vertices_[base_.find(BlockOf(node))->second];
    return owner.IndexOf(3 * NodeInBlock(node) + static_cast<std::size_t>(e.axis));
  }

  void AddTriangles(std::size_t base) {
    const BlockKey& key = bases_[base];
    Gather(key);
    const Vector3i first(key.x * kBlockEdge, key.y * kBlockEdge, key.z * kBlockEdge);
    for (std::size_t node = 0; node < kBlockNodes; ++node) {
      const Vector3i local(node & 7, node >> 3 & 7, node >> 6);
      const std::optional<unsigned> cube = CaseOf(local.x(), local.y(), local.z());
      if (!cube.has_value()) continue;
      const int* const edges = pcl::triTable[*cube];
      for (int i = 0; edges[i] != -1; i += 3) {
        const Vector3i at = first + local;
        mesh_.triangles.push_back(
            {VertexOn(at, edges[i]), VertexOn(at, edges[i + 1]), VertexOn(at, edges[i + 2])});
      }
    }
  }

  NodeReader read_;
  const float outside_;
  const float steepest_;
  const NodeGrid& grid_;
  const BlockBox* const only_;
  HashMap<BlockKey, std::size_t> source_;  // index of the keys given
  std::vector<BlockKey> bases_;            // blocks that own cubes and edges, in order
  HashMap<BlockKey, std::size_t> base_;
  std::vector<BlockVertices> vertices_;  // of each base
  Values values_;                        // of the block gathered last
  TriangleMesh mesh_;
};

}  // namespace

absl::StatusOr<TriangleMesh> MarchCubes(const std::vector<BlockKey>& keys,
                                        NodeReader read,
                                        float outside,
                                        float steepest,
                                        const NodeGrid& grid,
                                        const Stop& stop,
                                        const BlockBox* only) {
  return CubeMarcher(keys, read, outside, steepest, grid, only).March(stop);
}

}  // namespace strata
