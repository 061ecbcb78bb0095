// strata surface
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include <Eigen/Core>

#include "client/cli/terminal/arguments.h"
#include "client/cli/terminal/command.h"
#include "client/cli/terminal/json.h"
#include "client/cli/terminal/number_file.h"
#include "client/cli/terminal/on_earth.h"
#include "core/common/status.h"
#include "core/world/map_class.h"

namespace strata::cli {
namespace {

struct SurfaceOptions {
  std::string map;
  std::vector<Eigen::Vector2d> at;
  std::string points_file;
};

// Adds what the map calls the classes of surfaces.
void NameClasses(const std::vector<MapClass>& classes, Json& column) {
  for (Json& surface : column["surfaces"]) {
    const auto id = surface["class"].get<std::uint16_t>();
    surface["class_name"] = id == 0 ? Json() : Json(ClassOf(classes, id).name);
  }
}

// JSON: a line for each place. Text: one table of all surfaces; places without any have no row.
void Print(const std::vector<SurfaceColumn>& columns,
           const std::vector<MapClass>& classes,
           const std::optional<LocalFrame>& earth,
           Output& output) {
  Json rows = Json::array();
  for (const SurfaceColumn& column : columns) {
    Json json = ToJson(column);
    NameClasses(classes, json);
    if (earth.has_value()) {
      for (Json& surface : json["surfaces"]) {
        AddPlaceOnEarth(*earth, {column.x_m, column.y_m, surface["z"].get<double>()}, surface);
      }
    }
    if (output.json()) {
      output.JsonLine(json);
      continue;
    }
    for (Json& surface : json["surfaces"]) {
      surface["x"] = column.x_m;
      surface["y"] = column.y_m;
      rows.push_back(std::move(surface));
    }
  }
  if (output.json()) {
    return;
  }
  std::vector<Column> shown = {{"x", "X"},
                               {"y", "Y"},
                               {"level", "LEVEL"},
                               {"z", "Z"},
                               {"sigma_m", "SIGMA"},
                               {"depth_m", "DEPTH"},
                               {"traversability", "TRAVERSABILITY"},
                               {"class_name", "CLASS"},
                               {"confidence", "CONFIDENCE"},
                               {"cost", "COST"}};
  if (earth.has_value()) {
    shown.insert(shown.end(),
                 {{"latitude", "LATITUDE"}, {"longitude", "LONGITUDE"}, {"altitude", "ALTITUDE"}});
  }
  output.List(rows, shown);
}

absl::Status Run(Context& context, const SurfaceOptions& options) {
  std::vector<Eigen::Vector2d> places = options.at;
  if (!options.points_file.empty()) {
    STRATA_ASSIGN_OR_RETURN(const auto rows, ReadNumberFile(options.points_file, 2, 3));
    for (const std::vector<double>& row : rows) {
      places.emplace_back(row[0], row[1]);
    }
  }
  STRATA_ASSIGN_OR_RETURN(
      const std::vector<SurfaceColumn> columns,
      context.database.planning().SampleSurfaces(context.call, options.map, places));
  STRATA_ASSIGN_OR_RETURN(const std::vector<MapClass> classes,
                          context.database.maps().ListClasses(context.call, options.map));
  STRATA_ASSIGN_OR_RETURN(const std::optional<LocalFrame> earth, EarthOf(context, options.map));
  Print(columns, classes, earth, context.output);
  return absl::OkStatus();
}

}  // namespace

void AddSurfaceCommand(Commands& commands) {
  auto options = std::make_shared<SurfaceOptions>();
  CLI::App* verb = commands.Verb(
      &commands.root,
      "surface",
      "All surfaces at a place, lowest first: height, sigma, class, cost; where the map has an "
      "origin, with latitude, longitude and altitude",
      "strata surface campus --at -14.2,3.5",
      [options](Context& context) { return Run(context, *options); });
  AddMapName(verb, options->map);
  CLI::Option_group* where = verb->add_option_group("where");
  AddNumbers(
      where,
      "--at",
      "X,Y",
      2,
      2,
      [options](const std::vector<double>& n) {
        options->at = {{n[0], n[1]}};
      },
      "The place [m]");
  where
      ->add_option(
          "--points",
          options->points_file,
          "File with a place X,Y on each line; commas, semicolons or blanks, # for comments")
      ->type_name("FILE");
  where->require_option(1);
}

}  // namespace strata::cli
