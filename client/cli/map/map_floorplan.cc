// strata map floorplan
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include <Eigen/Geometry>

#include "client/cli/map/floor_files.h"
#include "client/cli/map/map_files.h"
#include "client/cli/planes/fetched_planes.h"
#include "client/cli/planes/storey_drawing.h"
#include "client/cli/planes/storey_plan.h"
#include "client/cli/terminal/arguments.h"
#include "client/cli/terminal/json.h"
#include "core/common/status.h"

namespace strata::cli {
namespace {

struct FloorplanOptions {
  std::string map;
  std::string out;
  StoreyOptions storey;
  FloorOptions floors;
};

// What stands on the floors of the storey, as the map's patches say.
absl::Status AddStanding(Context& context, const FloorplanOptions& options, StoreyPlan& plan) {
  STRATA_ASSIGN_OR_RETURN(const FloorPlan floors,
                          FloorsOf(context, options.map, options.floors, true));
  for (const Floor& floor : floors.floors) {
    if (std::abs(floor.mean_z_m - plan.storey_z_m) > kStoreyReachM) continue;
    STRATA_ASSIGN_OR_RETURN(const OccupancyGrid grid, GridOf(floor, floors.cell_size_m));
    AddObstacles(grid, plan);
  }
  return absl::OkStatus();
}

absl::Status Floorplan(Context& context, const FloorplanOptions& options) {
  STRATA_ASSIGN_OR_RETURN(const FetchedPlanes planes, FetchPlanes(context, options.map));
  STRATA_ASSIGN_OR_RETURN(StoreyPlan plan, PlanOfStorey(planes.model, options.storey));
  STRATA_RETURN_IF_ERROR(AddStanding(context, options, plan));
  STRATA_RETURN_IF_ERROR(WriteStorey(options.out, plan, options.map));
  const Eigen::AlignedBox2d extent = ExtentOf(plan);
  context.output.Object({{"file", options.out},
                         {"storey_z_m", plan.storey_z_m},
                         {"cut_z_m", plan.cut_z_m},
                         {"walls", plan.walls.size()},
                         {"unseen", plan.unseen.size()},
                         {"low", Json::array({extent.min().x(), extent.min().y()})},
                         {"high", Json::array({extent.max().x(), extent.max().y()})},
                         {"epoch", planes.info.epoch}});
  return absl::OkStatus();
}

}  // namespace

void AddMapFloorplan(Commands& commands, CLI::App* noun) {
  auto options = std::make_shared<FloorplanOptions>();
  CLI::App* app = commands.Verb(
      noun,
      "floorplan",
      "The plan of a storey as SVG or DXF: walls that planes find found, cut above its floor, with "
      "gaps where doors were seen open, dashed where nothing was seen; grey: what stands there",
      "strata map floorplan campus ground.svg --storey 0",
      [options](Context& context) { return Floorplan(context, *options); });
  AddMapName(app, options->map);
  app->add_option("FILE", options->out, "Where to, by its ending")
      ->type_name("FILE.(svg|dxf)")
      ->required();
  app->add_option("--storey", options->storey.storey_z_m, "Height of its floor in the map [m]")
      ->required();
  app->add_option("--cut", options->storey.cut_height_m, "Where walls are cut, above the floor [m]")
      ->check(CLI::Range(0.01, 100.0))
      ->capture_default_str();
  AddNumbers(
      app,
      "--region",
      "X0,Y0,X1,Y1",
      4,
      4,
      [options](const std::vector<double>& n) {
        if (n[0] >= n[2] || n[1] >= n[3]) {
          throw CLI::ValidationError("--region", "expected X0 < X1 and Y0 < Y1");
        }
        options->storey.region.emplace(Eigen::Vector2d(n[0], n[1]), Eigen::Vector2d(n[2], n[3]));
      },
      "Only this part of the storey [m]; default: all of it");
}

}  // namespace strata::cli
