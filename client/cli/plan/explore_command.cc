// strata explore
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/str_format.h"

#include "client/cli/plan/driver_options.h"
#include "client/cli/terminal/arguments.h"
#include "client/cli/terminal/command.h"
#include "client/cli/terminal/json.h"
#include "client/cli/terminal/world_json.h"
#include "core/common/status.h"
#include "core/world/exploration.h"

namespace strata::cli {
namespace {

constexpr double kRadPerDegree = std::numbers::pi / 180.0;

struct ExploreOptions {
  std::string map;
  ExploreQuery query;
  DriverOptions driver;
};

void PrintText(const ExploreResult& result, Output& output) {
  output.Text(result.message);
  if (result.nearest.has_value()) {
    const Eigen::Vector3d& p = *result.nearest;
    output.Text(
        absl::StrFormat("nearest place to stand: %.2f,%.2f,%.2f (--from)", p.x(), p.y(), p.z()));
  }
  if (result.views.empty() && output.text()) return;
  Json rows = Json::array();
  for (const ExploreView& view : result.views) {
    rows.push_back(
        {{"place", ToJson(view.place)},
         {"heading",
          std::atan2(view.T_map_sensor.linear()(1, 0), view.T_map_sensor.linear()(0, 0)) /
              kRadPerDegree},
         {"gain_bits", view.gain_bits},
         {"volume_m3", view.volume_m3},
         {"cost_m", view.cost_m}});
  }
  output.List(rows,
              {{"place", "PLACE"},
               {"heading", "HEADING"},
               {"gain_bits", "BITS"},
               {"volume_m3", "M3"},
               {"cost_m", "COST"}});
}

absl::Status Explore(Context& context, ExploreOptions options) {
  STRATA_ASSIGN_OR_RETURN(options.query.profile, ProfileOf(context, options.map, options.driver));
  STRATA_ASSIGN_OR_RETURN(options.query.class_costs,
                          ClassCostsOf(context, options.map, options.driver));
  options.query.inferred = options.driver.inferred;
  context.output.Talk("looking at what the map's scans saw …");
  STRATA_ASSIGN_OR_RETURN(
      const ExploreResult result,
      context.database.planning().Explore(context.call, options.map, options.query));
  if (context.output.json()) {
    context.output.Object(ToJson(result));
  } else {
    PrintText(result, context.output);
  }
  return absl::OkStatus();
}

void AddSensor(CLI::App* verb, const std::shared_ptr<ExploreOptions>& options) {
  FieldOfView& sensor = options->query.sensor;
  AddNumbers(
      verb,
      "--fov",
      "DOWN,UP[,WIDTH]",
      2,
      3,
      [options](const std::vector<double>& n) {
        FieldOfView& fov = options->query.sensor;
        fov.down_rad = n[0] * kRadPerDegree;
        fov.up_rad = n[1] * kRadPerDegree;
        if (n.size() == 3) fov.width_rad = n[2] * kRadPerDegree;
      },
      "What the sensor sees below and above its plane, and around [degrees]; default "
      "30.7,10.7,360");
  verb->add_option("--rows", sensor.rows, "Beams of the sensor above each other")
      ->capture_default_str();
  verb->add_option("--columns", sensor.columns, "Beams beside each other")->capture_default_str();
  verb->add_option("--range", sensor.max_range_m, "Of the sensor [m]")->capture_default_str();
  verb->add_option(
          "--sensor-height", options->query.sensor_height_m, "Of the sensor over the ground [m]")
      ->capture_default_str();
}

}  // namespace

void AddExploreCommand(Commands& commands) {
  auto options = std::make_shared<ExploreOptions>();
  CLI::App* verb = commands.Verb(
      &commands.root,
      "explore",
      "Where a robot should look next: views of space that no scan has seen, from places that it "
      "can drive to on all levels, in the order in which to drive to them",
      "strata explore campus --from 3.2,-1.5,0.4 --count 3\n"
      "  strata explore campus --from 3.2,-1.5 --range 15 --fov 15,15 --radius 0.4 --output json",
      [options](Context& context) { return Explore(context, *options); });
  AddMapName(verb, options->map);
  AddNumbers(
      verb,
      "--from",
      "X,Y[,Z]",
      2,
      3,
      [options](const std::vector<double>& n) { options->query.from = EndpointOf(n); },
      "Where the robot is [m]; the surface nearest to Z, within its height of it; without Z the "
      "lowest")
      ->required();
  verb->add_option("--count", options->query.count, "Views at most")->capture_default_str();
  verb->add_option("--budget",
                   options->query.budget_m,
                   "No place costs more to drive to than this [m of good ground]")
      ->capture_default_str();
  verb->add_option("--resolution",
                   options->query.resolution_m,
                   "Edge of the voxels that are known or not [m]")
      ->capture_default_str();
  AddRegion(verb, options->query.region);
  verb->add_option(
          "--bits-per-metre", options->query.bits_per_m, "What a metre of the way has to be worth")
      ->capture_default_str();
  verb->add_option("--horizon",
                   options->query.horizon,
                   "Look at so many of the nearest places first, at farther ones where none of "
                   "these is worth it; 0: at all")
      ->capture_default_str();
  verb->add_option("--min-bits", options->query.min_bits, "Leave out views that are worth less")
      ->capture_default_str();
  AddSensor(verb, options);
  AddDriverOptions(verb, options->driver);
}

}  // namespace strata::cli
