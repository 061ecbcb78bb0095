// The colours that scans saw, on a mesh of them.
#ifndef STRATA_CORE_MESH_VERTEX_COLOURS_H_
#define STRATA_CORE_MESH_VERTEX_COLOURS_H_

#include <array>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"

#include "core/cloud/point_cloud.h"
#include "core/common/hash_map.h"
#include "core/common/stop.h"
#include "core/geometry/pose.h"
#include "core/mesh/triangle_mesh.h"
#include "core/mesh/voxel_blocks.h"

namespace strata {

// Give it scans one after the other, then take the colours. One thread at a time. Takes some 120
// bytes a vertex.
class VertexColours {
 public:
  // Points count for the vertices within `reach_m` of them, the near ones most. REQUIRES: a mesh
  // that outlives this and stays as it is; 0.001 ≤ reach_m ≤ 100.
  VertexColours(const TriangleMesh& mesh, double reach_m);

  // A cloud without colours says nothing. The stop's status. `cloud`: as ValidateCloud() takes it.
  absl::Status Add(const PointCloud& cloud, const Pose& T_mesh_scan, const Stop& stop);
  // One a vertex: the mean of its points, or of the vertices that it has triangles with where it
  // has no points; grey where neither is. Empty if no point had a colour.
  std::vector<Colour> Colours() const;

 private:
  struct Sum {
    std::array<float, 3> channels = {};
    float weight = 0.0F;
  };

  const TriangleMesh& mesh_;
  NodeGrid grid_;                                           // node n: the corner of cube n
  HashMap<BlockKey, std::vector<std::uint32_t>> vertices_;  // of each cube
  std::vector<Sum> sums_;
  bool any_ = false;
};

}  // namespace strata

#endif  // STRATA_CORE_MESH_VERTEX_COLOURS_H_
