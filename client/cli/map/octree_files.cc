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
  OctreeWriter octree(voxel_m, options.region);
  Progress progress(context.output.talk(), TalksToTerminal(), "rays");
  for (std::size_t i = 0; i < clouds.size(); ++i) {
    progress.Update(static_cast<double>(i) / static_cast<double>(clouds.size()), "free space");
    STRATA_ASSIGN_OR_RETURN(const PosedCloud posed, clouds.Read(context, i));
    STRATA_RETURN_IF_ERROR(
        octree.Add(posed.cloud, posed.T_mesh_scan, posed.sensor, context.call.stop));
  }
  const OctreeWriter::Extent extent = octree.Finish();
  if (extent.nodes == 0) {
    return absl::NotFoundError(absl::StrCat("no ray of map ", map, " crosses the region"));
  }
  STRATA_ASSIGN_OR_RETURN(const std::string bytes, octree.BtBytes());
  STRATA_RETURN_IF_ERROR(WriteFileBytes(out, bytes));
  context.output.Object({{"file", out},
                         {"format", "bt"},
                         {"voxel_m", voxel_m},
                         {"scans", clouds.size()},
                         {"nodes", extent.nodes},
                         {"occupied_m3", extent.occupied_m3},
                         {"free_m3", extent.free_m3},
                         {"bytes", bytes.size()}});
  return absl::OkStatus();
}

}  // namespace strata::cli
