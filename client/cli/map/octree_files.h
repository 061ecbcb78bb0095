// A map's free and occupied space as a file of OctoMap.
#ifndef STRATA_CLIENT_CLI_MAP_OCTREE_FILES_H_
#define STRATA_CLIENT_CLI_MAP_OCTREE_FILES_H_

#include <cstdint>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include <Eigen/Geometry>

#include "client/cli/terminal/command.h"

namespace strata::cli {

struct OctreeOptions {
  std::int32_t level = 0;  // voxels are 2^level of the map's cells wide
  std::optional<Eigen::AlignedBox3d> region;
  std::string format = "octomap";  // as it was asked for
  bool with_free = true;
};

// Writes what the rays of the map's scans hit and went through; shows progress. Errors of
// ScanClouds::Find and OccupancyVoxels, and NOT_FOUND for a region that no ray crosses.
absl::Status ExportOctree(Context& context,
                          const std::string& map,
                          const OctreeOptions& options,
                          const std::string& out);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_MAP_OCTREE_FILES_H_
