// strata map georeference
#include <cstddef>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/time/time.h"

#include "client/cli/map/map_files.h"
#include "client/cli/terminal/arguments.h"
#include "client/cli/terminal/on_earth.h"
#include "client/formats/motion/trajectory_file.h"
#include "core/common/status.h"
#include "core/egomotion/georeference.h"

namespace strata::cli {
namespace {

struct GeoreferenceOptions {
  std::string map;
  std::string run;
  std::optional<GeodeticOrigin> origin;
  Pose T_body_scan = Pose::Identity();
};

// Where the map and the run have the sensor, at every scan of the run's time that is integrated.
absl::StatusOr<std::vector<SeenTwice>> PlacesOf(Context& context,
                                                const GeoreferenceOptions& options,
                                                const Trajectory& run) {
  STRATA_ASSIGN_OR_RETURN(const api::PoseGraphState graph,
                          context.database.posegraph().Get(context.call, options.map));
  std::vector<SeenTwice> places;
  for (const PoseNode& node : graph.nodes) {
    if (node.state != ScanState::kIntegrated) continue;
    const auto pose = run.At(absl::ToDoubleSeconds(node.time - absl::UnixEpoch()));
    if (!pose.ok()) continue;
    places.push_back(
        {node.T_map_scan.translation(), pose->T_map_body * options.T_body_scan.translation()});
  }
  if (places.empty() && !graph.nodes.empty()) {
    return absl::FailedPreconditionError(
        absl::StrCat("no scan of map ",
                     options.map,
                     " was taken at a time that ",
                     options.run,
                     " has: are they of one drive, and do the scans have times?"));
  }
  return places;
}

absl::StatusOr<Georeference> Fit(Context& context, const GeoreferenceOptions& options) {
  STRATA_ASSIGN_OR_RETURN(const TrajectoryFile run, ReadTrajectory(options.run));
  if (!run.origin.has_value()) {
    return absl::InvalidArgumentError(
        absl::StrCat(options.run,
                     ": has no line '# origin LATITUDE LONGITUDE ALTITUDE': nobody says where on "
                     "earth it is"));
  }
  STRATA_ASSIGN_OR_RETURN(const std::vector<SeenTwice> places,
                          PlacesOf(context, options, run.trajectory));
  return FitOrigin(*run.origin, places);
}

absl::Status Run(Context& context, const GeoreferenceOptions& options) {
  STRATA_ASSIGN_OR_RETURN(const MapInfo before,
                          context.database.maps().Get(context.call, options.map));
  Json json = {{"map", options.map}};
  std::optional<GeodeticOrigin> origin = options.origin;
  if (!origin.has_value()) {
    STRATA_ASSIGN_OR_RETURN(const Georeference fit, Fit(context, options));
    origin = fit.origin;
    json["scans"] = fit.places;
    json["turn_deg"] = fit.turn_rad * 180.0 / std::numbers::pi;
    json["rms_m"] = fit.rms_m;
    json["height_rms_m"] = fit.height_rms_m;
  }
  STRATA_RETURN_IF_ERROR(context.database.maps().SetOrigin(context.call, options.map, *origin));
  json["origin"] = ToJson(*origin);
  if (before.parameters.origin.has_value()) json["was"] = ToJson(*before.parameters.origin);
  context.output.Object(json);
  return absl::OkStatus();
}

}  // namespace

void AddMapGeoreference(Commands& commands, CLI::App* noun) {
  auto options = std::make_shared<GeoreferenceOptions>();
  CLI::App* app = commands.Verb(
      noun,
      "georeference",
      "Say where on earth a map is: as told, or found from the trajectory of a drive with GPS (by "
      "strata egomotion) at the times of its scans. Latitude and longitude are then in surface, "
      "plan, pose export and exports of heights",
      "strata map georeference campus run.csv --sensor 0.2,0,1.1",
      [options](Context& context) { return Run(context, *options); });
  AddMapName(app, options->map);
  CLI::Option_group* where = app->add_option_group("where");
  where->add_option("RUN", options->run, "The trajectory of the drive")->type_name("run.csv");
  AddOrigin(
      where,
      options->origin,
      "Where the map's origin is on earth (WGS 84) [degrees, degrees, m], x pointing east and "
      "y north");
  where->require_option(1);
  AddPose(
      app,
      "--sensor",
      [options](const Pose& pose, std::size_t) { options->T_body_scan = pose; },
      "Where the sensor sits on the robot, as in scan import [m, degrees]");
}

}  // namespace strata::cli
