// Points of scans, and the scans to mesh, fetched one at a time.
#ifndef STRATA_CLIENT_CLI_MESH_SCAN_CLOUDS_H_
#define STRATA_CLIENT_CLI_MESH_SCAN_CLOUDS_H_

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "client/cli/mesh/mesh_options.h"
#include "client/cli/terminal/command.h"
#include "core/cloud/point_cloud.h"
#include "core/cloud/sensor_model.h"
#include "core/geometry/pose.h"
#include "core/world/map_info.h"
#include "core/world/scan.h"

namespace strata::cli {

struct PosedCloud {
  PointCloud cloud;
  Pose T_map_scan;
  SensorModel sensor;
};

// The scan's points and colours without what has faded, and labels.
absl::StatusOr<PosedCloud> ReadPosedCloud(Context& context,
                                          const MapInfo& map,
                                          const ScanInfo& scan);

// FAILED_PRECONDITION: the map has dropped the points of its scans, and what to do instead.
absl::Status DroppedPoints(const std::string& map);

class ScanClouds {
 public:
  // Looks up what `options` names. FAILED_PRECONDITION where nothing can be meshed: no scans that
  // are integrated, or points that the map has dropped; NOT_FOUND where the region has none.
  static absl::StatusOr<ScanClouds> Find(Context& context, const MeshOptions& options);

  std::size_t size() const { return scans_.size(); }
  // Whether any of them has colours.
  bool has_colour() const;
  // Scan `i` without the points that have faded, of all classes; one scan alone at the identity.
  absl::StatusOr<PosedCloud> Read(Context& context, std::size_t i) const;
  // The same without the points that are not of the class asked for.
  void KeepClass(PointCloud& cloud) const;

 private:
  MeshOptions options_;
  std::vector<ScanInfo> scans_;
  MapInfo map_;
  std::optional<std::uint16_t> class_id_;
};

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_MESH_SCAN_CLOUDS_H_
