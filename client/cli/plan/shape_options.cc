#include "client/cli/plan/shape_options.h"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_split.h"

#include "client/cli/terminal/arguments.h"
#include "client/cli/terminal/json.h"
#include "client/formats/shapes/shape_reader.h"
#include "core/common/status.h"

namespace strata::cli {
namespace {

// Contacts that people are shown; JSON has all.
constexpr std::size_t kMostShownContacts = 10;

absl::StatusOr<JointPositions> JointsOf(const std::vector<std::string>& words) {
  JointPositions joints;
  for (const std::string& word : words) {
    const std::vector<std::string> parts = absl::StrSplit(word, absl::MaxSplits('=', 1));
    double position = 0.0;
    if (parts.size() != 2 || !absl::SimpleAtod(parts[1], &position)) {
      return absl::InvalidArgumentError(
          absl::StrCat("--joint ", word, ": NAME=POSITION is needed, as in elbow=1.57"));
    }
    joints[parts[0]] = position;
  }
  return joints;
}

absl::StatusOr<CollisionShape> ShapeOf(const ShapeOptions& options) {
  CollisionShape shape;
  if (options.file.empty()) {
    ShapePart part;
    part.size_m = {options.box[0], options.box[1], options.box[2]};
    part.T_shape_part = Pose(Eigen::Translation3d(0.0, 0.0, options.box[2] / 2.0));
    shape.parts.push_back(part);
  } else {
    STRATA_ASSIGN_OR_RETURN(const JointPositions joints, JointsOf(options.joints));
    STRATA_ASSIGN_OR_RETURN(shape, ReadShape(options.file, joints));
  }
  for (ShapePart& part : shape.parts) part.T_shape_part = options.T_robot_shape * part.T_shape_part;
  for (Eigen::Vector3f& vertex : shape.vertices) {
    vertex = (options.T_robot_shape * vertex.cast<double>()).cast<float>();
  }
  return shape;
}

}  // namespace

void AddShapeOptions(CLI::App* verb, ShapeOptions& options) {
  CLI::Option* file = verb->add_option(
      "--shape",
      options.file,
      "Also hold this shape against the map along the path: a mesh (.stl, .obj, .ply, .dae, .glb) "
      "in "
      "metres, x forward, z up from the ground, or the collision geometry of a robot (.urdf)");
  file->type_name("FILE");
  AddNumbers(
      verb,
      "--shape-box",
      "L,W,H",
      3,
      3,
      [&options](const std::vector<double>& n) { options.box = n; },
      "The same with a box on the ground: length, width, height [m]")
      ->excludes(file);
  AddPose(
      verb,
      "--shape-pose",
      [&options](const Pose& T, std::size_t /*numbers*/) { options.T_robot_shape = T; },
      "Where the shape is on the robot: its origin's place over the ground [m], and turn "
      "[degrees]");
  verb->add_option(
          "--joint", options.joints, "Position of a joint of the .urdf [rad, m]; 0 without")
      ->type_name("NAME=POSITION")
      ->allow_extra_args(false)
      ->needs(file);
  verb->add_option("--clearance", options.clearance_m, "What the shape keeps from everything [m]")
      ->capture_default_str();
  verb->add_option("--unknown",
                   options.unknown,
                   "Whether cells below the shape where nothing was measured are in its way")
      ->check(CLI::IsMember({"ignore", "blocked"}))
      ->capture_default_str();
}

absl::StatusOr<ShapeCheck> CheckShape(Context& context,
                                      const std::string& map,
                                      const ShapeOptions& options,
                                      const RobotProfile& profile,
                                      InferredAs inferred,
                                      const std::vector<Eigen::Vector3d>& waypoints) {
  ShapeQuery query;
  STRATA_ASSIGN_OR_RETURN(query.shape, ShapeOf(options));
  query.waypoints = waypoints;
  query.clearance_m = options.clearance_m;
  query.ground_m = profile.max_step_m;
  query.unknown_blocks = options.unknown == "blocked";
  query.inferred = inferred;
  STRATA_RETURN_IF_ERROR(ValidateShapeQuery(query));
  return context.database.planning().CheckShape(context.call, map, query);
}

Json ToJson(const ShapeCheck& check) {
  Json contacts = Json::array();
  for (const ShapeContact& contact : check.contacts) {
    contacts.push_back({{"from_m", contact.from_m},
                        {"to_m", contact.to_m},
                        {"where", ToJson(contact.where)},
                        {"depth_m", contact.depth_m},
                        {"class_id", contact.class_id},
                        {"unknown", contact.unknown},
                        {"inferred", contact.inferred}});
  }
  return {{"free", check.free},
          {"message", check.message},
          {"free_m", check.free_m},
          {"length_m", check.length_m},
          {"contacts", std::move(contacts)},
          {"looks", check.looks},
          {"elapsed_ms", check.elapsed_ms},
          {"epoch", check.epoch}};
}

void PrintText(const ShapeCheck& check, Output& output) {
  output.Text(absl::StrCat("shape: ", check.message));
  const std::size_t shown = std::min(kMostShownContacts, check.contacts.size());
  for (std::size_t i = 0; i < shown; ++i) {
    const ShapeContact& contact = check.contacts[i];
    output.Text(absl::StrFormat(
        "  %.2f to %.2f m: %s%s at %.2f, %.2f, %.2f",
        contact.from_m,
        contact.to_m,
        contact.unknown ? "unknown ground" : absl::StrFormat("%.3f m deep", contact.depth_m),
        contact.inferred ? ", only inferred," : "",
        contact.where.x(),
        contact.where.y(),
        contact.where.z()));
  }
  if (shown < check.contacts.size()) {
    output.Text(absl::StrFormat("  … %d more; --output json", check.contacts.size() - shown));
  }
}

}  // namespace strata::cli
