// strata egomotion: from a robot's log to where it was.
#include <memory>
#include <numbers>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

#include "client/cli/egomotion/egomotion_report.h"
#include "client/cli/terminal/command.h"
#include "client/cli/terminal/values.h"
#include "client/formats/file_bytes.h"
#include "client/formats/motion/recorded_log.h"
#include "client/formats/motion/rig_file.h"
#include "client/formats/motion/trajectory_file.h"
#include "core/common/status.h"
#include "core/egomotion/egomotion.h"
#include "core/egomotion/smoothing/smoother.h"

namespace strata::cli {
namespace {

struct MotionOptions {
  std::string log, rig, out, report;
  std::optional<double> heading_deg;
  bool smooth = false;
};

// What a user would ask next.
void TalkOf(const Egomotion& egomotion, const MotionOptions& options, Output& output) {
  WarnOf(egomotion.report, output);
  output.Talk(absl::StrCat("next: strata scan import MAP SCANS --poses ", options.out));
}

absl::Status WriteReport(const Json& json, const std::string& path) {
  return WriteFileBytes(path, Shortest(json).dump(2) + "\n");
}

absl::Status Run(FileContext& context, const MotionOptions& options) {
  STRATA_ASSIGN_OR_RETURN(RecordedLog recorded, ReadRecordedLog(options.log));
  if (!options.rig.empty()) STRATA_RETURN_IF_ERROR(ReadRig(options.rig, recorded.rig));
  EgomotionOptions filter;
  if (options.heading_deg.has_value()) {
    filter.heading_rad = *options.heading_deg * std::numbers::pi / 180.0;
  }
  absl::StatusOr<Egomotion> egomotion = FilterLog(recorded.log, recorded.rig, filter, context.stop);
  if (egomotion.ok() && options.smooth) {
    egomotion = SmoothLog(recorded.log, recorded.rig, *egomotion, context.stop);
  }
  if (!egomotion.ok()) return Annotate(egomotion.status(), options.log);
  STRATA_RETURN_IF_ERROR(
      WriteFileBytes(options.out, TrajectoryText({egomotion->trajectory, egomotion->origin})));
  Json json = {{"file", options.out}, {"layout", recorded.layout}, {"smoothed", options.smooth}};
  json.update(ToJson(*egomotion));
  if (!options.report.empty()) STRATA_RETURN_IF_ERROR(WriteReport(json, options.report));
  context.output.Object(json);
  TalkOf(*egomotion, options, context.output);
  return absl::OkStatus();
}

}  // namespace

void AddEgomotionCommand(Commands& commands) {
  auto options = std::make_shared<MotionOptions>();
  CLI::App* app = commands.FileVerb(
      &commands.root,
      "egomotion",
      "Where a robot was, from the log of its IMU, wheels and GPS: poses 20 times a second in a "
      "map whose origin is the first fix (x east, y north), each with its covariance, by an "
      "information filter. LOGDIR holds imu.csv (stamp,wx,wy,wz,ax,ay,az), gps.csv "
      "(stamp,lat,lon,alt,var_e,var_n,var_u) and odom.csv (stamp,vx,wz), or a log of another "
      "layout that is known",
      "strata egomotion drives/monday --out monday.csv --rig car.yaml --report monday.json",
      [options](FileContext& context) { return Run(context, *options); });
  app->add_option("LOGDIR", options->log, "The folder of the log")->required();
  app->add_option("--out",
                  options->out,
                  "The CSV to write: time, pose, covariance of [rotation, translation]")
      ->type_name("FILE.csv")
      ->required();
  app->add_option("--rig",
                  options->rig,
                  "How the sensors sit and how good they are; without it the IMU's orientation is "
                  "found from the motion and the antenna is above the wheels' axle")
      ->type_name("FILE.yaml");
  app->add_option("--heading",
                  options->heading_deg,
                  "Which way it faced at the start, counter-clockwise from east [degrees]; else "
                  "found from the first metres")
      ->check(CLI::Range(-360.0, 360.0));
  app->add_flag("--smooth",
                options->smooth,
                "Estimate all poses from the whole log at once: each knows what came after it too, "
                "and fixes that drift slowly count less");
  app->add_option("--report", options->report, "Also write what is printed as JSON")
      ->type_name("FILE.json");
}

}  // namespace strata::cli
