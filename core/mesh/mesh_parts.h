// A surface that is too large for one distance field: where to cut it, and the parts joined again.
#ifndef STRATA_CORE_MESH_MESH_PARTS_H_
#define STRATA_CORE_MESH_MESH_PARTS_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include <Eigen/Geometry>

#include "core/cloud/point_cloud.h"
#include "core/common/hash_map.h"
#include "core/common/stop.h"
#include "core/geometry/pose.h"
#include "core/mesh/distance_field.h"
#include "core/mesh/triangle_mesh.h"
#include "core/mesh/voxel_blocks.h"

namespace strata {

// In two, across its longest side. REQUIRES: two blocks and more.
std::array<FieldPart, 2> Halves(const FieldPart& part);
// Whether a field has to be cut no further: one block can not be.
bool IsOneBlock(const FieldPart& part);

// Give it every scan, then take the parts. Takes some 30 bytes a block with points, and one box a
// scan. One thread at a time.
class MeshCutter {
 public:
  // `origin`: DistanceField::OriginFor() the first scan; `region`: points beyond do not count.
  MeshCutter(const Eigen::Vector3d& origin, double voxel_m, const Eigen::AlignedBox3d& region);

  // The stop's status. `cloud`: as ValidateCloud() takes it.
  absl::Status Add(const PointCloud& cloud, const Pose& T_map_scan, const Stop& stop);
  // Of the region, by scan.
  std::uint64_t points() const { return points_; }
  std::size_t blocks() const { return blocks_.size(); }
  // Boxes side by side around all there is, each with `most` blocks with points at most.
  std::vector<FieldPart> Parts(std::size_t most) const;
  // Whether points of the scan added as `scan`th, or rays to them, may matter in `part`.
  bool Reaches(std::size_t scan, const FieldPart& part) const;

 private:
  NodeGrid grid_;
  Eigen::AlignedBox3d region_;
  HashSet<BlockKey> blocks_;
  std::vector<Eigen::AlignedBox3d> scans_;  // of points and sensor [nodes]
  std::uint64_t points_ = 0;
};

// Joins the meshes of parts that lie side by side: what they share stands once. One thread at a
// time.
class MeshJoiner {
 public:
  explicit MeshJoiner(double voxel_m) : voxel_m_(voxel_m) {}

  // RESOURCE_EXHAUSTED beyond `most_triangles` in all.
  absl::Status Append(const TriangleMesh& mesh, const FieldPart& part, std::size_t most_triangles);
  // Without what is small.
  TriangleMesh Finish();

 private:
  using Place = std::array<double, 3>;

  double voxel_m_;
  TriangleMesh mesh_;
  HashMap<Place, std::uint32_t> at_borders_;
};

}  // namespace strata

#endif  // STRATA_CORE_MESH_MESH_PARTS_H_
