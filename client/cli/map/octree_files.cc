#include "client/cli/map/octree_files.h"

#include <cmath>
#include <cstddef>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

#include "client/cli/mesh/scan_clouds.h"
#include "client/cli/terminal/json.h"
#include "client/cli/terminal/progress.h"
#include "client/formats/file_bytes.h"
#include "client/formats/grid/octree_writer.h"
#include "core/common/status.h"
#include "core/occupancy/occupancy_voxels.h"
#include "core/world/map_info.h"

namespace strata::cli {

absl::Status ExportOctree(Context& context,
                          const std::string& map,
                          const OctreeOptions& options,
                          const std::string& out) {
  STRATA_ASSIGN_OR_RETURN(const MapInfo info, context.database.maps().Get(context.call, map));
  const double voxel_m = std::ldexp(info.parameters.mls.cell_size_m, options.level);
  MeshOptions which;
  which.map = map;
  which.region = options.region;
  STRATA_ASSIGN_OR_RETURN(const ScanClouds clouds, ScanClouds::Find(context, which));
  OccupancyVoxelsOptions grid_options;
  grid_options.voxel_m = voxel_m;
  if (options.region.has_value()) grid_options.region = *options.region;
  STRATA_RETURN_IF_ERROR(grid_options.Validate());
  OccupancyVoxels grid(grid_options);
  Progress progress(context.output.talk(), TalksToTerminal(), "rays");
  for (std::size_t i = 0; i < clouds.size(); ++i) {
    progress.Update(static_cast<double>(i) / static_cast<double>(clouds.size()), "free space");
    STRATA_ASSIGN_OR_RETURN(const PosedCloud posed, clouds.Read(context, i));
    const absl::Status added =
        grid.Add(posed.cloud, posed.T_map_scan, posed.sensor, context.call.stop);
    if (absl::IsOutOfRange(added)) {
      return absl::OutOfRangeError(absl::StrCat(
          added.message(), " (--level), or export --format pcd, which reaches any place"));
    }
    STRATA_RETURN_IF_ERROR(added);
  }
  const OctreeFile octree = BtFile(grid, options.with_free);
  if (octree.nodes == 0) {
    return absl::NotFoundError(absl::StrCat("no ray of map ", map, " crosses the region"));
  }
  STRATA_RETURN_IF_ERROR(WriteFileBytes(out, octree.bytes));
  context.output.Object({{"file", out},
                         {"format", options.format},
                         {"voxel_m", voxel_m},
                         {"scans", clouds.size()},
                         {"nodes", octree.nodes},
                         {"occupied_m3", octree.occupied_m3},
                         {"free_m3", octree.free_m3},
                         {"bytes", octree.bytes.size()}});
  return absl::OkStatus();
}

}  // namespace strata::cli
