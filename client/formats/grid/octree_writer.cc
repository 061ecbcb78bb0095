#include "client/formats/grid/octree_writer.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include <octomap/octomap.h>

#include "core/common/status.h"

namespace strata {
namespace {

octomap::point3d PointOf(const Eigen::Vector3d& p) {
  const Eigen::Vector3f f = p.cast<float>();
  return {f.x(), f.y(), f.z()};
}

// The voxels whose middles lie in a region.
struct KeyBox {
  Eigen::Array3i low = Eigen::Array3i::Zero();
  Eigen::Array3i high = Eigen::Array3i::Constant(65'536);  // not in it

  KeyBox() = default;
  KeyBox(const Eigen::AlignedBox3d& region, double voxel_m)
      : low(KeyAbove(region.min(), voxel_m)), high(KeyAbove(region.max(), voxel_m)) {}

  bool Has(const octomap::OcTreeKey& key) const {
    const Eigen::Array3i k(key[0], key[1], key[2]);
    return (k >= low).all() && (k < high).all();
  }

 private:
  // That of the lowest voxel whose middle is not below p.
  static Eigen::Array3i KeyAbove(const Eigen::Vector3d& p, double voxel_m) {
    const Eigen::Array3d key = (p.array() / voxel_m - 0.5).ceil() + 32'768.0;
    return key.max(0.0).min(65'536.0).cast<int>();
  }
};

struct Ray {
  Eigen::Vector3d from;
  Eigen::Vector3d to;
};

// The part of the ray that lies in the box; false if none does.
bool Clip(const Eigen::AlignedBox3d& box, Ray& ray) {
  const Eigen::Vector3d along = ray.to - ray.from;
  double begin = 0.0;
  double end = 1.0;
  for (int i = 0; i < 3; ++i) {
    if (along[i] == 0.0) {
      if (ray.from[i] < box.min()[i] || ray.from[i] > box.max()[i]) return false;
      continue;
    }
    const double a = (box.min()[i] - ray.from[i]) / along[i];
    const double b = (box.max()[i] - ray.from[i]) / along[i];
    begin = std::max(begin, std::min(a, b));
    end = std::min(end, std::max(a, b));
  }
  if (begin >= end) return false;
  ray = {ray.from + begin * along, ray.from + end * along};
  return true;
}

}  // namespace

struct OctreeWriter::Tree {
  Tree(double voxel_m, const std::optional<Eigen::AlignedBox3d>& box)
      : octree(voxel_m), region(box) {
    if (region.has_value()) inside = KeyBox(*region, voxel_m);
  }

  void Cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& p);
  void Apply();
  absl::Status Shrink();

  octomap::OcTree octree;
  std::optional<Eigen::AlignedBox3d> region;
  KeyBox inside;
  octomap::KeySet hit;  // of the scan at hand
  octomap::KeySet missed;
  octomap::KeySet beyond;  // where rays end outside the region
  octomap::KeyRay ray;
  std::size_t nodes_when_pruned = 0;
};

void OctreeWriter::Tree::Cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& p) {
  const octomap::OcTreeKey end = octree.coordToKey(PointOf(p));
  if (!(inside.Has(end) ? hit : beyond).insert(end).second) return;
  Ray part = {origin, p};
  if (region.has_value() && !Clip(*region, part)) return;
  if (!octree.computeRayKeys(PointOf(part.from), PointOf(part.to), ray)) return;
  for (const octomap::OcTreeKey& key : ray) {
    if (inside.Has(key)) missed.insert(key);
  }
}

void OctreeWriter::Tree::Apply() {
  constexpr bool kLazy = true;  // inner nodes follow at the end
  for (const octomap::OcTreeKey& key : missed) {
    if (hit.count(key) == 0) octree.updateNode(key, false, kLazy);
  }
  for (const octomap::OcTreeKey& key : hit) octree.updateNode(key, true, kLazy);
  for (octomap::KeySet* keys : {&hit, &missed, &beyond}) keys->clear();
}

// Puts equal voxels together once there are twice as many.
absl::Status OctreeWriter::Tree::Shrink() {
  if (octree.size() < std::max<std::size_t>(2 * nodes_when_pruned, kMaxOctreeNodes / 10)) {
    return absl::OkStatus();
  }
  octree.updateInnerOccupancy();
  octree.prune();
  nodes_when_pruned = octree.size();
  if (nodes_when_pruned <= kMaxOctreeNodes) return absl::OkStatus();
  return absl::ResourceExhaustedError(
      absl::StrCat("octree: ",
                   nodes_when_pruned,
                   " nodes; at most ",
                   kMaxOctreeNodes,
                   " are made: take a smaller region or larger voxels"));
}

OctreeWriter::OctreeWriter(double voxel_m, const std::optional<Eigen::AlignedBox3d>& region)
    : tree_(std::make_unique<Tree>(voxel_m, region)) {}
OctreeWriter::~OctreeWriter() = default;

absl::Status OctreeWriter::Add(const PointCloud& cloud,
                               const Pose& T_map_scan,
                               const SensorModel& sensor,
                               const Stop& stop) {
  constexpr std::size_t kRaysBetweenStops = 4096;
  Tree& tree = *tree_;
  const double voxel_m = tree.octree.getResolution();
  const double farthest_m = 32'767.0 * voxel_m;
  const Eigen::Vector3d origin = T_map_scan * (cloud.origin + cloud.sensor_origin.cast<double>());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (i % kRaysBetweenStops == 0) STRATA_RETURN_IF_ERROR(stop.status());
    if (!cloud.points[i].allFinite()) continue;
    if (!sensor.Takes((cloud.points[i] - cloud.sensor_origin).cast<double>().norm())) continue;
    const Eigen::Vector3d p = T_map_scan * (cloud.origin + cloud.points[i].cast<double>());
    if (p.cwiseAbs().maxCoeff() > farthest_m || origin.cwiseAbs().maxCoeff() > farthest_m) {
      return absl::OutOfRangeError(absl::StrCat("octree: a point at (",
                                                p.x(),
                                                ", ",
                                                p.y(),
                                                ", ",
                                                p.z(),
                                                ") is beyond ",
                                                farthest_m,
                                                " m, which voxels of ",
                                                voxel_m,
                                                " m reach; take larger ones"));
    }
    tree.Cast(origin, p);
  }
  tree.Apply();
  return tree.Shrink();
}

OctreeWriter::Extent OctreeWriter::Finish() {
  octomap::OcTree& octree = tree_->octree;
  octree.updateInnerOccupancy();
  octree.toMaxLikelihood();
  octree.prune();
  Extent extent;
  extent.nodes = octree.size();
  for (auto leaf = octree.begin_leafs(); leaf != octree.end_leafs(); ++leaf) {
    (octree.isNodeOccupied(*leaf) ? extent.occupied_m3 : extent.free_m3) +=
        std::pow(leaf.getSize(), 3);
  }
  return extent;
}

// The head is written here: OctoMap's function for whole files talks on stderr.
absl::StatusOr<std::string> OctreeWriter::BtBytes() const {
  const octomap::OcTree& octree = tree_->octree;
  std::ostringstream bytes;
  bytes << absl::StrFormat("# Octomap OcTree binary file\nid OcTree\nsize %d\nres %.15g\ndata\n",
                           octree.size(),
                           octree.getResolution());
  octree.writeBinaryData(bytes);
  if (!bytes.good()) return absl::InternalError("octree: OctoMap does not write it");
  return std::move(bytes).str();
}

}  // namespace strata
