// The command line of strata-ros2.
#ifndef STRATA_CLIENT_ROS2_OPTIONS_H_
#define STRATA_CLIENT_ROS2_OPTIONS_H_

#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include <CLI/CLI.hpp>

#include "client/cli/terminal/server_options.h"
#include "core/geometry/pose.h"
#include "core/world/plan.h"

namespace strata::ros2 {

struct Options {
  cli::ServerOptions server;
  std::string output = "text";
  std::string map;
  std::string trajectory;  // empty: of the moment that it starts
  std::string spool;
  int domain = 0;
  // In.
  std::string clouds = "/points";
  std::string poses_from = "/odom";  // or tf:odom->base_link
  std::string goals = "/goal_pose";
  std::string initial_pose = "/initialpose";
  std::string every = "0.5m,30deg";
  std::optional<Pose> mount, start;
  bool localize = false;
  bool localize_only = false;  // and nothing is kept
  std::string align = "on";
  std::string deskew = "on";
  // Out.
  std::string map_frame = "map";
  std::string profile = "default";
  InferredAs inferred = InferredAs::kIgnore;  // by /map and by paths
  std::string map_topic = "/map";
  std::string plan_topic = "/strata/plan";
  std::string pose_topic = "/amcl_pose";
  std::string surfaces_topic = "/strata/surfaces";
  bool no_tf = false;
};

// ROS_DOMAIN_ID is the default of --domain.
void AddOptions(CLI::App& app, Options& options);
// INVALID_ARGUMENT naming the option whose value is none.
absl::Status ValidateOptions(const Options& options);
// Of a run that begins at `now`: "ros2-20261126-171500".
std::string TrajectoryAt(absl::Time now);

}  // namespace strata::ros2

#endif  // STRATA_CLIENT_ROS2_OPTIONS_H_
