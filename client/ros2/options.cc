#include "client/ros2/options.h"

#include <cstddef>
#include <cstdlib>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/time/time.h"

#include "client/cli/terminal/arguments.h"
#include "client/formats/bags/cloud_poses.h"
#include "client/formats/bags/keyframes.h"
#include "client/ros2/ros_types.h"
#include "core/common/status.h"
#include "core/world/names.h"

namespace strata::ros2 {
namespace {

constexpr int kMostDomain = 232;  // of the ports that DDS has

void AddInputs(CLI::App& app, Options& options) {
  constexpr char kGroup[] = "What the robot publishes";
  app.add_option("--topic", options.clouds, "Clouds: sensor_msgs/msg/PointCloud2")
      ->type_name("TOPIC")
      ->group(kGroup)
      ->capture_default_str();
  app.add_option("--poses-from",
                 options.poses_from,
                 "A topic of nav_msgs/msg/Odometry, geometry_msgs/msg/PoseStamped or "
                 "PoseWithCovarianceStamped, or transforms as in 'tf:odom->base_link'. The pose of "
                 "a cloud is interpolated at its stamp")
      ->type_name("TOPIC|tf:A->B")
      ->group(kGroup)
      ->capture_default_str();
  app.add_option("--every",
                 options.every,
                 "Keep a cloud when it lies so far from the one kept last, turned or later: m, "
                 "deg, rad, s, with commas between; 0m: all")
      ->type_name("DISTANCE")
      ->group(kGroup)
      ->capture_default_str();
  cli::AddPose(
      &app,
      "--mount",
      [&options](const Pose& pose, std::size_t) { options.mount = pose; },
      "Where the sensor is on what the poses are those of [m, degrees]; without it as /tf and "
      "/tf_static say")
      ->group(kGroup);
  cli::AddPose(
      &app,
      "--start",
      [&options](const Pose& pose, std::size_t) { options.start = pose; },
      "Where the odometry begins in the map [m, degrees]; without it at the map's origin")
      ->group(kGroup);
  app.add_flag("--localize",
               options.localize,
               "Ask the server where the first clouds were taken, near --start or anywhere, and "
               "keep nothing before that is known")
      ->group(kGroup);
  app.add_flag("--localize-only",
               options.localize_only,
               "The same, and keep nothing at all: only say where the robot is, as amcl does")
      ->excludes("--spool")
      ->excludes("--trajectory")
      ->excludes("--align")
      ->excludes("--every")
      ->group(kGroup);
  app.add_option("--initial-pose",
                 options.initial_pose,
                 "Where somebody says that the robot is, roughly: "
                 "geometry_msgs/msg/PoseWithCovarianceStamped")
      ->type_name("TOPIC")
      ->group(kGroup)
      ->capture_default_str();
  app.add_option("--goals", options.goals, "Goals: geometry_msgs/msg/PoseStamped")
      ->type_name("TOPIC")
      ->group(kGroup)
      ->capture_default_str();
}

void AddOutputs(CLI::App& app, Options& options) {
  constexpr char kGroup[] = "What it publishes";
  const auto add = [&](const char* name, std::string& value, const char* text) {
    app.add_option(name, value, text)->type_name("TOPIC")->group(kGroup)->capture_default_str();
  };
  add("--map-topic",
      options.map_topic,
      "The floor that the robot is on: nav_msgs/msg/OccupancyGrid");
  add("--plan-topic", options.plan_topic, "A path for each goal: nav_msgs/msg/Path");
  add("--pose-topic",
      options.pose_topic,
      "Where the robot is, as it is tracked: geometry_msgs/msg/PoseWithCovarianceStamped");
  add("--surfaces-topic",
      options.surfaces_topic,
      "The surfaces around the robot: sensor_msgs/msg/PointCloud2");
  app.add_option("--map-frame", options.map_frame, "The frame of the map's coordinates")
      ->group(kGroup)
      ->capture_default_str();
  app.add_option("--profile", options.profile, "The map's robot profile whose floors and paths")
      ->group(kGroup)
      ->capture_default_str();
  cli::AddInferred(&app, options.inferred)->group(kGroup);
  app.add_flag("--no-tf",
               options.no_tf,
               "Do not say on /tf where the odometry's frame is in the map: something else does")
      ->group(kGroup);
}

}  // namespace

void AddOptions(CLI::App& app, Options& options) {
  int domain = 0;
  const char* const given = std::getenv("ROS_DOMAIN_ID");
  if (given != nullptr && absl::SimpleAtoi(given, &domain)) options.domain = domain;
  app.add_option("MAP", options.map, "The map's name")->required();
  app.add_option("--spool",
                 options.spool,
                 "Directory where scans lie until the server has acknowledged them; made if it is "
                 "not there. Needed but with --localize-only")
      ->type_name("DIR");
  cli::AddServerOptions(app, options.server);
  app.add_option("--domain", options.domain, "Domain of DDS; else ROS_DOMAIN_ID")
      ->check(CLI::Range(0, kMostDomain))
      ->capture_default_str();
  app.add_option("--trajectory",
                 options.trajectory,
                 "Name of this run in the map; default: ros2- and the time that it starts");
  app.add_option("--align", options.align, "on: register each scan to the map; off: take its pose")
      ->check(CLI::IsMember({"on", "off"}))
      ->capture_default_str();
  app.add_option("--deskew",
                 options.deskew,
                 "on: where points have times, move each to where it was at the cloud's stamp")
      ->check(CLI::IsMember({"on", "off"}))
      ->capture_default_str();
  app.add_option("--output", options.output, "Of the sum at the end: text or json")
      ->check(CLI::IsMember({"text", "json"}))
      ->capture_default_str();
  AddInputs(app, options);
  AddOutputs(app, options);
}

absl::Status ValidateOptions(const Options& options) {
  STRATA_RETURN_IF_ERROR(ValidateName("map name", options.map));
  if (options.spool.empty() && !options.localize_only) {
    return absl::InvalidArgumentError(
        "--spool DIR is needed: where scans lie until the server has acknowledged them");
  }
  if (!options.trajectory.empty()) {
    STRATA_RETURN_IF_ERROR(ValidateName("--trajectory", options.trajectory));
  }
  STRATA_RETURN_IF_ERROR(Annotate(ParseKeyframeSpacing(options.every).status(), "--every"));
  for (const auto& [name, topic] : {std::pair{"--topic", options.clouds},
                                    {"--goals", options.goals},
                                    {"--initial-pose", options.initial_pose},
                                    {"--pose-topic", options.pose_topic},
                                    {"--map-topic", options.map_topic},
                                    {"--plan-topic", options.plan_topic},
                                    {"--surfaces-topic", options.surfaces_topic}}) {
    STRATA_RETURN_IF_ERROR(Annotate(ValidateTopicName(topic), name));
  }
  return Annotate(absl::StartsWith(options.poses_from, "tf:")
                      ? ParseTransformPoses(options.poses_from).status()
                      : ValidateTopicName(options.poses_from),
                  "--poses-from");
}

std::string TrajectoryAt(absl::Time now) {
  return absl::StrCat("ros2-", absl::FormatTime("%Y%m%d-%H%M%S", now, absl::UTCTimeZone()));
}

}  // namespace strata::ros2
