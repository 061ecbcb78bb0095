#include "client/cli/heights/scan_heights.h"

#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

#include "client/cli/heights/height_raster.h"
#include "client/cli/mesh/scan_clouds.h"
#include "client/cli/terminal/arguments.h"
#include "client/cli/terminal/world_json.h"
#include "core/common/status.h"
#include "core/mls/elevation/elevation_map.h"
#include "core/world/map_info.h"
#include "core/world/scan.h"

namespace strata::cli {
namespace {

struct ScanHeightOptions {
  std::string map;
  ScanId scan;
  HeightFile file{.format = "geotiff", .out = {}, .surface = "highest"};
  std::optional<double> cell_size_m;
};

absl::StatusOr<ElevationMap> HeightsOf(const PosedCloud& scan,
                                       const std::string& surface,
                                       double cell_size_m) {
  if (surface == "interpolated") {
    return InterpolateBackward(scan.cloud, scan.T_map_scan, scan.sensor, cell_size_m);
  }
  return InsertForward(scan.cloud,
                       scan.T_map_scan,
                       scan.sensor,
                       cell_size_m,
                       surface == "kalman" ? ElevationRule::kKalman : ElevationRule::kHighest);
}

absl::Status WriteScanHeights(Context& context, const ScanHeightOptions& options) {
  STRATA_ASSIGN_OR_RETURN(const MapInfo info,
                          context.database.maps().Get(context.call, options.map));
  STRATA_ASSIGN_OR_RETURN(const ScanInfo scan,
                          context.database.scans().Get(context.call, options.map, options.scan));
  if (!info.parameters.keep_points) return DroppedPoints(options.map);
  if (options.file.surface == "interpolated" && scan.header.rows == 0) {
    return absl::FailedPreconditionError(
        absl::StrCat("scan ",
                     options.scan.ToString(),
                     " has no rows and columns; take --surface highest or kalman"));
  }
  STRATA_ASSIGN_OR_RETURN(const PosedCloud posed, ReadPosedCloud(context, info, scan));
  Heights heights;
  STRATA_ASSIGN_OR_RETURN(heights.map,
                          HeightsOf(posed,
                                    options.file.surface,
                                    options.cell_size_m.value_or(info.parameters.mls.cell_size_m)));
  if (heights.map.cells.empty()) {
    return absl::FailedPreconditionError(absl::StrCat("scan ",
                                                      options.scan.ToString(),
                                                      " has no points within the sensor's range "
                                                      "that have not faded"));
  }
  return WriteHeights(context, std::move(heights), info.parameters.origin, options.file);
}

}  // namespace

void AddScanHeights(Commands& commands, CLI::App* noun) {
  auto options = std::make_shared<ScanHeightOptions>();
  CLI::App* app =
      commands.Verb(noun,
                    "heights",
                    "Write what one scan saw as an elevation map, at its pose in the map",
                    "strata scan heights campus segway/12 --surface interpolated --out scan.tif",
                    [options](Context& context) { return WriteScanHeights(context, *options); });
  AddMapName(app, options->map);
  AddScanId(app, options->scan);
  app->add_option("--out", options->file.out, "The file to write")->type_name("FILE")->required();
  app->add_option("--format",
                  options->file.format,
                  "geotiff: heights and their standard deviation as bands, on earth where the map "
                  "has an origin; asc: the same as ESRI ASCII grids, FILE.asc and FILE-sigma.asc, "
                  "with .prj")
      ->check(CLI::IsMember({"geotiff", "asc"}))
      ->capture_default_str();
  app->add_option("--surface",
                  options->file.surface,
                  "The highest point of each cell; all of them fused (kalman); or the surface "
                  "between neighbours in the rows and columns of the scan (interpolated), so "
                  "that cells between two points have a height, too")
      ->check(CLI::IsMember({"highest", "kalman", "interpolated"}))
      ->capture_default_str();
  app->add_option(
         "--cell-size", options->cell_size_m, "Edge of a cell [m]; the map's where not given")
      ->check(CLI::Range(0.01, 100.0));
}

}  // namespace strata::cli
