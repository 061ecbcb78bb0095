#include "client/cli/map/floor_files.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"

#include "client/cli/plan/driver_options.h"
#include "client/cli/terminal/arguments.h"
#include "client/cli/terminal/json.h"
#include "client/cli/terminal/names.h"
#include "client/formats/file_bytes.h"
#include "core/common/status.h"

namespace strata::cli {
namespace {

absl::Status NoFloor(const std::string& map, const FloorPlan& plan, int asked) {
  if (plan.floors.empty()) {
    return absl::NotFoundError(absl::StrCat("map ", map, " has no floor for this robot"));
  }
  return absl::NotFoundError(
      absl::StrCat("map ", map, ": no floor ", asked, "; it has 0 to ", plan.floors.size() - 1));
}

absl::StatusOr<RobotProfile> DriverOf(Context& context,
                                      const std::string& map,
                                      const FloorOptions& options) {
  DriverOptions driver;
  driver.profile = options.profile;
  return ProfileOf(context, map, driver);
}

// Both files of a floor.
absl::StatusOr<Json> WriteFloor(const FloorPlan& plan,
                                std::size_t number,
                                GridMode mode,
                                const std::filesystem::path& stem) {
  STRATA_ASSIGN_OR_RETURN(const OccupancyGrid grid, GridOf(plan.floors[number], plan.cell_size_m));
  const std::string image = stem.string() + ".pgm";
  const std::string yaml = stem.string() + ".yaml";
  STRATA_RETURN_IF_ERROR(WriteFileBytes(image, PgmBytes(grid, mode)));
  STRATA_RETURN_IF_ERROR(
      WriteFileBytes(yaml, Nav2Yaml(grid, mode, std::filesystem::path(image).filename().string())));
  const auto count = [&grid](GridCell cell) {
    return std::count(grid.cells.begin(), grid.cells.end(), cell);
  };
  return Json{{"floor", number},
              {"file", yaml},
              {"image", image},
              {"width", grid.width},
              {"height", grid.height},
              {"free", count(GridCell::kFree)},
              {"occupied", count(GridCell::kOccupied)},
              {"unknown", count(GridCell::kUnknown) + count(GridCell::kGround)}};
}

}  // namespace

void AddFloorOptions(CLI::App* verb, FloorOptions& options, bool with_number) {
  TakesName(verb->add_option("--profile",
                             options.profile,
                             "The map's robot profile whose floors, or whose ground, they are")
                ->capture_default_str(),
            kProfileNames);
  if (with_number) {
    verb->add_option("--floor", options.floor, "The floor of this number, as map floors has it")
        ->check(CLI::Range(0, std::numeric_limits<int>::max()));
  }
  AddNumbers(
      verb,
      "--at",
      "X,Y,Z",
      3,
      3,
      [&options](const std::vector<double>& n) {
        options.at = PlanEndpoint{.x_m = n[0], .y_m = n[1], .z_m = n[2]};
      },
      "The floor under a robot at this place [m]");
}

absl::StatusOr<FloorPlan> FloorsOf(Context& context,
                                   const std::string& map,
                                   const FloorOptions& options,
                                   bool cells) {
  if (options.floor.has_value() && options.at.has_value()) {
    return absl::InvalidArgumentError("--floor and --at: give one of them");
  }
  FloorQuery query;
  query.at = options.at;
  query.cells = cells;
  query.inferred = options.inferred;
  STRATA_ASSIGN_OR_RETURN(query.profile, DriverOf(context, map, options));
  STRATA_ASSIGN_OR_RETURN(FloorPlan plan,
                          context.database.planning().ListFloors(context.call, map, query));
  const int asked = options.floor.value_or(0);
  if (options.floor.has_value() && static_cast<std::size_t>(asked) >= plan.floors.size()) {
    return NoFloor(map, plan, asked);
  }
  if (options.at.has_value() && !plan.at.has_value()) {
    return absl::NotFoundError(absl::StrCat("map ",
                                            map,
                                            ": no floor at ",
                                            options.at->x_m,
                                            ", ",
                                            options.at->y_m,
                                            ", ",
                                            options.at->z_m.value_or(0.0)));
  }
  return plan;
}

absl::Status KeepFloor(Context& context,
                       const std::string& map,
                       const FloorOptions& options,
                       std::vector<SurfaceTile>& tiles) {
  if (!options.floor.has_value() && !options.at.has_value()) return absl::OkStatus();
  STRATA_ASSIGN_OR_RETURN(const RobotProfile profile, DriverOf(context, map, options));
  STRATA_ASSIGN_OR_RETURN(const FloorPlan plan, FloorsOf(context, map, options, true));
  const Floor& floor = plan.floors[options.at.has_value() ? *plan.at : *options.floor];
  std::map<std::pair<std::int32_t, std::int32_t>, std::uint64_t> blocks;
  for (const FloorBlock& block : floor.blocks) {
    blocks[{block.x, block.y}] = block.free | block.occupied | block.ground;
  }
  const double low_m = floor.low.z() - profile.max_step_m;
  const double high_m = floor.high.z() + profile.height_m;
  for (SurfaceTile& tile : tiles) {
    std::erase_if(tile.surfaces, [&](const Surface& surface) {
      const CellIndex cell = CellOf(tile.key, surface.cell);
      const auto found = blocks.find({cell.x >> 3, cell.y >> 3});
      const int bit = (cell.y & 7) * kFloorBlockCells + (cell.x & 7);
      return found == blocks.end() || (found->second >> bit & 1U) == 0 || surface.z_m < low_m ||
             surface.bottom_m() > high_m;
    });
    tile.IndexRows();
  }
  std::erase_if(tiles, [](const SurfaceTile& tile) { return tile.surfaces.empty(); });
  return absl::OkStatus();
}

absl::Status ExportFloors(Context& context,
                          const std::string& map,
                          const FloorOptions& options,
                          GridMode mode,
                          const std::string& out) {
  STRATA_ASSIGN_OR_RETURN(const FloorPlan plan, FloorsOf(context, map, options, true));
  if (plan.floors.empty()) return NoFloor(map, plan, 0);
  std::filesystem::path stem = out;
  if (stem.extension() == ".yaml" || stem.extension() == ".pgm") stem.replace_extension();
  if (!plan.message.empty()) context.output.Talk(plan.message);
  const std::optional<int> one = options.floor.has_value() ? options.floor : plan.at;
  Json written = Json::array();
  for (std::size_t i = 0; i < plan.floors.size(); ++i) {
    if (one.has_value() && static_cast<std::size_t>(*one) != i) continue;
    const std::filesystem::path own =
        one.has_value() ? stem : std::filesystem::path(absl::StrCat(stem.string(), "-", i));
    STRATA_ASSIGN_OR_RETURN(Json row, WriteFloor(plan, i, mode, own));
    written.push_back(std::move(row));
  }
  context.output.List(written,
                      {{"floor", "FLOOR"},
                       {"file", "FILE"},
                       {"width", "WIDTH"},
                       {"height", "HEIGHT"},
                       {"free", "FREE"},
                       {"occupied", "OCCUPIED"}});
  return absl::OkStatus();
}

}  // namespace strata::cli
