#include "client/cli/scan_import.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"
#include "absl/time/clock.h"

#include "client/cli/arguments.h"
#include "client/cli/json.h"
#include "client/cli/label_classes.h"
#include "client/cli/level_trajectory.h"
#include "client/cli/patience.h"
#include "client/cli/progress.h"
#include "client/cli/scan_uploader.h"
#include "client/cli/spool_commands.h"
#include "client/formats/scan_list.h"
#include "client/formats/scan_reader.h"
#include "core/common/status.h"
#include "core/world/map_class.h"

namespace strata::cli {
namespace {

constexpr int kWorkers = 4;

struct ImportOptions {
  std::string map;
  std::vector<std::string> paths;
  std::string format = "auto";
  std::string poses;
  std::string pose_format = "auto";
  std::string trajectory;
  std::string align = "on";
  std::string classes;  // as ReadLabelClasses(); empty: labels are ids of the map's classes
  bool without_labels = false;
  bool level = false;
  bool wait = false;
  std::string spool;  // a directory, if scans go there first
  bool as_local_maps = false;
};

// What became of the files of one call.
struct Summary {
  std::size_t files = 0;
  std::vector<ScanId> present;  // in the map now: uploaded or there before
  std::size_t uploaded = 0;
  std::size_t skipped = 0;
  std::uint64_t points = 0;
  std::uint64_t local_map_bytes = 0;  // with --local-maps
  double seconds = 0.0;
  std::size_t integrated = 0, aligned = 0, integration_failed = 0;  // with --wait
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

// The folder's name, or that of the folder around one that is only called "scans", in the letters
// that names may have.
std::string TrajectoryOf(const std::string& path) {
  std::filesystem::path folder = std::filesystem::absolute(path).lexically_normal();
  if (!folder.has_filename()) {
    folder = folder.parent_path();
  }
  if (!std::filesystem::is_directory(folder)) {
    folder = folder.parent_path();
  }
  if (folder.filename() == "scans") {
    folder = folder.parent_path();
  }
  std::string name;
  for (const char c : folder.filename().string()) {
    const bool allowed = absl::ascii_isalnum(static_cast<unsigned char>(c)) || c == '_' ||
                         (!name.empty() && (c == '-' || c == '.'));
    name += allowed ? c : '_';
  }
  return name.empty() ? "scans" : name.substr(0, 100);
}

absl::StatusOr<std::vector<ScanSource>> FindScans(const ImportOptions& options, Output& output) {
  ScanListOptions list;
  list.warn = [&output](const std::string& warning) { output.Talk("warning: " + warning); };
  STRATA_ASSIGN_OR_RETURN(list.format, ParseScanFormat(options.format));
  STRATA_ASSIGN_OR_RETURN(list.pose_format, ParsePoseFormat(options.pose_format));
  list.poses = options.poses;
  return ListScans({options.paths.begin(), options.paths.end()}, list);
}

// What the trajectory has, by sequence.
using ScansThere = std::map<std::uint64_t, ScanHeader>;

absl::StatusOr<ScansThere> FindScansThere(Context& context, const ImportOptions& options) {
  ScansThere there;
  api::ScanFilter filter;
  filter.trajectory = options.trajectory;
  STRATA_RETURN_IF_ERROR(
      context.database.scans().List(context.call, options.map, filter, [&](const ScanInfo& info) {
        there.emplace(info.header.id.sequence, info.header);
        return absl::OkStatus();
      }));
  return there;
}

// Whether the file cannot be what is there, as far as its time and pose tell.
bool Differs(const ScanSource& scan, const ScanHeader& there) {
  constexpr double kRounding = 1e-6;
  return absl::ToUnixMicros(scan.time.value_or(absl::UnixEpoch())) !=
             absl::ToUnixMicros(there.time) ||
         (scan.pose_status.ok() && !scan.T_map_scan.isApprox(there.T_map_scan, kRounding));
}

// Scans without poses and times are told apart by the points of the first one.
bool HasOtherPoints(const ScanSource& scan, const ScanHeader& there) {
  const absl::StatusOr<PointCloud> cloud = ReadScan(scan.path, scan.format);
  return cloud.ok() && cloud->size() != there.point_count;
}

// Folders of the same name have the same trajectory unless it is given: what is skipped then is
// not what the map has.
void WarnOfOtherScans(const std::vector<ScanSource>& scans,
                      const ScansThere& there,
                      const ImportOptions& options,
                      Output& output) {
  std::size_t skipped = 0;
  std::size_t other = 0;
  for (const ScanSource& scan : scans) {
    const auto it = there.find(scan.sequence);
    if (it == there.end()) continue;
    const bool first = skipped++ == 0;
    if (Differs(scan, it->second) || (first && HasOtherPoints(scan, it->second))) ++other;
  }
  if (other == 0) return;
  output.Talk(absl::StrCat("warning: trajectory ",
                           options.trajectory,
                           " has other scans under these numbers (",
                           other,
                           " of ",
                           skipped,
                           " skipped files differ in time, pose or points); --trajectory NAME "
                           "uploads these as a run of their own"));
}

// What labels of files become in a map.
using LabelsToMap = std::function<absl::Status(PointCloud&)>;

// Without --classes.
LabelsToMap PlainLabels(const ImportOptions& options) {
  if (options.without_labels) {
    return [](PointCloud& cloud) {
      cloud.label.clear();
      return absl::OkStatus();
    };
  }
  return [](PointCloud& cloud) {
    const absl::Status valid = ValidateLabels(cloud.label);
    if (valid.ok()) return valid;
    return absl::InvalidArgumentError(absl::StrCat(
        valid.message(),
        "; say with --classes which labels are which class, or leave them out with --no-labels"));
  };
}

absl::StatusOr<LabelsToMap> LabelsFor(Context& context, const ImportOptions& options) {
  if (options.without_labels || options.classes.empty()) return PlainLabels(options);
  STRATA_ASSIGN_OR_RETURN(const LabelClasses given, ReadLabelClasses(options.classes));
  STRATA_ASSIGN_OR_RETURN(
      const LabelClasses labels,
      ForClassesOfMap(context.database.maps(), context.call, options.map, given));
  return [labels](PointCloud& cloud) {
    labels.Apply(cloud);
    return absl::OkStatus();
  };
}

absl::StatusOr<PointCloud> ReadForMap(const ScanSource& scan, const LabelsToMap& labels) {
  STRATA_ASSIGN_OR_RETURN(PointCloud cloud, ReadScan(scan.path, scan.format));
  STRATA_RETURN_IF_ERROR(labels(cloud));
  return cloud;
}

// Those scans that have a pose and are not there yet.
std::vector<UploadSource> SourcesOf(const std::vector<ScanSource>& scans,
                                    const ScansThere& there,
                                    const ImportOptions& options,
                                    const LabelsToMap& labels,
                                    Summary& summary) {
  std::vector<UploadSource> sources;
  for (const ScanSource& scan : scans) {
    const ScanId id = {options.trajectory, scan.sequence};
    if (there.count(scan.sequence) > 0) {
      ++summary.skipped;
      summary.present.push_back(id);
      continue;
    }
    if (!scan.pose_status.ok()) {
      summary.AddError(scan.path.string(), scan.pose_status.message());
      continue;
    }
    UploadSource source;
    source.file = scan.path.string();
    source.header.id = id;
    source.header.time = scan.time.value_or(absl::UnixEpoch());
    source.header.T_map_scan = scan.T_map_scan;
    source.header.alignment = options.align == "on" ? Alignment::kOn : Alignment::kOff;
    source.read = [scan, labels] { return ReadForMap(scan, labels); };
    sources.push_back(std::move(source));
  }
  return sources;
}

void Upload(Context& context,
            const ImportOptions& options,
            const std::vector<UploadSource>& sources,
            Summary& summary) {
  Progress progress(context.output.talk(), TalksToTerminal(), "uploading");
  const absl::Time start = absl::Now();
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
  summary.seconds = absl::ToDoubleSeconds(absl::Now() - start);
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
  absl::Time moved = absl::Now();
  for (std::size_t i = 0; i < summary.present.size(); ++i) {
    const auto idle = [&] {
      progress.Update(i, summary.present.size(), 0);
      if (absl::Now() - moved < kStuck) return;
      progress.Clear();
      context.output.Talk(absl::StrCat("no scan integrated for ",
                                       absl::FormatDuration(kStuck),
                                       "; the log of stratad says why (is its disk full?)"));
      moved = absl::Now();
    };
    STRATA_ASSIGN_OR_RETURN(const ScanInfo info,
                            AwaitScan(context, options.map, summary.present[i], idle));
    moved = absl::Now();
    if (info.state == ScanState::kFailed) {
      ++summary.integration_failed;
      summary.AddError(summary.present[i].ToString(), info.message);
      continue;
    }
    ++summary.integrated;
    summary.aligned += info.alignment.aligned ? 1 : 0;
    if (!info.message.empty()) {
      progress.Clear();
      context.output.Talk(absl::StrCat(summary.present[i].ToString(), ": ", info.message));
    }
  }
  return absl::OkStatus();
}

void Print(const ImportOptions& options, const Summary& summary, Output& output) {
  Json json = {
      {"map", options.map},
      {"trajectory", options.trajectory},
      {"files", summary.files},
      {"uploaded", summary.uploaded},
      {"skipped", summary.skipped},
      {"failed", summary.errors.size()},
      {"points", summary.points},
      {"seconds", summary.seconds},
      {"points_per_second",
       summary.seconds > 0.0 ? static_cast<double>(summary.points) / summary.seconds : 0.0}};
  if (options.as_local_maps) json["local_map_bytes"] = summary.local_map_bytes;
  if (options.wait) {
    json["integrated"] = summary.integrated;
    json["aligned"] = summary.aligned;
    json["integration_failed"] = summary.integration_failed;
  }
  if (summary.level_rad.has_value()) {
    json["level_rad"] = *summary.level_rad;
  }
  if (summary.interrupted) {
    json["interrupted"] = true;
  }
  json["errors"] = summary.errors;
  for (const Json& error : summary.errors) {
    output.Talk(absl::StrCat(
        "error: ", error["scan"].get<std::string>(), ": ", error["error"].get<std::string>()));
  }
  if (!output.json()) {
    json.erase("errors");
    json["seconds"] = absl::StrFormat("%.2f", summary.seconds);
    json["points_per_second"] = absl::StrFormat("%.0f", json["points_per_second"].get<double>());
  }
  output.Object(json);
}

absl::Status Import(Context& context, ImportOptions options) {
  if (options.trajectory.empty()) {
    options.trajectory = TrajectoryOf(options.paths.front());
  }
  STRATA_ASSIGN_OR_RETURN(std::vector<ScanSource> scans, FindScans(options, context.output));
  STRATA_ASSIGN_OR_RETURN(const ScansThere there, FindScansThere(context, options));
  STRATA_ASSIGN_OR_RETURN(const LabelsToMap labels, LabelsFor(context, options));
  Summary summary;
  if (options.level) {
    STRATA_ASSIGN_OR_RETURN(summary.level_rad, LevelTrajectory(scans));
    context.output.Talk(absl::StrFormat("levelled by %.4f rad", *summary.level_rad));
  }
  WarnOfOtherScans(scans, there, options, context.output);
  summary.files = scans.size();
  std::vector<UploadSource> sources = SourcesOf(scans, there, options, labels, summary);
  if (options.as_local_maps) {
    STRATA_ASSIGN_OR_RETURN(const MapInfo map,
                            context.database.maps().Get(context.call, options.map));
    for (UploadSource& source : sources) source.as_local_map = map.parameters;
  }
  Upload(context, options, sources, summary);
  const absl::Status waited =
      options.wait && !summary.interrupted ? Wait(context, options, summary) : absl::OkStatus();
  summary.interrupted = context.call.stop.requested();
  Print(options, summary, context.output);
  if (summary.interrupted) {
    return absl::CancelledError("interrupted; the same command goes on where this one stopped");
  }
  STRATA_RETURN_IF_ERROR(waited);
  if (!summary.errors.empty()) {
    return absl::UnknownError(
        absl::StrCat(summary.errors.size(), " of ", summary.files, " scans failed"));
  }
  return absl::OkStatus();
}

absl::Status ImportBySpool(FileContext& context, ImportOptions options) {
  if (options.trajectory.empty()) {
    options.trajectory = TrajectoryOf(options.paths.front());
  }
  STRATA_ASSIGN_OR_RETURN(std::vector<ScanSource> scans, FindScans(options, context.output));
  Summary summary;
  if (options.level) {
    STRATA_ASSIGN_OR_RETURN(summary.level_rad, LevelTrajectory(scans));
    context.output.Talk(absl::StrFormat("levelled by %.4f rad", *summary.level_rad));
  }
  const std::vector<UploadSource> sources =
      SourcesOf(scans, {}, options, PlainLabels(options), summary);
  Json json = {{"map", options.map},
               {"trajectory", options.trajectory},
               {"files", scans.size()},
               {"errors", summary.errors}};
  STRATA_RETURN_IF_ERROR(ImportIntoSpool(context, options.spool, options.map, sources, json));
  const Json errors = json["errors"];
  for (const Json& error : errors) {
    context.output.Talk(absl::StrCat(
        "error: ", error["scan"].get<std::string>(), ": ", error["error"].get<std::string>()));
  }
  if (!context.output.json()) json.erase("errors");
  context.output.Object(json);
  if (errors.empty()) return absl::OkStatus();
  return absl::UnknownError(absl::StrCat(errors.size(), " of ", scans.size(), " scans failed"));
}

// Of the two ways the one that the options say.
void Select(Commands& commands, const std::shared_ptr<ImportOptions>& options) {
  if (!options->spool.empty()) {
    commands.selected_on_files = [options](FileContext& context) {
      return ImportBySpool(context, *options);
    };
    return;
  }
  commands.selected = [options](Context& context) { return Import(context, *options); };
}

}  // namespace

void AddScanImport(Commands& commands, CLI::App* noun) {
  auto options = std::make_shared<ImportOptions>();
  CLI::App* import =
      commands.Verb(noun,
                    "import",
                    "Upload files or folders of scans; what the trajectory already has is skipped",
                    "strata scan import campus scans/ --poses poses.txt --trajectory segway --wait",
                    [options](Context& context) { return Import(context, *options); });
  AddMapName(import, options->map);
  import->add_option("PATH", options->paths, "Files or folders of scans")->required();
  import
      ->add_option(
          "--format",
          options->format,
          "Format of the scans; auto: by content or ending (.pcd .ply .bin .vtk .3d .xyz .csv "
          ".asc .pts, .txt if named)")
      ->check(CLI::IsMember({"auto", "3dtk", "pcd", "ply", "kitti", "vtk", "xyz", "oakland"}))
      ->capture_default_str();
  import
      ->add_option(
          "--poses",
          options->poses,
          "File with the poses T_map_scan of the scans, or a folder of .pose files; without "
          "it .pose files beside .3d files, else every scan is at the origin")
      ->type_name("FILE");
  import
      ->add_option(
          "--pose-format",
          options->pose_format,
          "tum: time x y z qx qy qz qw; index-tum: index before that, the last number in a "
          "file's name; kitti: 12 numbers, line 0 for index 0; 3dtk: .pose files")
      ->check(CLI::IsMember({"auto", "tum", "index-tum", "kitti", "3dtk"}))
      ->capture_default_str();
  import->add_option("--trajectory", options->trajectory, "Its name; default: that of the folder");
  import
      ->add_option(
          "--align", options->align, "on: register each scan to the map; off: take its pose")
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
