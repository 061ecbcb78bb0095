// The shape of what drives a path, as commands about paths are told.
#ifndef STRATA_CLIENT_CLI_PLAN_SHAPE_OPTIONS_H_
#define STRATA_CLIENT_CLI_PLAN_SHAPE_OPTIONS_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include <Eigen/Core>

#include "client/cli/terminal/command.h"
#include "client/cli/terminal/output.h"
#include "core/geometry/pose.h"
#include "core/world/robot_profile.h"
#include "core/world/shape.h"

namespace strata::cli {

struct ShapeOptions {
  std::string file;         // empty: none
  std::vector<double> box;  // length, width, height; empty: none
  Pose T_robot_shape = Pose::Identity();
  std::vector<std::string> joints;  // NAME=VALUE
  double clearance_m = 0.0;
  std::string unknown = "ignore";

  bool given() const { return !file.empty() || !box.empty(); }
};

// --shape, --shape-box, --shape-pose, --joint, --clearance, --unknown.
void AddShapeOptions(CLI::App* verb, ShapeOptions& options);

// Whether the shape goes along the path; what is no higher than a step of the robot is ground.
// REQUIRES: options.given().
absl::StatusOr<ShapeCheck> CheckShape(Context& context,
                                      const std::string& map,
                                      const ShapeOptions& options,
                                      const RobotProfile& profile,
                                      InferredAs inferred,
                                      const std::vector<Eigen::Vector3d>& waypoints);

Json ToJson(const ShapeCheck& check);
// A line, and one for each of the first contacts.
void PrintText(const ShapeCheck& check, Output& output);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_PLAN_SHAPE_OPTIONS_H_
