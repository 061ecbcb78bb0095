// strata map create|list|show|delete|verify|rebuild|history|revert; backup, classes, diff, export,
// floors, georeference, merge, places, render and watch have files of their own.
#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/time/time.h"

#include "client/cli/job/job_runner.h"
#include "client/cli/map/map_files.h"
#include "client/cli/map/map_quality.h"
#include "client/cli/mesh/mesh_commands.h"
#include "client/cli/terminal/arguments.h"
#include "client/cli/terminal/command.h"
#include "client/cli/terminal/confirm.h"
#include "client/cli/terminal/json.h"
#include "client/cli/terminal/on_earth.h"
#include "client/cli/terminal/world_json.h"
#include "core/common/status.h"
#include "core/common/steady_time.h"
#include "core/common/stop.h"
#include "core/world/job_kinds.h"

namespace strata::cli {
namespace {

// What is in the maps of a list is counted for so long, and in so many: a server opens each for it.
constexpr absl::Duration kCounting = absl::Seconds(5);
constexpr std::size_t kCounted = 200;

struct MapOptions {
  std::string map;
  MapParameters parameters;
  ProfileOverrides profile;
  bool drop_points = false;
  std::uint64_t epoch = 0;
  bool wait = false;
  bool yes = false;
};

absl::Status Create(Context& context, MapOptions options) {
  options.parameters.keep_points = !options.drop_points;
  options.parameters.default_profile = options.profile.Over(options.parameters.default_profile);
  STRATA_ASSIGN_OR_RETURN(
      const MapInfo info,
      context.database.maps().Create(context.call, options.map, options.parameters));
  context.output.Object(ToJson(info));
  return absl::OkStatus();
}

// As people say it: three digits and a decimal unit.
std::string SizeText(std::uint64_t bytes) {
  double size = static_cast<double>(bytes);
  constexpr std::array<const char*, 5> kUnits = {"B", "kB", "MB", "GB", "TB"};
  std::size_t unit = 0;
  while (size >= 999.5 && unit + 1 < kUnits.size()) {
    size /= 1000.0;
    ++unit;
  }
  const int decimals = unit == 0 || size >= 99.95 ? 0 : 1;
  return absl::StrFormat("%.*f %s", decimals, size, kUnits[unit]);
}

// How much of a map there is; unknown where it is damaged, not to be read by who asks, or has more
// to do before it can be counted than there is time until `until`.
void AddCounts(Context& context, const std::string& map, absl::Time until, Json& row) {
  if (context.call.stop.requested()) return;
  api::Call call = context.call;
  call.stop = Stop(until);
  const absl::StatusOr<MapStats> stats = context.database.maps().Stats(call, map);
  if (!stats.ok()) return;
  row["scans"] = stats->scans;
  row["points"] = stats->points;
  row["bytes"] = stats->point_bytes + stats->tile_bytes;
  row["epoch"] = stats->epoch;
  if (context.output.text()) row["size"] = SizeText(stats->point_bytes + stats->tile_bytes);
}

absl::Status List(Context& context) {
  STRATA_ASSIGN_OR_RETURN(const std::vector<MapInfo> maps,
                          context.database.maps().List(context.call));
  const absl::Time until = SteadyNow() + kCounting;
  Json rows = Json::array();
  for (const MapInfo& map : maps) {
    Json row = ToJson(map);
    for (const char* key : {"scans", "points", "bytes", "epoch"}) row[key] = Json();
    if (rows.size() < kCounted) AddCounts(context, map.name, until, row);
    rows.push_back(std::move(row));
  }
  context.output.List(rows,
                      {{"name", "NAME"},
                       {"scans", "SCANS"},
                       {"points", "POINTS"},
                       {context.output.text() ? "size" : "bytes", "SIZE"},
                       {"epoch", "EPOCH"},
                       {"cell_size_m", "CELL SIZE"},
                       {"created", "CREATED"}});
  return absl::OkStatus();
}

absl::Status Show(Context& context, const MapOptions& options) {
  STRATA_ASSIGN_OR_RETURN(const MapInfo info,
                          context.database.maps().Get(context.call, options.map));
  STRATA_ASSIGN_OR_RETURN(const MapStats stats,
                          context.database.maps().Stats(context.call, options.map));
  Json json = ToJson(info, stats);
  const absl::StatusOr<MapQuality> quality = QualityOf(context.database, context.call, options.map);
  if (quality.ok()) {
    AddQuality(*quality, !context.output.text(), json);
  } else {
    context.output.Talk(absl::StrCat("its quality is unknown: ", quality.status().message()));
  }
  context.output.Object(json);
  return absl::OkStatus();
}

absl::Status Delete(Context& context, const MapOptions& options) {
  const absl::StatusOr<MapStats> stats =
      context.database.maps().Stats(context.call, options.map);  // fails where the map is damaged
  const std::string scans = stats.ok() ? absl::StrCat(" of ", stats->scans, " scans") : "";
  STRATA_RETURN_IF_ERROR(Confirm(
      options.yes, absl::StrCat("delete map ", options.map, scans, " and its file for good?")));
  STRATA_RETURN_IF_ERROR(context.database.maps().Delete(context.call, options.map));
  context.output.Object({{"deleted", options.map}});
  return absl::OkStatus();
}

absl::Status History(Context& context, const MapOptions& options) {
  STRATA_ASSIGN_OR_RETURN(const std::vector<EpochInfo> epochs,
                          context.database.maps().History(context.call, options.map));
  Json rows = Json::array();
  for (const EpochInfo& epoch : epochs) {
    rows.push_back(ToJson(epoch));
  }
  context.output.List(rows,
                      {{"epoch", "EPOCH"},
                       {"created", "CREATED"},
                       {"decided", "POSES"},
                       {"job", "JOB"},
                       {"current", "CURRENT"},
                       {"kept", "KEPT"},
                       {"reason", "REASON"}});
  return absl::OkStatus();
}

absl::Status Revert(Context& context, const MapOptions& options) {
  const std::map<std::string, std::string> parameters = {{"epoch", std::to_string(options.epoch)}};
  if (options.wait) return RunJob(context, options.map, kRevertJob, parameters);
  STRATA_ASSIGN_OR_RETURN(
      const JobInfo job,
      context.database.jobs().Start(context.call, options.map, kRevertJob, parameters));
  PrintJob(job, context.output);
  return absl::OkStatus();
}

void AddRevert(Commands& commands, CLI::App* noun, const std::shared_ptr<MapOptions>& options) {
  CLI::App* revert =
      commands.Verb(noun,
                    "revert",
                    "Bring back poses and constraints of an earlier epoch, as a new one",
                    "strata map revert campus 3 --wait",
                    [options](Context& context) { return Revert(context, *options); });
  AddMapName(revert, options->map);
  revert->add_option("EPOCH", options->epoch, "Number of the epoch; see map history")
      ->check(CLI::PositiveNumber)
      ->required();
  revert->add_flag("--wait", options->wait, "Return when it is done; exit 1 unless it succeeded");
}

void AddCreate(Commands& commands, CLI::App* noun, const std::shared_ptr<MapOptions>& options) {
  CLI::App* create =
      commands.Verb(noun,
                    "create",
                    "Create a map",
                    "strata map create campus --cell-size 0.1",
                    [options](Context& context) { return Create(context, *options); });
  create->parse_complete_callback([&commands] { commands.creates = true; });
  create->add_option("NAME", options->map, "Name of the map")->required();
  MapParameters& parameters = options->parameters;
  create->add_option("--cell-size", parameters.mls.cell_size_m, "Edge of a cell [m]")
      ->capture_default_str();
  create
      ->add_option(
          "--gap-size", parameters.mls.gap_size_m, "Heights closer than this are one surface [m]")
      ->capture_default_str();
  create->add_option("--thickness", parameters.mls.thickness_m, "Taller surfaces are vertical [m]")
      ->capture_default_str();
  create->add_option("--sigma", parameters.sensor.sigma_m, "Range noise of the sensor at 0 m [m]")
      ->capture_default_str();
  create
      ->add_option(
          "--sigma-per-metre", parameters.sensor.sigma_per_metre, "Growth of the noise with range")
      ->capture_default_str();
  create->add_option("--min-range", parameters.sensor.min_range_m, "Closer returns are ignored [m]")
      ->capture_default_str();
  create
      ->add_option("--max-range", parameters.sensor.max_range_m, "Farther returns are ignored [m]")
      ->capture_default_str();
  create->add_flag("--drop-points", options->drop_points, "Drop points once a scan is integrated");
  create
      ->add_option(
          "--fade-after",
          parameters.fade_after,
          "Let what has gone fade once so many later scans looked through where it was; 0: "
          "nothing fades")
      ->check(CLI::Range(0U, kMaxFadeAfter))
      ->capture_default_str();
  AddOrigin(
      create,
      options->parameters.origin,
      "Where the map's origin is on earth (WGS 84), as in 52.5,13.4,34 [degrees, degrees, m]; "
      "map georeference says it later");
  AddProfileOptions(create, options->profile);
}

}  // namespace

void AddMapCommands(Commands& commands) {
  auto options = std::make_shared<MapOptions>();
  CLI::App* noun = commands.Noun("map", "Whole worlds", "strata map show campus --output json");
  AddCreate(commands, noun, options);
  commands.Verb(noun, "list", "All maps", "strata map list", List);
  const auto verb = MapVerbs(commands, noun, options);
  verb("show",
       "Parameters, counts, content digest, and how well scans and loops agree",
       "strata map show campus --output json",
       Show);
  AddYes(verb("delete", "Delete a map and its file", "strata map delete campus", Delete),
         options->yes);
  verb(
      "verify",
      "Check every checksum, count and derived thing; exit 1 on a mismatch",
      "strata map verify campus",
      [](Context& context, const MapOptions& o) { return RunJob(context, o.map, kVerifyJob, {}); });
  verb("rebuild",
       "Make all derived data again from the scans",
       "strata map rebuild campus",
       [](Context& context, const MapOptions& o) {
         return RunJob(context, o.map, kRebuildJob, {});
       });
  verb("history",
       "The epochs of a map, newest first: what made them, and which can be brought back",
       "strata map history campus",
       History);
  AddRevert(commands, noun, options);
  AddMapBackup(commands, noun);
  AddMapClasses(commands, noun);
  AddMapWatch(commands, noun);
  AddMapDiff(commands, noun);
  AddMapExport(commands, noun);
  AddMapFloorplan(commands, noun);
  AddMapFloors(commands, noun);
  AddMapPlaces(commands, noun);
  AddMapGeoreference(commands, noun);
  AddMapMerge(commands, noun);
  AddMapMesh(commands, noun);
  AddMapRender(commands, noun);
}

}  // namespace strata::cli
