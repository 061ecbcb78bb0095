#include "core/mesh/mesh_parts.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/str_format.h"
#include <Eigen/Core>

#include "core/common/status.h"

namespace strata {
namespace {

using Eigen::Vector3d;

// So many blocks around points that have some: a point reaches six voxels far (distance_field.cc).
constexpr std::int32_t kAround = 2;
constexpr double kAroundNodes = 10.0;

std::int32_t Along(const BlockKey& key, int axis) {
  return axis == 0 ? key.x : axis == 1 ? key.y : key.z;
}
std::int32_t& Along(BlockKey& key, int axis) {
  return axis == 0 ? key.x : axis == 1 ? key.y : key.z;
}

int LongestAxis(const BlockBox& box) {
  int longest = 0;
  for (int k = 1; k < 3; ++k) {
    const auto length = [&](int axis) {
      return std::int64_t{Along(box.high, axis)} - Along(box.low, axis);
    };
    if (length(k) > length(longest)) longest = k;
  }
  return longest;
}

std::array<BlockBox, 2> CutAt(const BlockBox& box, int axis, std::int32_t at) {
  std::array<BlockBox, 2> halves = {box, box};
  Along(halves[0].high, axis) = at;
  Along(halves[1].low, axis) = at;
  return halves;
}

BlockBox AroundAll(const std::vector<BlockKey>& keys) {
  BlockBox box{keys.front(), keys.front()};
  for (const BlockKey& key : keys) {
    for (int k = 0; k < 3; ++k) {
      Along(box.low, k) = std::min(Along(box.low, k), Along(key, k));
      Along(box.high, k) = std::max(Along(box.high, k), Along(key, k));
    }
  }
  for (int k = 0; k < 3; ++k) {
    Along(box.low, k) -= kAround;
    Along(box.high, k) += kAround + 1;
  }
  return box;
}

// Cuts the box through the middle of its keys, again and again.
class KeyCutter {
 public:
  KeyCutter(const Vector3d& origin, std::size_t most, std::vector<FieldPart>& parts)
      : origin_(origin), most_(most), parts_(parts) {}

  // NOLINTNEXTLINE(misc-no-recursion): as deep as the logarithm of the keys.
  void Cut(const BlockBox& box, std::vector<BlockKey> keys) {
    if (keys.empty()) return;
    const int axis = LongestAxis(box);
    const auto middle = keys.begin() + static_cast<std::ptrdiff_t>(keys.size() / 2);
    std::nth_element(keys.begin(), middle, keys.end(), [&](const BlockKey& a, const BlockKey& b) {
      return Along(a, axis) < Along(b, axis);
    });
    const std::int32_t at = std::max(Along(*middle, axis), Along(box.low, axis) + 1);
    if (keys.size() <= most_ || at >= Along(box.high, axis)) {
      parts_.push_back({origin_, box});
      return;
    }
    const auto second = std::partition(
        keys.begin(), keys.end(), [&](const BlockKey& key) { return Along(key, axis) < at; });
    std::vector<BlockKey> rest(second, keys.end());
    keys.erase(second, keys.end());
    const std::array<BlockBox, 2> halves = CutAt(box, axis, at);
    Cut(halves[0], std::move(keys));
    Cut(halves[1], std::move(rest));
  }

 private:
  const Vector3d origin_;
  const std::size_t most_;
  std::vector<FieldPart>& parts_;
};

}  // namespace

bool IsOneBlock(const FieldPart& part) {
  const int axis = LongestAxis(part.blocks);
  return Along(part.blocks.high, axis) - Along(part.blocks.low, axis) <= 1;
}

std::array<FieldPart, 2> Halves(const FieldPart& part) {
  const int axis = LongestAxis(part.blocks);
  const std::int32_t low = Along(part.blocks.low, axis), high = Along(part.blocks.high, axis);
  const std::array<BlockBox, 2> halves = CutAt(part.blocks, axis, low + (high - low) / 2);
  return {FieldPart{part.origin, halves[0]}, FieldPart{part.origin, halves[1]}};
}

MeshCutter::MeshCutter(const Vector3d& origin, double voxel_m, const Eigen::AlignedBox3d& region)
    : grid_{origin, voxel_m}, region_(region) {}

absl::Status MeshCutter::Add(const PointCloud& cloud, const Pose& T_map_scan, const Stop& stop) {
  Eigen::AlignedBox3d box(
      grid_.InNodes(T_map_scan * (cloud.sensor_origin.cast<double>() + cloud.origin)));
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (i % 1024 == 0) STRATA_RETURN_IF_ERROR(stop.status());
    if (!cloud.points[i].allFinite()) continue;
    const Vector3d point = T_map_scan * (cloud.points[i].cast<double>() + cloud.origin);
    const Vector3d at = grid_.InNodes(point);
    box.extend(at);
    if (!region_.contains(point) || !(at.cwiseAbs().maxCoeff() < kMostNodes)) continue;
    ++points_;
    blocks_.insert(BlockOf(at.array().round().cast<int>()));
  }
  scans_.push_back(box);
  return absl::OkStatus();
}

std::vector<FieldPart> MeshCutter::Parts(std::size_t most) const {
  std::vector<FieldPart> parts;
  if (blocks_.empty()) return parts;
  std::vector<BlockKey> keys(blocks_.begin(), blocks_.end());
  std::sort(keys.begin(), keys.end());
  const BlockBox box = AroundAll(keys);
  KeyCutter(grid_.origin, most, parts).Cut(box, std::move(keys));
  return parts;
}

bool MeshCutter::Reaches(std::size_t scan, const FieldPart& part) const {
  const auto corner = [](const BlockKey& key, double beyond) {
    return Vector3d(Vector3d(key.x, key.y, key.z) * kBlockEdge + Vector3d::Constant(beyond));
  };
  return scans_[scan].intersects(
      {corner(part.blocks.low, -kAroundNodes), corner(part.blocks.high, kAroundNodes)});
}

absl::Status MeshJoiner::Append(const TriangleMesh& mesh,
                                const FieldPart& part,
                                std::size_t most_triangles) {
  if (mesh_.triangles.size() + mesh.triangles.size() > most_triangles) {
    return absl::ResourceExhaustedError(
        absl::StrFormat("the mesh would have more than %d triangles", most_triangles));
  }
  const auto is_at_border = [&](const Vector3d& v) {
    for (int k = 0; k < 3; ++k) {
      const double at = (v[k] - part.origin[k]) / (voxel_m_ * kBlockEdge);
      if (at < Along(part.blocks.low, k) + 0.1 || at > Along(part.blocks.high, k) - 0.1)
        return true;
    }
    return false;
  };
  std::vector<std::uint32_t> places;
  places.reserve(mesh.vertices.size());
  for (const Vector3d& v : mesh.vertices) {
    auto place = static_cast<std::uint32_t>(mesh_.vertices.size());
    // The same numbers in both parts, since their nodes have the same.
    if (is_at_border(v))
      place = at_borders_.try_emplace({v.x(), v.y(), v.z()}, place).first->second;
    if (place == mesh_.vertices.size()) mesh_.vertices.push_back(v);
    places.push_back(place);
  }
  for (const Triangle& t : mesh.triangles) {
    mesh_.triangles.push_back({places[t[0]], places[t[1]], places[t[2]]});
  }
  return absl::OkStatus();
}

TriangleMesh MeshJoiner::Finish() {
  at_borders_.clear();
  DropSmallParts(kLeastMeshPart, mesh_);
  return std::exchange(mesh_, {});
}

}  // namespace strata
