// strata map floors
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_format.h"

#include "client/cli/map/floor_files.h"
#include "client/cli/map/map_files.h"
#include "client/cli/terminal/arguments.h"
#include "client/cli/terminal/json.h"
#include "core/common/status.h"

namespace strata::cli {
namespace {

struct FloorsOptions {
  std::string map;
  FloorOptions floor;
};

Json FloorRows(const FloorPlan& plan) {
  Json rows = Json::array();
  for (std::size_t i = 0; i < plan.floors.size(); ++i) {
    const Floor& floor = plan.floors[i];
    rows.push_back({{"floor", i},
                    {"area_m2", floor.area_m2},
                    {"mean_z", floor.mean_z_m},
                    {"low", ToJson(floor.low)},
                    {"high", ToJson(floor.high)},
                    {"place", ToJson(floor.place)}});
  }
  return rows;
}

Json LinkRows(const FloorPlan& plan) {
  Json rows = Json::array();
  for (const FloorLink& link : plan.links) {
    rows.push_back({{"floors", {link.a, link.b}},
                    {"place", ToJson(link.place)},
                    {"width_m", link.width_m},
                    {"slope_rad", link.slope_rad}});
  }
  return rows;
}

absl::Status Floors(Context& context, const FloorsOptions& options) {
  STRATA_ASSIGN_OR_RETURN(const FloorPlan plan,
                          FloorsOf(context, options.map, options.floor, false));
  Json floors = FloorRows(plan);
  Json links = LinkRows(plan);
  if (context.output.json()) {
    context.output.Object({{"floors", floors},
                           {"links", links},
                           {"at", plan.at.has_value() ? Json(*plan.at) : Json()},
                           {"message", plan.message},
                           {"epoch", plan.epoch},
                           {"commit_sequence", plan.commit_sequence}});
    return absl::OkStatus();
  }
  if (!plan.message.empty()) context.output.Talk(plan.message);
  if (plan.floors.empty() && context.output.text()) {
    context.output.Text("no floor: this robot can stand nowhere on 10 m² or more");
    return absl::OkStatus();
  }
  context.output.List(floors,
                      {{"floor", "FLOOR"},
                       {"area_m2", "AREA"},
                       {"mean_z", "Z"},
                       {"low", "LOW"},
                       {"high", "HIGH"},
                       {"place", "PLACE"}});
  if (!links.empty()) {
    context.output.List(
        links,
        {{"floors", "BETWEEN"}, {"place", "PLACE"}, {"width_m", "WIDTH"}, {"slope_rad", "SLOPE"}});
  }
  if (plan.at.has_value()) context.output.Text(absl::StrFormat("there: floor %d", *plan.at));
  return absl::OkStatus();
}

}  // namespace

void AddMapFloors(Commands& commands, CLI::App* noun) {
  auto options = std::make_shared<FloorsOptions>();
  CLI::App* app = commands.Verb(
      noun,
      "floors",
      "What a robot can drive in one go without ever being above itself: storeys, a bridge and "
      "what is below it; and where one drives from one to another",
      "strata map floors campus --at 3.2,-1.5,0.4",
      [options](Context& context) { return Floors(context, *options); });
  AddMapName(app, options->map);
  AddFloorOptions(app, options->floor, false);
  AddInferred(app, options->floor.inferred);
}

}  // namespace strata::cli
