// strata-ros2: a robot of ROS 2 and a map, without ROS on this machine.
#include <csignal>
#include <exception>
#include <iostream>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include <CLI/CLI.hpp>

#include "client/cli/terminal/output.h"
#include "client/cli/terminal/usage.h"
#include "client/ros2/bridge.h"
#include "client/ros2/options.h"
#include "client/ros2/talk.h"
#include "core/common/stop.h"

namespace strata::ros2 {
namespace {

constexpr int kExitFailed = 1;
constexpr int kExitUsage = 2;

// The handler's only state.
const Stop* running = nullptr;

// The first signal asks for the end, the second ends the process.
void OnSignal(int signal) {
  running->Request();
  std::signal(signal, SIG_DFL);
}

void Print(const Options& options, const Summary& summary) {
  const cli::Json json = {{"map", options.map},
                          {"trajectory", summary.trajectory},
                          {"clouds", summary.intake.clouds},
                          {"keyframes", summary.intake.keyframes},
                          {"kept", summary.kept.kept},
                          {"points", summary.kept.points},
                          {"deskewed", summary.kept.deskewed},
                          {"not_deskewed", summary.kept.not_deskewed},
                          {"without_pose", summary.intake.without_pose},
                          {"unreadable", summary.intake.unreadable + summary.kept.unreadable},
                          {"back_in_time", summary.intake.back_in_time},
                          {"crowded_out", summary.intake.crowded_out},
                          {"postponed", summary.intake.postponed},
                          {"tracked", summary.followed.tracked},
                          {"predicted", summary.followed.predicted},
                          {"lost", summary.followed.lost},
                          {"sent", summary.spool.sent},
                          {"waiting", summary.spool.waiting},
                          {"refused", summary.spool.refused},
                          {"damaged", summary.spool.damaged}};
  cli::Output output(options.output == "json" ? cli::OutputFormat::kJson : cli::OutputFormat::kText,
                     std::cout,
                     std::cerr);
  output.Object(json);
  if (summary.spool.waiting == 0) return;
  output.Talk(absl::StrCat(summary.spool.waiting,
                           " scans wait in ",
                           options.spool,
                           "; strata-ros2 or strata spool send ",
                           options.spool,
                           " goes on with them"));
}

int Main(int argc, char** argv) {
  CLI::App app(
      "strata-ros2: a robot of ROS 2 in a map of Strata, without ROS on this machine. Clouds and "
      "poses come in over DDS, keyframes go to the server by way of a spool on this disk; out go "
      "the map of the floor that the robot is on, surfaces, paths, and where the robot and its "
      "odometry are in the map",
      "strata-ros2");
  app.footer(
      "Lengths are in metres, angles in radians. ROS_DOMAIN_ID, ROS_LOCALHOST_ONLY=1 and "
      "CYCLONEDDS_URI count as for\nnodes of ROS 2. Ctrl-C or SIGTERM ends it. Exit code: 0 "
      "ended so, 1 failed, 2 wrong usage.\n\nExamples:\n  strata-ros2 campus --topic "
      "/ouster/points "
      "--poses-from /odom --every 0.5m --spool /var/spool/strata\n"
      "  strata-ros2 campus --topic /ouster/points --localize-only");
  app.set_version_flag("--version", "strata-ros2 " STRATA_VERSION);
  Options options;
  AddOptions(app, options);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help, --version
    std::cerr << cli::UsageMessage(app, error) << std::endl;
    return kExitUsage;
  }
  if (const absl::Status valid = ValidateOptions(options); !valid.ok()) {
    std::cerr << "error: " << valid.message() << std::endl;
    return kExitUsage;
  }
  const Stop stop;
  running = &stop;
  std::signal(SIGINT, OnSignal);
  std::signal(SIGTERM, OnSignal);
  Talk talk(std::cerr);
  const absl::StatusOr<Summary> summary = RunBridge(options, stop, talk);
  if (!summary.ok()) {
    talk.Say(absl::StrCat("error: ", summary.status().message()));
    return kExitFailed;
  }
  Print(options, *summary);
  return std::cout.flush() ? 0 : kExitFailed;
}

}  // namespace
}  // namespace strata::ros2

int main(int argc, char** argv) {
  try {
    return strata::ros2::Main(argc, argv);
  } catch (const std::exception& error) {
    std::cerr << "error: " << error.what() << std::endl;
    return strata::ros2::kExitFailed;
  }
}
