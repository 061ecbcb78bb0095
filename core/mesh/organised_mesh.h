// The points of one scan, joined as its sensor saw them side by side (thesis 4.5.1).
#ifndef STRATA_CORE_MESH_ORGANISED_MESH_H_
#define STRATA_CORE_MESH_ORGANISED_MESH_H_

#include "absl/status/statusor.h"

#include "core/cloud/point_cloud.h"
#include "core/mesh/triangle_mesh.h"

namespace strata {

// Triangles between neighbours of the scan's grid, in the scan frame and facing the sensor, with
// the points' colours. None across an edge of a thing: where a side is longer than four times the
// usual distance of neighbours at that range, or than half a metre, or seen at less than 3°.
// FAILED_PRECONDITION for a cloud without two rows and columns. A pure function. REQUIRES: a cloud
// as ValidateCloud() takes it.
absl::StatusOr<TriangleMesh> MeshOrganised(const PointCloud& cloud);

}  // namespace strata

#endif  // STRATA_CORE_MESH_ORGANISED_MESH_H_
