// strata pose list|export|set|lookup
#include <algorithm>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_replace.h"

#include "client/cli/terminal/arguments.h"
#include "client/cli/terminal/command.h"
#include "client/cli/terminal/json.h"
#include "client/cli/terminal/on_earth.h"
#include "client/cli/terminal/world_json.h"
#include "client/formats/file_bytes.h"
#include "client/formats/foxglove/foxglove_file.h"
#include "client/formats/pose_writer.h"
#include "core/common/status.h"

namespace strata::cli {
namespace {

struct PoseOptions {
  std::string map;
  std::string trajectory;
  std::string format = "tum";
  std::string which = "current";
  std::string out;
  ScanId id;
  Pose T_map_scan = Pose::Identity();
};

absl::StatusOr<std::vector<PoseNode>> Nodes(Context& context, const PoseOptions& options) {
  STRATA_ASSIGN_OR_RETURN(api::PoseGraphState state,
                          context.database.posegraph().Get(context.call, options.map));
  if (!options.trajectory.empty()) {
    std::erase_if(state.nodes,
                  [&](const PoseNode& node) { return node.id.trajectory != options.trajectory; });
  }
  return std::move(state.nodes);
}

absl::Status List(Context& context, const PoseOptions& options) {
  STRATA_ASSIGN_OR_RETURN(const std::vector<PoseNode> nodes, Nodes(context, options));
  Json rows = Json::array();
  for (const PoseNode& node : nodes) {
    rows.push_back(ToJson(node));
  }
  context.output.List(rows,
                      {{"id", "ID"},
                       {"state", "STATE"},
                       {"time_s", "TIME"},
                       {"correction_m", "CORRECTION"},
                       {"correction_rad", "TURN"},
                       {"pose", "X, Y, Z, QX, QY, QZ, QW"}});
  return absl::OkStatus();
}

const Pose& PoseOf(const PoseNode& node, const PoseOptions& options) {
  return options.which == "current" ? node.T_map_scan : node.T_map_scan_uploaded;
}

absl::Status Told(Context& context, const PoseOptions& options, std::size_t poses) {
  context.output.Object({{"file", options.out}, {"which", options.which}, {"poses", poses}});
  return absl::OkStatus();
}

// Where the map has an origin with the sensor's place on earth.
absl::Status WriteCsv(Context& context,
                      const PoseOptions& options,
                      const std::vector<PoseNode>& nodes) {
  STRATA_ASSIGN_OR_RETURN(const std::optional<LocalFrame> earth, EarthOf(context, options.map));
  std::string text = "id,time,x,y,z,qx,qy,qz,qw";
  if (earth.has_value()) text += ",latitude,longitude,altitude";
  text += '\n';
  for (const PoseNode& node : nodes) {
    const TimedPose pose = {node.time, PoseOf(node, options)};
    std::string line = TumText({&pose, 1});
    absl::StripTrailingAsciiWhitespace(&line);
    absl::StrAppend(&text, node.id.ToString(), ",", absl::StrReplaceAll(line, {{" ", ","}}));
    if (earth.has_value()) {
      const Json place = PlaceOnEarth(*earth, pose.T_map_scan.translation());
      absl::StrAppendFormat(&text,
                            ",%.9f,%.9f,%.4f",
                            place[0].get<double>(),
                            place[1].get<double>(),
                            place[2].get<double>());
    }
    text += '\n';
  }
  return WriteFileBytes(options.out, text);
}

absl::Status Export(Context& context, const PoseOptions& options) {
  STRATA_ASSIGN_OR_RETURN(std::vector<PoseNode> nodes, Nodes(context, options));
  std::sort(nodes.begin(), nodes.end(), [](const PoseNode& a, const PoseNode& b) {
    return std::tie(a.time, a.id) < std::tie(b.time, b.id);
  });
  if (options.format == "csv") {
    STRATA_RETURN_IF_ERROR(WriteCsv(context, options, nodes));
    return Told(context, options, nodes.size());
  }
  if (options.format == "mcap") {
    FoxgloveScene scene;
    scene.trajectories = TrajectoriesOf(nodes, options.which == "uploaded");
    STRATA_ASSIGN_OR_RETURN(const std::string bytes, FoxgloveBytes(scene));
    STRATA_RETURN_IF_ERROR(WriteFileBytes(options.out, bytes));
    return Told(context, options, nodes.size());
  }
  std::vector<TimedPose> poses;
  poses.reserve(nodes.size());
  for (const PoseNode& node : nodes) {
    poses.push_back({node.time, PoseOf(node, options)});
  }
  STRATA_RETURN_IF_ERROR(WriteFileBytes(options.out, TumText(poses)));
  return Told(context, options, nodes.size());
}

absl::Status Set(Context& context, const PoseOptions& options) {
  STRATA_RETURN_IF_ERROR(context.database.posegraph().SetPose(
      context.call, options.map, options.id, options.T_map_scan));
  context.output.Object({{"id", options.id.ToString()}, {"pose", ToJson(options.T_map_scan)}});
  return absl::OkStatus();
}

absl::Status Lookup(Context& context, const PoseOptions& options) {
  STRATA_ASSIGN_OR_RETURN(
      const api::PoseLookup lookup,
      context.database.posegraph().LookupPose(context.call, options.map, options.id));
  Json json = {{"id", options.id.ToString()}};
  json.update(ToJson(lookup));
  context.output.Object(json);
  return absl::OkStatus();
}

void AddExport(Commands& commands, CLI::App* noun, const std::shared_ptr<PoseOptions>& options) {
  CLI::App* app =
      commands.Verb(noun,
                    "export",
                    "Write poses of the scans in the map, by time",
                    "strata pose export campus --format tum --which current --out poses.txt",
                    [options](Context& context) { return Export(context, *options); });
  AddMapName(app, options->map);
  app->add_option(
         "--format",
         options->format,
         "tum: a line 'time x y z qx qy qz qw' for each scan, T_map_scan, seconds and metres; csv: "
         "with names, the scans' ids and, where the map has an origin, latitude, longitude "
         "[degrees] and altitude [m]; mcap: for Foxglove, /tf at the scans' times and "
         "/trajectories/NAME")
      ->check(CLI::IsMember({"tum", "csv", "mcap"}))
      ->capture_default_str();
  app->add_option("--which", options->which, "uploaded, or those of the current epoch")
      ->check(CLI::IsMember({"uploaded", "current"}))
      ->capture_default_str();
  app->add_option("--trajectory", options->trajectory, "Only this trajectory");
  app->add_option("--out", options->out, "The file to write")->type_name("FILE")->required();
}

}  // namespace

void AddPoseCommands(Commands& commands) {
  auto options = std::make_shared<PoseOptions>();
  CLI::App* noun = commands.Noun(
      "pose", "Where scans are in the map", "strata pose export campus --out poses.txt");
  CLI::App* list = commands.Verb(noun,
                                 "list",
                                 "Poses of all scans and how far they are from the uploaded ones",
                                 "strata pose list campus --trajectory segway",
                                 [options](Context& context) { return List(context, *options); });
  AddMapName(list, options->map);
  list->add_option("--trajectory", options->trajectory, "Only this trajectory");
  AddExport(commands, noun, options);
  CLI::App* set = commands.Verb(noun,
                                "set",
                                "Move a scan by hand",
                                "strata pose set campus segway/12 --pose 3.5,-1,0,0,0,0,1",
                                [options](Context& context) { return Set(context, *options); });
  AddMapName(set, options->map);
  AddScanId(set, options->id);
  AddPose(
      set,
      "--pose",
      [options](const Pose& pose, std::size_t) { options->T_map_scan = pose; },
      "Where the scan's frame is in the map [m, degrees]; X,Y,Z keeps the axes of the map")
      ->required();
  CLI::App* lookup =
      commands.Verb(noun,
                    "lookup",
                    "Where a scan is now, or why that is not known yet",
                    "strata pose lookup campus segway/12",
                    [options](Context& context) { return Lookup(context, *options); });
  AddMapName(lookup, options->map);
  AddScanId(lookup, options->id);
}

}  // namespace strata::cli
