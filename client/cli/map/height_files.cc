#include "client/cli/map/height_files.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <limits>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

#include "client/cli/map/tile_source.h"
#include "client/cli/plan/driver_options.h"
#include "client/cli/terminal/json.h"
#include "client/cli/terminal/world_json.h"
#include "client/formats/file_bytes.h"
#include "client/formats/grid/local_projection.h"
#include "client/formats/grid/raster_writer.h"
#include "core/common/status.h"
#include "core/mls/elevation/elevation_map.h"
#include "core/mls/elevation/extended_elevation_map.h"
#include "core/mls/surface_tile.h"
#include "core/world/map_info.h"
#include "core/world/robot_limits.h"

namespace strata::cli {
namespace {

constexpr float kNoHeight = std::numeric_limits<float>::quiet_NaN();

// Heights and, of ground, the classes of the same cells.
struct Heights {
  ElevationMap map;
  std::vector<float> classes;
};

ElevationRegion FromAbove(const std::optional<Eigen::AlignedBox3d>& region) {
  if (!region.has_value()) return kEverywhere;
  return {region->min().head<2>(), region->max().head<2>()};
}

// The tiles of the region, and one more around: what is ground depends on what is beside it.
api::TileArea TilesAround(const HeightOptions& options, double cell_size_m) {
  api::TileArea area;
  area.level = options.level;
  if (!options.region.has_value()) return area;
  const auto tile_of = [&](double m) {
    constexpr double kFarthest = 1 << 30;
    const double tile = std::floor(m / (cell_size_m * kTileCells));
    return static_cast<std::int64_t>(std::clamp(tile, -kFarthest, kFarthest));
  };
  area.x_min = tile_of(options.region->min().x()) - 1;
  area.x_max = tile_of(options.region->max().x()) + 2;
  area.y_min = tile_of(options.region->min().y()) - 1;
  area.y_max = tile_of(options.region->max().y()) + 2;
  return area;
}

void KeepHeights(const Eigen::AlignedBox3d& region, std::vector<SurfaceTile>& tiles) {
  for (SurfaceTile& tile : tiles) {
    std::erase_if(tile.surfaces, [&](const Surface& surface) {
      return surface.z_m < region.min().z() || surface.z_m > region.max().z();
    });
    tile.IndexRows();
  }
}

absl::StatusOr<Heights> GroundOf(Context& context,
                                 const std::string& map,
                                 const HeightOptions& options,
                                 std::vector<SurfaceTile> tiles,
                                 double cell_size_m) {
  DriverOptions driver;
  driver.profile = options.profile;
  STRATA_ASSIGN_OR_RETURN(const RobotProfile profile, ProfileOf(context, map, driver));
  STRATA_ASSIGN_OR_RETURN(const ExtendedElevationMap ground,
                          MakeExtendedElevationMap(
                              std::move(tiles), cell_size_m, LimitsOf(profile), context.call.stop));
  Heights heights;
  STRATA_ASSIGN_OR_RETURN(heights.map, ElevationOf(ground, cell_size_m, FromAbove(options.region)));
  heights.classes.assign(heights.map.cells.size(), kNoHeight);
  for (std::size_t i = 0; i < heights.map.cells.size(); ++i) {
    if (!heights.map.cells[i].observed()) continue;
    const auto column = static_cast<std::int32_t>(i % heights.map.width);
    const auto row = static_cast<std::int32_t>(i / heights.map.width);
    const ExtendedElevationCell* const cell =
        ground.Find({heights.map.corner.x + column, heights.map.corner.y + row});
    heights.classes[i] = static_cast<float>(cell->elevation_class);
  }
  return heights;
}

absl::StatusOr<Heights> HeightsOf(Context& context,
                                  const std::string& map,
                                  const HeightOptions& options,
                                  std::vector<SurfaceTile> tiles,
                                  double cell_size_m) {
  if (options.surface == "ground") {
    return GroundOf(context, map, options, std::move(tiles), cell_size_m);
  }
  const ElevationRule rule =
      options.surface == "kalman" ? ElevationRule::kKalman : ElevationRule::kHighest;
  Heights heights;
  STRATA_ASSIGN_OR_RETURN(heights.map,
                          ElevationOf(tiles, cell_size_m, rule, FromAbove(options.region)));
  return heights;
}

// Heights are those of the map.
Raster RasterOf(Heights heights) {
  const ElevationMap& map = heights.map;
  Raster raster;
  raster.width = map.width;
  raster.height = map.height;
  raster.cell_size_m = map.cell_size_m;
  raster.x_m = map.corner.x * map.cell_size_m;
  raster.y_m = map.corner.y * map.cell_size_m;
  raster.bands = {{"height [m]", {}}, {"sigma [m]", {}}};
  for (RasterBand& band : raster.bands) band.values.reserve(map.cells.size());
  for (const ElevationCell& cell : map.cells) {
    raster.bands[0].values.push_back(cell.observed() ? cell.z_m : kNoHeight);
    raster.bands[1].values.push_back(cell.observed() ? cell.sigma_m : kNoHeight);
  }
  if (!heights.classes.empty()) {
    raster.bands.push_back({"class", std::move(heights.classes)});
  }
  return raster;
}

void PlaceOnEarth(const GeodeticOrigin& origin, Raster& raster) {
  const LocalProjection projection(origin);
  raster.projection = projection;
  std::vector<float>& heights = raster.bands.front().values;
  for (std::size_t i = 0; i < heights.size(); ++i) {
    const auto column = static_cast<double>(i % raster.width);
    const auto row = static_cast<double>(i / raster.width);
    heights[i] = static_cast<float>(
        projection.EllipsoidHeight({raster.x_m + (column + 0.5) * raster.cell_size_m,
                                    raster.y_m + (row + 0.5) * raster.cell_size_m,
                                    heights[i]}));
  }
}

absl::Status NoHeights(Context& context, const std::string& map) {
  STRATA_ASSIGN_OR_RETURN(const MapStats stats, context.database.maps().Stats(context.call, map));
  if (stats.patches == 0) {
    return absl::FailedPreconditionError(absl::StrCat(
        "map ", map, " has no surfaces: import scans, or wait until they are integrated"));
  }
  return absl::NotFoundError(absl::StrCat(
      "no surface of map ", map, " lies in the region; the map lies ", ExtentOf(stats)));
}

// Writes a grid for each band; the files.
absl::StatusOr<Json> WriteGrids(const Raster& raster, const std::filesystem::path& out) {
  Json files = Json::array();
  const auto write = [&files](const std::filesystem::path& file, const std::string& bytes) {
    files.push_back(file.string());
    return WriteFileBytes(file, bytes);
  };
  constexpr const char* kSuffixes[] = {"", "-sigma", "-class"};
  for (std::size_t i = 0; i < raster.bands.size(); ++i) {
    std::filesystem::path file = out;
    file.replace_filename(
        absl::StrCat(out.stem().string(), kSuffixes[i], out.extension().string()));
    STRATA_RETURN_IF_ERROR(write(file, AscText(raster, raster.bands[i])));
    if (!raster.projection.has_value()) continue;
    STRATA_RETURN_IF_ERROR(write(file.replace_extension(".prj"), raster.projection->Wkt() + "\n"));
  }
  return files;
}

absl::StatusOr<Json> WriteRaster(const Raster& raster,
                                 const std::string& format,
                                 const std::string& out) {
  if (format == "asc") return WriteGrids(raster, out);
  STRATA_ASSIGN_OR_RETURN(const std::string bytes, GeoTiffBytes(raster));
  STRATA_RETURN_IF_ERROR(WriteFileBytes(out, bytes));
  return Json::array({out});
}

Json HeightReport(const Raster& raster, const HeightOptions& options) {
  const auto known = [](float value) { return !std::isnan(value); };
  const std::vector<float>& heights = raster.bands.front().values;
  float low = std::numeric_limits<float>::infinity();
  float high = -low;
  for (const float height : heights) {
    low = std::fmin(low, height);
    high = std::fmax(high, height);
  }
  Json report = {
      {"surface", options.surface},
      {"width", raster.width},
      {"height", raster.height},
      {"cells", std::count_if(heights.begin(), heights.end(), known)},
      {"cell_size_m", raster.cell_size_m},
      {"corner", {raster.x_m, raster.y_m}},
      {"low", low},
      {"high", high},
      {"heights", raster.projection.has_value() ? "above the WGS 84 ellipsoid" : "of the map"}};
  for (const RasterBand& band : raster.bands) report["bands"].push_back(band.name);
  return report;
}

}  // namespace

absl::Status ExportHeights(Context& context,
                           const std::string& map,
                           const HeightOptions& options,
                           const std::string& format,
                           const std::string& out) {
  if (options.surface == "ground" && options.level > 0) {
    return absl::InvalidArgumentError(
        "--surface ground judges the finest cells; leave --level out, or take --surface highest");
  }
  STRATA_ASSIGN_OR_RETURN(const MapInfo info, context.database.maps().Get(context.call, map));
  const double cell_size_m = std::ldexp(info.parameters.mls.cell_size_m, options.level);
  STRATA_ASSIGN_OR_RETURN(FetchedTiles fetched,
                          FetchTiles(context, map, TilesAround(options, cell_size_m)));
  if (options.region.has_value()) KeepHeights(*options.region, fetched.tiles);
  STRATA_ASSIGN_OR_RETURN(Heights heights,
                          HeightsOf(context, map, options, std::move(fetched.tiles), cell_size_m));
  if (heights.map.cells.empty()) {
    STRATA_RETURN_IF_ERROR(fetched.damage);
    return NoHeights(context, map);
  }
  Raster raster = RasterOf(std::move(heights));
  if (info.parameters.origin.has_value()) PlaceOnEarth(*info.parameters.origin, raster);
  Json report = {{"format", format}};
  STRATA_ASSIGN_OR_RETURN(report["files"], WriteRaster(raster, format, out));
  report.update(HeightReport(raster, options));
  if (raster.projection.has_value() && context.output.json()) {
    report["projection"] = raster.projection->Wkt();
  }
  context.output.Object(report);
  return fetched.damage;
}

}  // namespace strata::cli
