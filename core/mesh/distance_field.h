// One surface from many scans, each of which knows from where it was seen: a sparse signed distance
// (Curless and Levoy 1996).
#ifndef STRATA_CORE_MESH_DISTANCE_FIELD_H_
#define STRATA_CORE_MESH_DISTANCE_FIELD_H_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include <Eigen/Geometry>

#include "core/cloud/point_cloud.h"
#include "core/cloud/sensor_model.h"
#include "core/common/stop.h"
#include "core/geometry/pose.h"
#include "core/mesh/triangle_mesh.h"
#include "core/mesh/voxel_blocks.h"

namespace strata {

// Parts of the surface that have fewer triangles are noise.
inline constexpr std::size_t kLeastMeshPart = 100;

// Of a field that would be too large, the blocks that one takes.
struct FieldPart {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  // of the whole field's nodes
  BlockBox blocks;
};

struct DistanceFieldOptions {
  // Edge of a voxel [m]; in [0.001, 10]. Things thinner than two voxels are lost.
  double voxel_m = 0.05;
  // Only what is in here is meshed; in the map [m].
  Eigen::AlignedBox3d region{Eigen::Vector3d::Constant(-1e7), Eigen::Vector3d::Constant(1e7)};
  // Of the voxels, 8 bytes each where a surface is near; the mesh takes half as much beside them.
  std::size_t max_bytes = std::size_t{640} << 20;
  // Only the surface in there: with the same scans, that of the whole field bit for bit, but for
  // small parts, which only who joins it knows (mesh_parts.h).
  std::optional<FieldPart> part = std::nullopt;

  absl::Status Validate() const;
};

// Give every scan to Add(), then every one to Carve(), then take the mesh. What was near a point
// gets the distance to its plane, positive towards the sensor, where thesis 4.5.2 has none: "the
// inside and the outside of the object can not be distinguished". What later scans look through is
// taken out again: people, and the streaks behind edges. A cloud that somebody merged of several
// scans was seen from no one place, and faces its origin everywhere. The same scans in the same
// order give the same bytes. One thread at a time.
class DistanceField {
 public:
  // REQUIRES: options.Validate().
  explicit DistanceField(const DistanceFieldOptions& options);
  ~DistanceField();
  DistanceField(DistanceField&&) noexcept;

  // RESOURCE_EXHAUSTED beyond max_bytes; OUT_OF_RANGE for a scan farther than 10⁹ voxels from the
  // first; the stop's status. `cloud`: as ValidateCloud() takes it; `sensor`: whose returns count.
  absl::Status Add(const PointCloud& cloud,
                   const Pose& T_map_scan,
                   const SensorModel& sensor,
                   const Stop& stop);
  absl::Status Carve(const PointCloud& cloud,
                     const Pose& T_map_scan,
                     const SensorModel& sensor,
                     const Stop& stop);
  // That were added and lie in the region.
  std::uint64_t points() const;
  std::size_t bytes() const;
  // Where node (0, 0, 0) is in a field whose first scan is this one.
  static Eigen::Vector3d OriginFor(const PointCloud& cloud, const Pose& T_map_scan, double voxel_m);

  // Open where nothing was seen. Without triangles where no points were. RESOURCE_EXHAUSTED for
  // 2³¹ vertices and more.
  absl::StatusOr<TriangleMesh> Mesh(const Stop& stop) const;

 private:
  class Field;
  std::unique_ptr<Field> field_;
};

}  // namespace strata

#endif  // STRATA_CORE_MESH_DISTANCE_FIELD_H_
