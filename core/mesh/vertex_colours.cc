#include "core/mesh/vertex_colours.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include <Eigen/Core>

#include "core/common/status.h"

namespace strata {
namespace {

constexpr Colour kUnseen = {128, 128, 128};

BlockKey CubeOf(const Eigen::Vector3d& at) {
  const Eigen::Vector3i cube = at.array().floor().cast<int>();
  return {cube.x(), cube.y(), cube.z()};
}

}  // namespace

VertexColours::VertexColours(const TriangleMesh& mesh, double reach_m)
    : mesh_(mesh), sums_(mesh.vertices.size()) {
  grid_.spacing_m = reach_m;
  if (!mesh.vertices.empty()) grid_.origin = mesh.vertices.front();
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    vertices_[CubeOf(grid_.InNodes(mesh.vertices[v]))].push_back(static_cast<std::uint32_t>(v));
  }
}

absl::Status VertexColours::Add(const PointCloud& cloud,
                                const Pose& T_mesh_scan,
                                const Stop& stop) {
  if (cloud.colour.empty()) return absl::OkStatus();
  any_ = true;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (i % 1024 == 0) STRATA_RETURN_IF_ERROR(stop.status());
    if (!cloud.points[i].allFinite()) continue;
    const Eigen::Vector3d point = T_mesh_scan * (cloud.points[i].cast<double>() + cloud.origin);
    const Eigen::Vector3d at = grid_.InNodes(point);
    if (!(at.cwiseAbs().maxCoeff() < kMostNodes)) continue;
    const BlockKey cube = CubeOf(at);
    for (int n = 0; n < 27; ++n) {
      const auto found =
          vertices_.find({cube.x + n % 3 - 1, cube.y + n / 3 % 3 - 1, cube.z + n / 9 - 1});
      if (found == vertices_.end()) continue;
      for (const std::uint32_t v : found->second) {
        const double away = (mesh_.vertices[v] - point).norm() / grid_.spacing_m;
        if (away >= 1.0) continue;
        const auto weight = static_cast<float>((1.0 - away) * (1.0 - away));
        const Colour& c = cloud.colour[i];
        sums_[v].channels[0] += weight * static_cast<float>(c.r);
        sums_[v].channels[1] += weight * static_cast<float>(c.g);
        sums_[v].channels[2] += weight * static_cast<float>(c.b);
        sums_[v].weight += weight;
      }
    }
  }
  return absl::OkStatus();
}

std::vector<Colour> VertexColours::Colours() const {
  if (!any_) return {};
  std::vector<Sum> sums = sums_;
  for (const Triangle& t : mesh_.triangles) {
    for (const std::uint32_t v : t) {
      if (sums_[v].weight > 0.0F) continue;
      for (const std::uint32_t other : t) {
        for (std::size_t k = 0; k < 3; ++k) sums[v].channels[k] += sums_[other].channels[k];
        sums[v].weight += sums_[other].weight;
      }
    }
  }
  std::vector<Colour> colours;
  colours.reserve(sums.size());
  for (const Sum& sum : sums) {
    const auto channel = [&](std::size_t k) {
      return static_cast<std::uint8_t>(std::lround(sum.channels[k] / sum.weight));
    };
    colours.push_back(sum.weight > 0.0F ? Colour{channel(0), channel(1), channel(2)} : kUnseen);
  }
  return colours;
}

}  // namespace strata
