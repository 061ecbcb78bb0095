#include "client/cli/scan/scan_import.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"
#include "absl/time/clock.h"

#include "client/cli/scan/alignment_health.h"
#include "client/cli/scan/import_sources.h"
#include "client/cli/scan/scan_uploader.h"
#include "client/cli/scan/spool_commands.h"
#include "client/cli/terminal/arguments.h"
#include "client/cli/terminal/json.h"
#include "client/cli/terminal/patience.h"
#include "client/cli/terminal/progress.h"
#include "core/common/status.h"
#include "core/common/steady_time.h"

namespace strata::cli {
namespace {

constexpr int kWorkers = 4;

// What became of the files of one call.
struct Summary {
  std::size_t files = 0;
  std::vector<ScanId> present;  // in the map now: uploaded or there before
  std::size_t uploaded = 0;
  std::size_t skipped = 0;
  std::uint64_t points = 0;
  std::uint64_t at_sensor = 0;                   // returns of range 0, left out
  std::uint64_t deskewed = 0, not_deskewed = 0;  // scans whose points have times
  std::uint64_t local_map_bytes = 0;             // with --local-maps
  double seconds = 0.0;
  std::size_t integrated = 0, aligned = 0, integration_failed = 0;  // with --wait
  AlignmentHealth health;                                           // likewise
  std::optional<double> level_rad;                                  // with --level
  bool interrupted = false;                                         // by the user
  Json errors = Json::array();

  // Messages about files begin with their name, about scans with "scan ID".
  void AddError(const std::string& where, absl::string_view message) {
    absl::ConsumePrefix(&message, "scan ");
    absl::ConsumePrefix(&message, where + ": ");
    errors.push_back({{"scan", where}, {"error", std::string(message)}});
  }
};

void Upload(Context& context,
            const ImportOptions& options,
            const std::vector<UploadSource>& sources,
            Summary& summary) {
  Progress progress(context.output.talk(), TalksToTerminal(), "uploading");
  const absl::Time start = SteadyNow();
  const std::vector<UploadResult> results =
      UploadScans(context.database,
                  context.call,
                  options.map,
                  sources,
                  kWorkers,
                  [&](const UploadProgress& done) {
                    progress.Update(done.scans, sources.size(), done.points);
                  });
  progress.Clear();
  summary.seconds = absl::ToDoubleSeconds(SteadyNow() - start);
  summary.interrupted = context.call.stop.requested();
  for (std::size_t i = 0; i < sources.size(); ++i) {
    if (summary.interrupted && absl::IsCancelled(results[i].status)) {
      continue;  // not sent
    }
    if (!results[i].status.ok()) {
      summary.AddError(sources[i].file, results[i].status.message());
      continue;
    }
    ++summary.uploaded;
    summary.points += results[i].points;
    summary.local_map_bytes += results[i].local_map_bytes;
    summary.present.push_back(sources[i].header.id);
  }
}

// Where a scan that is not integrated for this long is said to be stuck.
constexpr absl::Duration kStuck = absl::Minutes(1);

// The scan once it is no longer pending. A server that is away may come back: it goes on by itself.
absl::StatusOr<ScanInfo> AwaitScan(Context& context,
                                   const std::string& map,
                                   const ScanId& id,
                                   const std::function<void()>& idle) {
  Patience patience;
  absl::Duration pause = absl::Milliseconds(10);
  while (true) {
    absl::StatusOr<ScanInfo> info = context.database.scans().Get(context.call, map, id);
    if (info.ok() && info->state != ScanState::kPending) return info;
    if (!patience.Has(info.status())) return info;
    STRATA_RETURN_IF_ERROR(context.call.stop.status());
    idle();
    absl::SleepFor(pause);
    pause = std::min(2 * pause, absl::Milliseconds(300));
  }
}

// Waits until no scan of the call is pending. They are integrated in order, so one after the other
// is asked for.
absl::Status Wait(Context& context, const ImportOptions& options, Summary& summary) {
  Progress progress(context.output.talk(), TalksToTerminal(), "integrating");
  std::sort(summary.present.begin(), summary.present.end());
  absl::Time moved = SteadyNow();
  for (std::size_t i = 0; i < summary.present.size(); ++i) {
    const auto idle = [&] {
      progress.Update(i, summary.present.size(), 0);
      if (SteadyNow() - moved < kStuck) return;
      progress.Clear();
      context.output.Talk(absl::StrCat("no scan integrated for ",
                                       absl::FormatDuration(kStuck),
                                       "; the log of stratad says why (is its disk full?)"));
      moved = SteadyNow();
    };
    STRATA_ASSIGN_OR_RETURN(const ScanInfo info,
                            AwaitScan(context, options.map, summary.present[i], idle));
    moved = SteadyNow();
    if (info.state == ScanState::kFailed) {
      ++summary.integration_failed;
      summary.AddError(summary.present[i].ToString(), info.message);
      continue;
    }
    ++summary.integrated;
    summary.aligned += info.alignment.aligned ? 1 : 0;
    summary.health.Add(info);
    if (!info.message.empty()) {
      progress.Clear();
      context.output.Talk(absl::StrCat(summary.present[i].ToString(), ": ", info.message));
    }
  }
  return absl::OkStatus();
}

void TalkOf(const Json& errors, Output& output) {
  for (const Json& error : errors) {
    output.Talk(absl::StrCat(
        "error: ", error["scan"].get<std::string>(), ": ", error["error"].get<std::string>()));
  }
}

constexpr absl::string_view kDoubtful =
    "the poses are probably those of other scans, or far off; see 'map render', and 'map delete' "
    "to begin again with other --poses";

void Print(const ImportOptions& options, const Summary& summary, Output& output) {
  Json json = {
      {"map", options.map},
      {"trajectory", options.trajectory},
      {"files", summary.files},
      {"uploaded", summary.uploaded},
      {"skipped", summary.skipped},
      {"failed", summary.errors.size()},
      {"points", summary.points},
      {"range_0", summary.at_sensor},
      {"deskewed", summary.deskewed},
      {"not_deskewed", summary.not_deskewed},
      {"seconds", summary.seconds},
      {"points_per_second",
       summary.seconds > 0.0 ? static_cast<double>(summary.points) / summary.seconds : 0.0}};
  if (options.as_local_maps) json["local_map_bytes"] = summary.local_map_bytes;
  if (options.wait) {
    json["integrated"] = summary.integrated;
    json["aligned"] = summary.aligned;
    json["integration_failed"] = summary.integration_failed;
    AddHealth(summary.health, output.json(), json);
  }
  if (summary.level_rad.has_value()) {
    json["level_rad"] = *summary.level_rad;
  }
  if (summary.interrupted) {
    json["interrupted"] = true;
  }
  json["errors"] = summary.errors;
  TalkOf(summary.errors, output);
  if (summary.health.Doubtful()) {
    output.Talk(absl::StrCat("warning: ", summary.health.Summary(), ": ", kDoubtful));
  }
  if (!output.json()) {
    json.erase("errors");
    for (const char* count : {"range_0", "deskewed", "not_deskewed"}) {
      if (json[count] == 0) json.erase(count);
    }
    if (summary.uploaded == 0 && summary.skipped > 0) {
      json = {{"map", options.map},
              {"trajectory", options.trajectory},
              {"already there", summary.skipped},
              {"failed", summary.errors.size()}};
      return output.Object(json);
    }
    json["seconds"] = absl::StrFormat("%.2f", summary.seconds);
    json["points_per_second"] = absl::StrFormat("%.0f", json["points_per_second"].get<double>());
  }
  output.Object(json);
}

// What of the files is clear before any of them is sent.
Summary Begun(const ImportSources& sources) {
  Summary summary;
  summary.files = sources.files;
  summary.skipped = sources.there.size();
  summary.present = sources.there;
  summary.level_rad = sources.level_rad;
  for (const auto& [file, message] : sources.errors) summary.AddError(file, message);
  return summary;
}

absl::Status ErrorsOf(const Json& errors, std::size_t files) {
  if (errors.empty()) return absl::OkStatus();
  return absl::UnknownError(absl::StrCat(errors.size(), " of ", files, " scans failed"));
}

void TalkOfMotion(const ReadCounts& counts, Output& output) {
  if (counts.not_deskewed() == 0) return;
  output.Talk(absl::StrCat("warning: ",
                           counts.not_deskewed(),
                           " scan(s) keep the distortion of their motion; the first: ",
                           counts.why_not()));
}

void TakeCounts(const ReadCounts& counts, Summary& summary, Output& output) {
  summary.at_sensor = counts.at_sensor;
  summary.deskewed = counts.deskewed;
  summary.not_deskewed = counts.not_deskewed();
  TalkOfMotion(counts, output);
}

absl::Status Import(Context& context, ImportOptions options) {
  if (options.trajectory.empty()) options.trajectory = TrajectoryOf(options.paths.front());
  STRATA_ASSIGN_OR_RETURN(ImportSources sources, FindImportSources(context, options));
  if (options.as_local_maps) {
    STRATA_ASSIGN_OR_RETURN(const MapInfo map,
                            context.database.maps().Get(context.call, options.map));
    for (UploadSource& source : sources.missing) source.as_local_map = map.parameters;
  }
  Summary summary = Begun(sources);
  Upload(context, options, sources.missing, summary);
  TakeCounts(*sources.counts, summary, context.output);
  const absl::Status waited =
      options.wait && !summary.interrupted ? Wait(context, options, summary) : absl::OkStatus();
  summary.interrupted = context.call.stop.requested();
  Print(options, summary, context.output);
  if (summary.interrupted) {
    return absl::CancelledError("interrupted; the same command goes on where this one stopped");
  }
  STRATA_RETURN_IF_ERROR(waited);
  return ErrorsOf(summary.errors, summary.files);
}

absl::Status ImportBySpool(FileContext& context, ImportOptions options) {
  if (options.trajectory.empty()) options.trajectory = TrajectoryOf(options.paths.front());
  STRATA_ASSIGN_OR_RETURN(const ImportSources sources, FindImportSources(context, options));
  Json json = {{"map", options.map},
               {"trajectory", options.trajectory},
               {"files", sources.files},
               {"errors", Begun(sources).errors}};
  STRATA_RETURN_IF_ERROR(
      ImportIntoSpool(context, options.spool, options.map, sources.missing, json));
  json["range_0"] = sources.counts->at_sensor.load();
  json["deskewed"] = sources.counts->deskewed.load();
  json["not_deskewed"] = sources.counts->not_deskewed();
  TalkOfMotion(*sources.counts, context.output);
  const Json errors = json["errors"];
  TalkOf(errors, context.output);
  if (!context.output.json()) json.erase("errors");
  context.output.Object(json);
  return ErrorsOf(errors, sources.files);
}

// Selects the one of the two ways that the options say.
void Select(Commands& commands, const std::shared_ptr<ImportOptions>& options) {
  if (!options->spool.empty()) {
    commands.selected_on_files = [options](FileContext& context) {
      return ImportBySpool(context, *options);
    };
    return;
  }
  commands.selected = [options](Context& context) { return Import(context, *options); };
}

void AddRecordingOptions(CLI::App* import, const std::shared_ptr<ImportOptions>& options) {
  import
      ->add_option(
          "--topic",
          options->topic,
          "Of a recording: the topic of sensor_msgs/PointCloud2; not needed where there is "
          "one only. 'strata scan topics' lists them")
      ->type_name("TOPIC");
  import
      ->add_option(
          "--poses-from",
          options->poses_from,
          "Of a recording: a topic of nav_msgs/Odometry, geometry_msgs/PoseStamped or "
          "geometry_msgs/PoseWithCovarianceStamped, or transforms as in 'tf:map->base_link'. "
          "The pose of a cloud is interpolated at its stamp")
      ->type_name("TOPIC|tf:A->B");
  import
      ->add_option(
          "--every",
          options->every,
          absl::StrCat("Of a recording: keep a cloud when it lies so far from the one kept "
                       "last, turned or later: m, deg, rad, s, with commas between; 0m: all "
                       "[",
                       kDefaultEvery,
                       "]"))
      ->type_name("DISTANCE");
  AddPose(
      import,
      "--mount",
      [options](const Pose& pose, std::size_t) { options->mount = pose; },
      "Of a recording without the transforms: where the sensor is on what the poses are those of "
      "[m, rad]");
}

}  // namespace

void AddScanImport(Commands& commands, CLI::App* noun) {
  auto options = std::make_shared<ImportOptions>();
  CLI::App* import = commands.Verb(
      noun,
      "import",
      "Upload files or folders of scans, a folder with a folder of scans, or the keyframes of a "
      "recording of ROS 1 or 2; what the trajectory already has is skipped",
      "strata scan import campus scans/ --poses poses.txt --trajectory segway --wait\n"
      "  strata scan import campus drive.mcap --topic /points --poses-from /odom --every 0.5m",
      [options](Context& context) { return Import(context, *options); });
  AddMapName(import, options->map);
  import
      ->add_option("PATH",
                   options->paths,
                   "Files or folders of scans; or one recording: .mcap, .db3, .bag, a folder of "
                   "rosbag2")
      ->required();
  AddRecordingOptions(import, options);
  import
      ->add_option(
          "--format",
          options->format,
          "Format of the scans; auto: by content or ending (.pcd .ply .bin .pcd.bin .vtk .3d .xyz "
          ".csv .asc .pts, .txt if named)")
      ->check(CLI::IsMember(
          {"auto", "3dtk", "pcd", "ply", "kitti", "nuscenes", "vtk", "xyz", "oakland"}))
      ->capture_default_str();
  import
      ->add_option(
          "--poses",
          options->poses,
          "File with the poses T_map_scan of the scans, or a folder of .pose files; without it "
          ".pose files beside .3d files, or the one poses*.txt|tum|csv in the folder; none: every "
          "scan is at the origin. A trajectory of strata egomotion gives each scan the pose of the "
          "time that its name is (1432235498.028276.pcd)")
      ->type_name("FILE|none");
  AddPose(
      import,
      "--sensor",
      [options](const Pose& pose, std::size_t) { options->T_body_scan = pose; },
      "Where the sensor sits on the robot, for poses of a trajectory [m, rad]");
  import
      ->add_option(
          "--pose-format",
          options->pose_format,
          "tum: time x y z qx qy qz qw; index-tum: index before that, the last number in a "
          "file's name; kitti: 12 numbers, line 0 for index 0; 3dtk: .pose files")
      ->check(CLI::IsMember({"auto", "tum", "index-tum", "kitti", "3dtk"}))
      ->capture_default_str();
  import->add_option("--trajectory",
                     options->trajectory,
                     "Its name; default: that of the folder or of the recording");
  import
      ->add_option(
          "--align", options->align, "on: register each scan to the map; off: take its pose")
      ->check(CLI::IsMember({"on", "off"}))
      ->capture_default_str();
  import
      ->add_option("--deskew",
                   options->deskew,
                   "on: where points have times (fields t, time, timestamp, offset_time, …) and "
                   "poses are known over time (a recording, or --poses with a trajectory), move "
                   "each to where it was at the scan's stamp; off: the clouds are without "
                   "distortion already")
      ->check(CLI::IsMember({"on", "off"}))
      ->capture_default_str();
  CLI::Option* classes =
      import
          ->add_option("--classes",
                       options->classes,
                       "Which labels of the files are which class of the map, to which new ones "
                       "are added; other labels are left out. Without it labels are ids of classes")
          ->type_name("'NAME=LABEL,…;…'|FILE");
  import->add_flag("--no-labels", options->without_labels, "Leave out what files say points are")
      ->excludes(classes);
  import->add_flag("--far", options->far, "Also scans more than 10 km from the map and each other");
  import->add_flag("--level", options->level, "Turn all poses so that the dominant floor is level");
  CLI::Option* wait =
      import->add_flag("--wait", options->wait, "Return when every scan is integrated or failed");
  CLI::Option* local_maps = import->add_flag(
      "--local-maps",
      options->as_local_maps,
      "Make the local maps here and send them in place of the points, of which there are fewer "
      "bytes; such scans have no points to export, label or classify");
  import
      ->add_option("--spool",
                   options->spool,
                   "Put the scans into this directory first, where they are safe until the server "
                   "has acknowledged them; done also when it is away: strata spool send goes on")
      ->type_name("DIR")
      ->excludes(classes)
      ->excludes(wait)
      ->excludes(local_maps);
  import->callback(std::bind(&Select, std::ref(commands), options));
}

}  // namespace strata::cli
