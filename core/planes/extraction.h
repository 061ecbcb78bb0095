// Flat surfaces and straight edges of one scan (thesis 5.2.1, 5.2.3).
#ifndef STRATA_CORE_PLANES_EXTRACTION_H_
#define STRATA_CORE_PLANES_EXTRACTION_H_

#include "absl/status/status.h"
#include <Eigen/Core>

#include "core/cloud/point_cloud.h"
#include "core/cloud/sensor_model.h"
#include "core/mls/mls_map.h"
#include "core/planes/scan_planes.h"

namespace strata {

struct PlaneExtractionOptions {
  SensorModel sensor;
  // Of a local map: where it was seen from, in its frame; within ±1e6 m. A cloud has its own.
  Eigen::Vector3f sensor_origin = Eigen::Vector3f::Zero();
  // Points farther away are not looked at; in (0, 1000].
  double max_range_m = 100.0;
  // Edge of the largest cells in which flatness is judged; in [0.2, 20]. A cell that is not flat is
  // halved up to three times, so this over eight is the smallest detail.
  double cell_size_m = 2.0;
  // A surface whose points spread more about their plane is none; in [0.001, 1].
  double max_rms_m = 0.05;
  // Between the normals of a region and of a cell that joins it; in [0.01, 0.5].
  double max_angle_rad = 0.17;
  double min_area_m2 = 1.0;        // of a patch; in [0.01, 10000]
  double range_jump_m = 0.5;       // an edgel's neighbour is this much farther (τ of 5.2.3)
  double min_edge_length_m = 1.0;  // in [0.1, 1000]
  int max_patches = 128;           // the largest; in [0, 10000]
  int max_edges = 128;             // the longest; in [0, 10000]

  // INVALID_ARGUMENT naming every field out of its range.
  absl::Status Validate() const;
};

// What a scan contributes, in the scan frame: that of cloud.points (`cloud.origin` belongs to the
// pose). Patches: cells that are flat, grown into regions while they lie in one plane (5.2.1).
// Edges: creases between patches, and depth borders, found in the grid of an organised cloud or in
// a spherical image of an unorganised one. `options` must be valid. A pure function, thread-safe;
// memory is a small multiple of the cloud's. Points that are not finite are no points.
ScanPlanes ExtractPlanes(const PointCloud& cloud, const PlaneExtractionOptions& options = {});

// The same of what remains where points were dropped: the patches of a local map in the scan frame,
// seen from options.sensor_origin. A cell blurs what is in it: surfaces are allowed 0.4 cells of
// spread. The edges are creases only.
ScanPlanes ExtractPlanes(const MlsMap& local_map, const PlaneExtractionOptions& options = {});

}  // namespace strata

#endif  // STRATA_CORE_PLANES_EXTRACTION_H_
