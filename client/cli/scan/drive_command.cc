// strata drive: from a robot's log with scans to a map, as one stream.
#include <cstddef>
#include <filesystem>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/time/time.h"

#include "client/cli/egomotion/egomotion_report.h"
#include "client/cli/scan/import_run.h"
#include "client/cli/scan/import_sources.h"
#include "client/cli/terminal/arguments.h"
#include "client/cli/terminal/command.h"
#include "client/cli/terminal/on_earth.h"
#include "client/formats/bags/keyframes.h"
#include "client/formats/motion/placed_scans.h"
#include "client/formats/motion/recorded_log.h"
#include "client/formats/motion/rig_file.h"
#include "client/formats/scan_list.h"
#include "core/common/status.h"
#include "core/egomotion/egomotion.h"

namespace strata::cli {
namespace {

// So long after a scan's stamp the poses of its last points are known, if its scanner tilts.
constexpr double kScanS = 2.5;
// Poses before the first scan of a batch that its points may need.
constexpr double kBeforeS = 3.0;
constexpr double kTalkEveryS = 30.0;  // of the log

struct DriveOptions {
  ImportOptions import;  // the log is its path
  std::string rig, scans;
  std::optional<double> heading_deg;
};

double Seconds(const ScanFile& scan) {
  return absl::ToDoubleSeconds(*scan.time - absl::UnixEpoch());
}

// Scans go into the map as soon as the filter knows where they were.
class Drive {
 public:
  Drive(Context& context,
        const DriveOptions& options,
        const KeyframeSpacing& every,
        std::vector<ScanFile> scans,
        ImportBatches batches)
      : context_(context),
        options_(options),
        keyframes_(every),
        scans_(std::move(scans)),
        batches_(std::move(batches)) {}

  absl::Status Follow(const EgomotionSoFar& run) {
    const double known_s = run.poses.back().time_s;
    const bool ends = known_s >= run.end_s;
    std::vector<ScanFile> batch;
    for (; next_ < scans_.size() && (ends || Seconds(scans_[next_]) + kScanS <= known_s); ++next_) {
      batch.push_back(scans_[next_]);
    }
    STRATA_RETURN_IF_ERROR(Send(run.poses, std::move(batch)));
    if (known_s >= talked_s_ + kTalkEveryS || ends) TalkOf(run);
    return context_.call.stop.status();
  }

  ImportSummary& summary() { return summary_; }
  const ReadCounts& counts() const { return batches_.counts(); }

 private:
  absl::Status Send(const std::vector<TrajectoryPose>& poses, std::vector<ScanFile> batch) {
    if (batch.empty()) return absl::OkStatus();
    const double from_s = Seconds(batch.front()) - kBeforeS;
    auto first = poses.end();
    while (first != poses.begin() && (first - 1)->time_s >= from_s) --first;
    STRATA_ASSIGN_OR_RETURN(Trajectory way, Trajectory::Make({first, poses.end()}));
    PlaceOn(std::move(way), true, options_.import.T_body_scan.value_or(Pose::Identity()), batch);
    std::vector<ScanFile> kept;
    for (ScanFile& scan : batch) {
      if (!scan.pose_status.ok() || keyframes_.Keep(Seconds(scan), scan.T_map_scan)) {
        kept.push_back(std::move(scan));
      }
    }
    const ImportSources sources = batches_.Next(kept);
    const ImportSummary begun = Begun(sources);
    summary_.files += begun.files;
    summary_.skipped += begun.skipped;
    summary_.present.insert(summary_.present.end(), begun.present.begin(), begun.present.end());
    for (const Json& error : begun.errors) summary_.errors.push_back(error);
    Upload(context_, options_.import, sources.missing, summary_);
    return absl::OkStatus();
  }

  void TalkOf(const EgomotionSoFar& run) {
    talked_s_ = run.poses.back().time_s;
    std::size_t used = 0;
    for (const FixOutcome& fix : run.fixes) used += fix.used ? 1 : 0;
    context_.output.Talk(absl::StrFormat("%.0f of %.0f s: %d of %d fixes used, %d scans sent",
                                         run.poses.back().time_s - run.poses.front().time_s,
                                         run.end_s - run.poses.front().time_s,
                                         used,
                                         run.fixes.size(),
                                         summary_.uploaded));
  }

  Context& context_;
  const DriveOptions& options_;
  KeyframeChooser keyframes_;
  std::vector<ScanFile> scans_;  // by time
  ImportBatches batches_;
  std::size_t next_ = 0;
  double talked_s_ = -std::numeric_limits<double>::infinity();
  ImportSummary summary_;
};

absl::StatusOr<std::vector<ScanFile>> FindTimedScans(const DriveOptions& options, Output& output) {
  const std::filesystem::path folder =
      options.scans.empty() ? std::filesystem::path(options.import.paths.front()) / "scans"
                            : std::filesystem::path(options.scans);
  std::error_code error;
  if (!std::filesystem::exists(folder, error)) {
    return absl::NotFoundError(absl::StrCat(
        folder.string(), " is not there; say with --scans which folder has the drive's scans"));
  }
  ScanListOptions list;
  list.poses = kNoPoses;
  list.tell = [&output](const std::string& text) { output.Talk(text); };
  STRATA_ASSIGN_OR_RETURN(std::vector<ScanFile> scans, ListScans({folder}, list));
  STRATA_RETURN_IF_ERROR(TimeByName(scans));
  return scans;
}

// Where the map's frame is: as it says, or, while it is empty, at the first fix from now on.
absl::StatusOr<GeodeticOrigin> PlaceMap(Context& context,
                                        const std::string& name,
                                        const MotionLog& log) {
  STRATA_ASSIGN_OR_RETURN(const MapInfo map, context.database.maps().Get(context.call, name));
  if (map.parameters.origin.has_value()) return *map.parameters.origin;
  STRATA_ASSIGN_OR_RETURN(const MapStats stats, context.database.maps().Stats(context.call, name));
  if (stats.scans > 0) {
    return absl::FailedPreconditionError(absl::StrCat(
        "map ", name, " has scans and is nowhere on earth; say where with map georeference"));
  }
  if (log.fixes.empty()) return absl::InvalidArgumentError("the log has no fix");
  const GpsFix& fix = log.fixes.front();
  const GeodeticOrigin origin{fix.latitude_rad, fix.longitude_rad, fix.altitude_m};
  STRATA_RETURN_IF_ERROR(context.database.maps().SetOrigin(context.call, name, origin));
  return origin;
}

absl::Status Run(Context& context, DriveOptions options) {
  const std::string& log = options.import.paths.front();
  if (options.import.trajectory.empty()) options.import.trajectory = TrajectoryOf(log);
  options.import.poses = log;
  STRATA_ASSIGN_OR_RETURN(
      const KeyframeSpacing every,
      ParseKeyframeSpacing(options.import.every.empty() ? kDefaultEvery : options.import.every));
  STRATA_ASSIGN_OR_RETURN(std::vector<ScanFile> scans, FindTimedScans(options, context.output));
  STRATA_ASSIGN_OR_RETURN(RecordedLog recorded, ReadRecordedLog(log));
  if (!options.rig.empty()) STRATA_RETURN_IF_ERROR(ReadRig(options.rig, recorded.rig));
  STRATA_ASSIGN_OR_RETURN(ImportBatches batches, ImportBatches::Begin(context, options.import));
  EgomotionOptions filter;
  STRATA_ASSIGN_OR_RETURN(filter.origin, PlaceMap(context, options.import.map, recorded.log));
  if (options.heading_deg.has_value()) {
    filter.heading_rad = *options.heading_deg * std::numbers::pi / 180.0;
  }
  Drive drive(context, options, every, std::move(scans), std::move(batches));
  filter.told = [&drive](const EgomotionSoFar& run) { return drive.Follow(run); };
  const absl::StatusOr<Egomotion> run =
      FilterLog(recorded.log, recorded.rig, filter, context.call.stop);
  if (!run.ok()) return Annotate(run.status(), log);
  ImportSummary& summary = drive.summary();
  TakeCounts(drive.counts(), summary, context.output);
  const absl::Status waited =
      options.import.wait ? Wait(context, options.import, summary) : absl::OkStatus();
  Json report = ToJson(*run);
  report["drive_seconds"] = report["seconds"];
  report.erase("seconds");
  Print(options.import, summary, context.output, report);
  STRATA_RETURN_IF_ERROR(waited);
  WarnOf(run->report, context.output);
  context.output.Talk(absl::StrCat("next: strata job start ",
                                   options.import.map,
                                   " optimize --wait, which holds the poses to the fixes"));
  return ErrorsOf(summary.errors, summary.files);
}

void AddImportOptions(CLI::App* app, const std::shared_ptr<DriveOptions>& options) {
  app->add_option("--scans",
                  options->scans,
                  "The folder of the scans, whose names are times in seconds "
                  "(1432235498.028276.pcd) [LOGDIR/scans]")
      ->type_name("FOLDER");
  AddPose(
      app,
      "--sensor",
      [options](const Pose& pose, std::size_t) { options->import.T_body_scan = pose; },
      "Where the sensor sits on the robot [m, degrees]");
  app->add_option("--every",
                  options->import.every,
                  absl::StrCat("Keep a scan when it lies so far from the one kept last, turned or "
                               "later: m, deg, rad, s, with commas between; 0m: all [",
                               kDefaultEvery,
                               "]"))
      ->type_name("DISTANCE");
  app->add_option("--trajectory",
                  options->import.trajectory,
                  "Its name in the map; default: that of the folder");
  app->add_option(
         "--align", options->import.align, "on: register each scan to the map; off: take its pose")
      ->check(CLI::IsMember({"on", "off"}))
      ->capture_default_str();
  app->add_option("--deskew",
                  options->import.deskew,
                  "on: where points have times, move each to where it was at the scan's stamp")
      ->check(CLI::IsMember({"on", "off"}))
      ->capture_default_str();
  app->add_flag("--wait", options->import.wait, "Return when every scan is integrated or failed");
}

}  // namespace

void AddDriveCommand(Commands& commands) {
  auto options = std::make_shared<DriveOptions>();
  CLI::App* app = commands.Verb(
      &commands.root,
      "drive",
      "From a robot's log with scans to a map: where it was by strata egomotion, forward in time, "
      "and each scan into the map as soon as that is known. An empty map gets its origin at the "
      "first fix; a map that has one gets the drive where it belongs",
      "strata drive drives/monday campus --rig car.yaml --sensor 0.2,0,1.1 --wait",
      [options](Context& context) { return Run(context, *options); });
  options->import.paths.resize(1);
  app->add_option(
         "LOGDIR", options->import.paths.front(), "The folder of the log, as for egomotion")
      ->required();
  app->add_option("MAP", options->import.map, "The map's name")->required();
  app->add_option("--rig", options->rig, "How the sensors sit and how good they are")
      ->type_name("FILE.yaml");
  app->add_option("--heading",
                  options->heading_deg,
                  "Which way it faced at the start, counter-clockwise from east [degrees]; else "
                  "found from the first metres")
      ->check(CLI::Range(-360.0, 360.0));
  AddImportOptions(app, options);
}

}  // namespace strata::cli
