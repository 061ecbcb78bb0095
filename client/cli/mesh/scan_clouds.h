// The scans to mesh, fetched one at a time.
#ifndef STRATA_CLIENT_CLI_MESH_SCAN_CLOUDS_H_
#define STRATA_CLIENT_CLI_MESH_SCAN_CLOUDS_H_

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "client/cli/mesh/mesh_options.h"
#include "client/cli/terminal/command.h"
#include "core/cloud/point_cloud.h"
#include "core/cloud/sensor_model.h"
#include "core/geometry/pose.h"
#include "core/world/scan.h"

namespace strata::cli {

struct PosedCloud {
  PointCloud cloud;
  Pose T_mesh_scan;
  SensorModel sensor;
};

class ScanClouds {
 public:
  // Looks up what `options` names. FAILED_PRECONDITION where nothing can be meshed: no scans that
  // are integrated, or points that the map has dropped; NOT_FOUND where the region has none.
  static absl::StatusOr<ScanClouds> Find(Context& context, const MeshOptions& options);

  std::size_t size() const { return scans_.size(); }
  // Whether any of them has colours.
  bool has_colour() const;
  // Scan `i` without the points that have faded; of all classes.
  absl::StatusOr<PosedCloud> Read(Context& context, std::size_t i) const;
  // The same without the points that are not of the class asked for.
  void KeepClass(PointCloud& cloud) const;

 private:
  MeshOptions options_;
  std::vector<ScanInfo> scans_;
  SensorModel sensor_;  // of scans without their own
  std::optional<std::uint16_t> class_id_;
};

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_MESH_SCAN_CLOUDS_H_
