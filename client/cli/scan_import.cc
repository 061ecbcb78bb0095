#include "client/cli/scan_import.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/time/clock.h"

#include "client/cli/arguments.h"
#include "client/cli/json.h"
#include "client/cli/level_trajectory.h"
#include "client/cli/progress.h"
#include "client/cli/scan_uploader.h"
#include "client/formats/scan_list.h"
#include "client/formats/scan_reader.h"
#include "core/common/status.h"

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
  bool level = false;
  bool wait = false;
};

// What became of the files of one call.
struct Summary {
  std::size_t files = 0;
  std::vector<ScanId> present;  // in the map now: uploaded or there before
  std::size_t uploaded = 0;
  std::size_t skipped = 0;
  std::uint64_t points = 0;
  double seconds = 0.0;
  std::size_t integrated = 0, aligned = 0, integration_failed = 0;  // with --wait
  Json errors = Json::array();

  void AddError(const std::string& where, const std::string& message) {
    errors.push_back({{"scan", where}, {"error", message}});
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

absl::StatusOr<std::vector<ScanSource>> FindScans(const ImportOptions& options) {
  ScanListOptions list;
  STRATA_ASSIGN_OR_RETURN(list.format, ParseScanFormat(options.format));
  STRATA_ASSIGN_OR_RETURN(list.pose_format, ParsePoseFormat(options.pose_format));
  list.poses = options.poses;
  return ListScans({options.paths.begin(), options.paths.end()}, list);
}

absl::StatusOr<std::set<std::uint64_t>> SequencesThere(Context& context,
                                                       const ImportOptions& options) {
  std::set<std::uint64_t> sequences;
  api::ScanFilter filter;
  filter.trajectory = options.trajectory;
  STRATA_RETURN_IF_ERROR(
      context.database.scans().List(context.call, options.map, filter, [&](const ScanInfo& info) {
        sequences.insert(info.header.id.sequence);
        return absl::OkStatus();
      }));
  return sequences;
}

// Those scans that have a pose and are not there yet.
std::vector<UploadSource> SourcesOf(const std::vector<ScanSource>& scans,
                                    const std::set<std::uint64_t>& there,
                                    const ImportOptions& options,
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
      summary.AddError(scan.path.string(), std::string(scan.pose_status.message()));
      continue;
    }
    UploadSource source;
    source.file = scan.path.string();
    source.header.id = id;
    source.header.time = scan.time.value_or(absl::UnixEpoch());
    source.header.T_map_scan = scan.T_map_scan;
    source.header.alignment = options.align == "on" ? Alignment::kOn : Alignment::kOff;
    source.read = [path = scan.path, format = scan.format] { return ReadScan(path, format); };
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
  for (std::size_t i = 0; i < sources.size(); ++i) {
    if (!results[i].status.ok()) {
      summary.AddError(sources[i].file, std::string(results[i].status.message()));
      continue;
    }
    ++summary.uploaded;
    summary.points += results[i].points;
    summary.present.push_back(sources[i].header.id);
  }
}

// A server that is away may be starting again, as while uploading (scan_uploader.h).
absl::StatusOr<ScanInfo> GetPatiently(Context& context, const std::string& map, const ScanId& id) {
  constexpr absl::Duration kPatience = absl::Minutes(1);
  const absl::Time since = absl::Now();
  while (true) {
    absl::StatusOr<ScanInfo> info = context.database.scans().Get(context.call, map, id);
    if (!absl::IsUnavailable(info.status()) || absl::Now() - since > kPatience) return info;
    STRATA_RETURN_IF_ERROR(context.call.stop.status());
    absl::SleepFor(absl::Milliseconds(100));
  }
}

// Waits until no scan of the call is pending. They are integrated in order, so one after the other
// is asked for.
absl::Status Wait(Context& context, const ImportOptions& options, Summary& summary) {
  Progress progress(context.output.talk(), TalksToTerminal(), "integrating");
  std::sort(summary.present.begin(), summary.present.end());
  for (std::size_t i = 0; i < summary.present.size(); ++i) {
    absl::Duration pause = absl::Milliseconds(10);
    while (true) {
      STRATA_ASSIGN_OR_RETURN(const ScanInfo info,
                              GetPatiently(context, options.map, summary.present[i]));
      if (info.state == ScanState::kIntegrated) {
        ++summary.integrated;
        summary.aligned += info.alignment.aligned ? 1 : 0;
        if (!info.message.empty()) {
          progress.Clear();
          context.output.Talk(absl::StrCat(summary.present[i].ToString(), ": ", info.message));
        }
        break;
      }
      if (info.state == ScanState::kFailed) {
        ++summary.integration_failed;
        summary.AddError(summary.present[i].ToString(), info.message);
        break;
      }
      STRATA_RETURN_IF_ERROR(context.call.stop.status());
      absl::SleepFor(pause);
      pause = std::min(2 * pause, absl::Milliseconds(300));
      progress.Update(i, summary.present.size(), 0);
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
  if (options.wait) {
    json["integrated"] = summary.integrated;
    json["aligned"] = summary.aligned;
    json["integration_failed"] = summary.integration_failed;
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
  STRATA_ASSIGN_OR_RETURN(std::vector<ScanSource> scans, FindScans(options));
  STRATA_ASSIGN_OR_RETURN(const std::set<std::uint64_t> there, SequencesThere(context, options));
  if (options.level) {
    STRATA_ASSIGN_OR_RETURN(const double tilt_rad, LevelTrajectory(scans));
    context.output.Talk(absl::StrFormat("levelled by %.4f rad", tilt_rad));
  }
  Summary summary;
  summary.files = scans.size();
  const std::vector<UploadSource> sources = SourcesOf(scans, there, options, summary);
  Upload(context, options, sources, summary);
  if (options.wait) {
    STRATA_RETURN_IF_ERROR(Wait(context, options, summary));
  }
  Print(options, summary, context.output);
  if (!summary.errors.empty()) {
    return absl::UnknownError(
        absl::StrCat(summary.errors.size(), " of ", summary.files, " scans failed"));
  }
  return absl::OkStatus();
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
  import->add_option("--format", options->format, "Format of the scans")
      ->check(CLI::IsMember({"auto", "3dtk", "pcd", "ply", "kitti", "vtk", "xyz"}))
      ->capture_default_str();
  import->add_option("--poses", options->poses, "File with the poses of the scans");
  import->add_option("--pose-format", options->pose_format, "Format of the poses")
      ->check(CLI::IsMember({"auto", "tum", "index-tum", "kitti", "3dtk"}))
      ->capture_default_str();
  import->add_option("--trajectory", options->trajectory, "Its name; default: that of the folder");
  import
      ->add_option(
          "--align", options->align, "on: register each scan to the map; off: take its pose")
      ->check(CLI::IsMember({"on", "off"}))
      ->capture_default_str();
  import->add_flag("--level", options->level, "Turn all poses so that the dominant floor is level");
  import->add_flag("--wait", options->wait, "Return when every scan is integrated or failed");
}

}  // namespace strata::cli
