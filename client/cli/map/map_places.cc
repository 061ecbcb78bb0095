// strata map places
#include <cstddef>
#include <memory>
#include <string>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

#include "client/cli/map/floor_files.h"
#include "client/cli/map/map_files.h"
#include "client/cli/picture/places_picture.h"
#include "client/cli/plan/driver_options.h"
#include "client/cli/terminal/arguments.h"
#include "client/cli/terminal/json.h"
#include "client/formats/file_bytes.h"
#include "core/common/status.h"

namespace strata::cli {
namespace {

struct PlacesOptions {
  std::string map;
  std::string out;
  FloorOptions floor;
};

Json PairOf(const Eigen::Vector2d& p) { return {p.x(), p.y()}; }

Json PlaceRows(const FloorPlaces& found) {
  Json rows = Json::array();
  for (std::size_t i = 0; i < found.places.size(); ++i) {
    const Place& place = found.places[i];
    rows.push_back({{"place", i},
                    {"kind", std::string(ToString(place.kind))},
                    {"area_m2", place.area_m2},
                    {"low", PairOf(place.low)},
                    {"high", PairOf(place.high)},
                    {"middle", PairOf(place.middle)},
                    {"neighbours", place.neighbours}});
  }
  return rows;
}

// Of the floor that the places are of.
absl::Status WritePicture(Context& context,
                          const PlacesOptions& options,
                          const PlaceQuery& query,
                          const FloorPlaces& found) {
  FloorQuery floors{
      .profile = query.profile, .cells = true, .floor = found.floor, .inferred = query.inferred};
  STRATA_ASSIGN_OR_RETURN(
      const FloorPlan plan,
      context.database.planning().ListFloors(context.call, options.map, floors));
  const auto number = static_cast<std::size_t>(*found.floor);
  if (number >= plan.floors.size()) {
    return absl::AbortedError(
        absl::StrCat("map ", options.map, " has changed meanwhile; call again"));
  }
  const picture::Image image = picture::DrawPlaces(found, plan.floors[number]);
  STRATA_ASSIGN_OR_RETURN(const std::string png, picture::PngBytes(image));
  return WriteFileBytes(options.out, png);
}

absl::Status Places(Context& context, const PlacesOptions& options) {
  PlaceQuery query{.profile = {},
                   .floor = options.floor.floor,
                   .at = options.floor.at,
                   .cells = !options.out.empty(),
                   .inferred = options.floor.inferred};
  DriverOptions driver;
  driver.profile = options.floor.profile;
  STRATA_ASSIGN_OR_RETURN(query.profile, ProfileOf(context, options.map, driver));
  STRATA_ASSIGN_OR_RETURN(const FloorPlaces found,
                          context.database.planning().ListPlaces(context.call, options.map, query));
  if (!options.out.empty()) {
    if (!found.floor.has_value()) {
      return absl::NotFoundError(
          absl::StrCat("map ", options.map, " has no floor for this robot; no picture is written"));
    }
    STRATA_RETURN_IF_ERROR(WritePicture(context, options, query, found));
  }
  const Json rows = PlaceRows(found);
  if (context.output.json()) {
    context.output.Object({{"places", rows},
                           {"floor", found.floor.has_value() ? Json(*found.floor) : Json()},
                           {"message", found.message},
                           {"file", options.out.empty() ? Json() : Json(options.out)},
                           {"epoch", found.epoch},
                           {"commit_sequence", found.commit_sequence}});
    return absl::OkStatus();
  }
  if (!found.message.empty()) context.output.Talk(found.message);
  if (found.places.empty() && context.output.text()) {
    context.output.Text("no place: this robot can stand nowhere on 10 m² or more");
    return absl::OkStatus();
  }
  context.output.List(rows,
                      {{"place", "PLACE"},
                       {"kind", "KIND"},
                       {"area_m2", "AREA"},
                       {"low", "LOW"},
                       {"high", "HIGH"},
                       {"neighbours", "NEIGHBOURS"}});
  if (found.floor.has_value()) {
    context.output.Text(absl::StrFormat("of floor %d", *found.floor));
  }
  return absl::OkStatus();
}

}  // namespace

void AddMapPlaces(Commands& commands, CLI::App* noun) {
  auto options = std::make_shared<PlacesOptions>();
  CLI::App* app = commands.Verb(
      noun,
      "places",
      "Rooms, corridors and doorways of a floor, and which of them touch; as a picture, too: rooms "
      "blue, corridors yellow, doorways red",
      "strata map places campus --at 3.2,-1.5,0.4 places.png",
      [options](Context& context) { return Places(context, *options); });
  AddMapName(app, options->map);
  app->add_option("OUT", options->out, "A PNG file to draw them to")->type_name("FILE.png");
  AddFloorOptions(app, options->floor, true);
  AddInferred(app, options->floor.inferred);
}

}  // namespace strata::cli
