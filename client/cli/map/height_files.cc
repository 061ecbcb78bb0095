#include "client/cli/map/height_files.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

#include "client/cli/heights/height_raster.h"
#include "client/cli/map/tile_source.h"
#include "client/cli/plan/driver_options.h"
#include "client/cli/terminal/world_json.h"
#include "core/common/status.h"
#include "core/mls/elevation/elevation_map.h"
#include "core/mls/elevation/extended_elevation_map.h"
#include "core/mls/surface_tile.h"
#include "core/world/map_info.h"
#include "core/world/robot_limits.h"

namespace strata::cli {
namespace {

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

absl::Status NoHeights(Context& context, const std::string& map) {
  STRATA_ASSIGN_OR_RETURN(const MapStats stats, context.database.maps().Stats(context.call, map));
  if (stats.patches == 0) {
    return NoSurfaces(map);
  }
  return absl::NotFoundError(absl::StrCat(
      "no surface of map ", map, " lies in the region; the map lies ", ExtentOf(stats)));
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
  STRATA_RETURN_IF_ERROR(WriteHeights(context,
                                      std::move(heights),
                                      info.parameters.origin,
                                      {.format = format, .out = out, .surface = options.surface}));
  return fetched.damage;
}

}  // namespace strata::cli
