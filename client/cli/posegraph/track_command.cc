// strata posegraph track
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/time/time.h"

#include "client/cli/posegraph/posegraph_files.h"
#include "client/cli/terminal/arguments.h"
#include "client/cli/terminal/command.h"
#include "client/cli/terminal/world_json.h"
#include "client/formats/file_bytes.h"
#include "client/formats/motion/trajectory_file.h"
#include "client/formats/scan_list.h"
#include "core/common/status.h"

namespace strata::cli {
namespace {

struct TrackOptions {
  std::string map;
  std::vector<std::string> paths;
  std::string format = "auto";
  std::string poses;
  std::string out;
  TrackStart start;
};

// How often the robot was in which state.
struct Counts {
  std::size_t tracked = 0, predicted = 0, lost = 0;

  void Add(TrackState state) {
    ++(state == TrackState::kTracked     ? tracked
       : state == TrackState::kPredicted ? predicted
                                         : lost);
  }
};

absl::StatusOr<std::vector<ScanFile>> ScansOf(Context& context, const TrackOptions& options) {
  ScanListOptions list;
  STRATA_ASSIGN_OR_RETURN(list.format, ParseScanFormat(options.format));
  list.poses = options.poses;
  list.tell = [&context](const std::string& line) { context.output.Talk(line); };
  STRATA_ASSIGN_OR_RETURN(std::vector<ScanFile> scans,
                          ListScans({options.paths.begin(), options.paths.end()}, list));
  for (const ScanFile& scan : scans) STRATA_RETURN_IF_ERROR(scan.pose_status);
  return scans;
}

void Print(const ScanFile& scan, const TrackedPose& pose, Output& output) {
  const std::string name = scan.path.filename().string();
  if (!output.text()) {
    Json json = {{"scan", name}};
    json.update(ToJson(pose));
    output.JsonLine(json);
    return;
  }
  std::string where = "nowhere";
  if (pose.known) {
    const Eigen::Vector3d& p = pose.T_map_scan.translation();
    const Vector6d sigma = pose.covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
    where = absl::StrFormat("%.3f, %.3f, %.3f  sigma %.3f m, %.4f rad",
                            p.x(),
                            p.y(),
                            p.z(),
                            sigma.tail<3>().norm(),
                            sigma.head<3>().norm());
  }
  output.Text(absl::StrFormat("%-16s %-9s score %.2f  %s%s%s",
                              name,
                              std::string(ToString(pose.state)),
                              pose.score,
                              where,
                              pose.message.empty() ? "" : "  ",
                              pose.message));
}

// Of a scan without a time its number, so that rows ascend.
double TimeOf(const ScanFile& scan) {
  if (!scan.time.has_value()) return static_cast<double>(scan.sequence);
  return absl::ToDoubleSeconds(*scan.time - absl::UnixEpoch());
}

absl::Status WriteRun(const std::string& file, std::vector<TrajectoryPose> poses) {
  STRATA_ASSIGN_OR_RETURN(Trajectory trajectory, Trajectory::Make(std::move(poses)));
  return WriteFileBytes(file, TrajectoryText({std::move(trajectory), std::nullopt}));
}

absl::Status Track(Context& context, const TrackOptions& options) {
  STRATA_ASSIGN_OR_RETURN(const std::vector<ScanFile> scans, ScansOf(context, options));
  STRATA_ASSIGN_OR_RETURN(
      const std::unique_ptr<api::Tracking> tracking,
      context.database.posegraph().Track(context.call, options.map, options.start));
  std::vector<TrajectoryPose> run;
  Counts counts;
  for (const ScanFile& scan : scans) {
    TrackStep step;
    STRATA_ASSIGN_OR_RETURN(step.cloud, ReadScanFile(scan));
    const Eigen::Vector3d origin = step.cloud.origin;
    step.cloud.origin.setZero();
    step.T_odom_scan = scan.T_map_scan;
    step.T_odom_scan.translate(origin);
    STRATA_ASSIGN_OR_RETURN(TrackedPose pose, tracking->Step(step));
    pose.T_map_scan.translate(-origin);
    counts.Add(pose.state);
    Print(scan, pose, context.output);
    if (pose.known) run.push_back({TimeOf(scan), pose.T_map_scan, pose.covariance});
  }
  context.output.Text(absl::StrCat(scans.size(),
                                   " scans: ",
                                   counts.tracked,
                                   " tracked, ",
                                   counts.predicted,
                                   " predicted, ",
                                   counts.lost,
                                   " lost"));
  return options.out.empty() ? absl::OkStatus() : WriteRun(options.out, std::move(run));
}

}  // namespace

void AddPosegraphTrack(Commands& commands, CLI::App* noun) {
  auto options = std::make_shared<TrackOptions>();
  CLI::App* app = commands.Verb(
      noun,
      "track",
      "Follow a robot through a map by its odometry and its scans, scan by scan: where it was, how "
      "sure that is and how well the scan agrees with the map; exit 0 also when it is lost",
      "strata posegraph track campus scans/ --poses odometry.txt --out run.csv",
      [options](Context& context) { return Track(context, *options); });
  AddMapName(app, options->map);
  app->add_option("PATH", options->paths, "Scans, or folders of them, as scan import takes them")
      ->required();
  app->add_option("--format", options->format, "As of scan import")->capture_default_str();
  app->add_option("--poses",
                  options->poses,
                  "File of the odometry: poses of the scans in a frame that does not jump, as scan "
                  "import takes them");
  AddPose(
      app,
      "--guess",
      [options](const Pose& pose, std::size_t) { options->start.T_map_scan_guess = pose; },
      "Roughly where the first scan was taken in the map [m, degrees]; without it, anywhere");
  app->add_option("--radius", options->start.guess_radius_m, "Only places so near to the guess [m]")
      ->capture_default_str();
  app->add_option(
      "--out", options->out, "Write the poses with covariance, as strata egomotion does (CSV)");
}

}  // namespace strata::cli
