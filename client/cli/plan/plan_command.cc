// strata plan
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

#include "client/cli/plan/driver_options.h"
#include "client/cli/plan/path_commands.h"
#include "client/cli/plan/shape_options.h"
#include "client/cli/terminal/arguments.h"
#include "client/cli/terminal/command.h"
#include "client/cli/terminal/json.h"
#include "client/cli/terminal/number_file.h"
#include "client/cli/terminal/on_earth.h"
#include "client/formats/file_bytes.h"
#include "client/formats/foxglove/foxglove_file.h"
#include "client/formats/path_file.h"
#include "core/common/status.h"

namespace strata::cli {
namespace {

struct PlanOptions {
  std::string map;
  PlanQuery query;
  std::optional<int> from_level, to_level;
  std::string queries_file;
  DriverOptions driver;
  ShapeOptions shape;
  std::string out;
  bool watch = false;
};

// Waypoints that people are shown; JSON and files have all.
constexpr std::size_t kMostShown = 10;

Json WithPlaces(const PlanResult& plan, const std::optional<LocalFrame>& earth) {
  Json json = ToJson(plan);
  if (!earth.has_value()) return json;
  json["waypoints_on_earth"] = Json::array();
  for (const Eigen::Vector3d& p : plan.waypoints) {
    json["waypoints_on_earth"].push_back(PlaceOnEarth(*earth, p));
  }
  return json;
}

std::string LineOf(const Eigen::Vector3d& p, const std::optional<LocalFrame>& earth) {
  std::string line = absl::StrFormat("  %.3f  %.3f  %.3f", p.x(), p.y(), p.z());
  if (!earth.has_value()) return line;
  const Json place = PlaceOnEarth(*earth, p);
  absl::StrAppendFormat(&line,
                        "  %.9f  %.9f  %.3f",
                        place[0].get<double>(),
                        place[1].get<double>(),
                        place[2].get<double>());
  return line;
}

void PrintText(const PlanResult& plan, const std::optional<LocalFrame>& earth, Output& output) {
  if (!plan.found()) {
    const absl::string_view reason = strata::ToString(plan.reason);
    output.Verdict(absl::StrCat("no path: ", plan.message.empty() ? reason : plan.message), false);
    return;
  }
  output.Verdict(absl::StrFormat("path of %.2f m, cost %.2f, %d waypoints (%.1f ms, %d expanded)",
                                 plan.length_m,
                                 plan.cost,
                                 plan.waypoints.size(),
                                 plan.elapsed_ms,
                                 plan.expanded),
                 true);
  const std::size_t shown = std::min(kMostShown, plan.waypoints.size());
  for (std::size_t i = 0; i < shown; ++i) {
    output.Text(LineOf(plan.waypoints[i], earth));
  }
  if (shown < plan.waypoints.size()) {
    output.Text(absl::StrFormat("  … %d more; --out FILE.ply", plan.waypoints.size() - shown));
  }
  for (const PlanGap& gap : plan.gaps) {
    output.Text(absl::StrFormat("  unobserved for %.2f m from %.2f, %.2f, %.2f",
                                gap.length_m,
                                gap.from.x(),
                                gap.from.y(),
                                gap.from.z()));
  }
}

void ListWaypoints(const PlanResult& plan, Output& output) {
  if (!plan.found()) output.Talk(absl::StrCat("no path: ", plan.message));
  Json rows = Json::array();
  for (const Eigen::Vector3d& p : plan.waypoints) {
    rows.push_back({{"x", p.x()}, {"y", p.y()}, {"z", p.z()}});
  }
  output.List(rows, {{"x", "X"}, {"y", "Y"}, {"z", "Z"}});
}

void Print(const PlanResult& plan,
           const std::optional<LocalFrame>& earth,
           const std::optional<ShapeCheck>& shape,
           Output& output) {
  if (output.csv()) return ListWaypoints(plan, output);
  if (output.text()) {
    PrintText(plan, earth, output);
    if (shape.has_value()) PrintText(*shape, output);
    return;
  }
  Json json = WithPlaces(plan, earth);
  if (shape.has_value()) json["shape"] = ToJson(*shape);
  output.Object(json);
}

// Rings of a sparse lidar lie farther apart than a careful robot's max gap: which would do.
void TellOfGap(const PlanResult& plan, const RobotProfile& profile, Output& output) {
  const double gap_m = plan.obstruction_value;
  if (plan.found() || plan.obstruction != Obstruction::kUnknown || gap_m <= profile.max_gap_m)
    return;
  constexpr double kCentimetres = 100.0;
  output.Talk(absl::StrFormat("a robot that may cross that unseen needs at least --max-gap %.2f",
                              std::ceil(gap_m * kCentimetres) / kCentimetres));
}

// That nothing is inferred, or of which epoch it is, which whoever minds it should know.
void TellOfInferred(const PlanResult& plan, InferredAs inferred, Output& output) {
  if (inferred == InferredAs::kIgnore || !absl::StartsWith(plan.message, "found; ")) return;
  output.Talk(plan.message);
}

absl::Status WritePlan(const std::string& file, const std::vector<Eigen::Vector3d>& waypoints) {
  if (!absl::EndsWith(file, ".mcap")) return WritePath(file, waypoints);
  FoxgloveScene scene;
  scene.path = waypoints;
  STRATA_ASSIGN_OR_RETURN(const std::string bytes, FoxgloveBytes(scene));
  return WriteFileBytes(file, bytes);
}

absl::Status PlanOne(Context& context, PlanOptions options) {
  STRATA_ASSIGN_OR_RETURN(options.query.profile, ProfileOf(context, options.map, options.driver));
  STRATA_ASSIGN_OR_RETURN(options.query.class_costs,
                          ClassCostsOf(context, options.map, options.driver));
  options.query.inferred = options.driver.inferred;
  options.query.from.level = options.from_level;
  options.query.to.level = options.to_level;
  STRATA_ASSIGN_OR_RETURN(
      const PlanResult plan,
      context.database.planning().PlanPath(context.call, options.map, options.query));
  if (!options.out.empty() && plan.found()) {
    STRATA_RETURN_IF_ERROR(WritePlan(options.out, plan.waypoints));
    context.output.Talk(absl::StrCat("wrote ", options.out));
  }
  STRATA_ASSIGN_OR_RETURN(const std::optional<LocalFrame> earth, EarthOf(context, options.map));
  std::optional<ShapeCheck> shape;
  if (options.shape.given() && plan.found()) {
    STRATA_ASSIGN_OR_RETURN(shape,
                            CheckShape(context,
                                       options.map,
                                       options.shape,
                                       options.query.profile,
                                       options.query.inferred,
                                       plan.waypoints));
  }
  Print(plan, earth, shape, context.output);
  if (context.output.text()) TellOfGap(plan, options.query.profile, context.output);
  TellOfInferred(plan, options.query.inferred, context.output);
  if (!options.watch || !plan.found()) return absl::OkStatus();
  return FollowPath(context,
                    options.map,
                    {.waypoints = plan.waypoints,
                     .profile = options.query.profile,
                     .class_costs = options.query.class_costs,
                     .inferred = options.query.inferred});
}

// A query that was refused, with the keys of an answer.
Json Refused(const absl::Status& status) {
  Json json = ToJson(PlanResult{});
  json["found"] = false;
  json["reason"] = "error";
  json["message"] = std::string(status.message());
  return json;
}

// A JSON line for each query; one that is refused has the reason "error" and the rest goes on.
absl::Status PlanMany(Context& context, PlanOptions options) {
  STRATA_ASSIGN_OR_RETURN(const auto rows, ReadNumberFile(options.queries_file, 6, 6));
  STRATA_ASSIGN_OR_RETURN(options.query.profile, ProfileOf(context, options.map, options.driver));
  STRATA_ASSIGN_OR_RETURN(options.query.class_costs,
                          ClassCostsOf(context, options.map, options.driver));
  options.query.inferred = options.driver.inferred;
  STRATA_ASSIGN_OR_RETURN(const std::optional<LocalFrame> earth, EarthOf(context, options.map));
  absl::Status first_error;
  for (const std::vector<double>& row : rows) {
    options.query.from = {.x_m = row[0], .y_m = row[1], .z_m = row[2], .level = {}};
    options.query.to = {.x_m = row[3], .y_m = row[4], .z_m = row[5], .level = {}};
    const auto plan =
        context.database.planning().PlanPath(context.call, options.map, options.query);
    if (!plan.ok()) {
      first_error.Update(plan.status());
      context.output.JsonLine(Refused(plan.status()));
      if (context.call.stop.requested() || absl::IsUnavailable(plan.status())) {
        break;
      }
      continue;
    }
    context.output.JsonLine(WithPlaces(*plan, earth));
  }
  return first_error;
}

void AddEndpoints(CLI::App* verb, const std::shared_ptr<PlanOptions>& options) {
  CLI::Option* from = AddNumbers(
      verb,
      "--from",
      "X,Y[,Z]",
      2,
      3,
      [options](const std::vector<double>& n) { options->query.from = EndpointOf(n); },
      "Start [m]; the surface nearest to Z, within the robot's height of it; without Z the lowest");
  CLI::Option* to = AddNumbers(
      verb,
      "--to",
      "X,Y[,Z]",
      2,
      3,
      [options](const std::vector<double>& n) { options->query.to = EndpointOf(n); },
      "Goal [m]; its surface as for --from");
  from->needs(to);
  to->needs(from);
  verb->add_option("--from-level", options->from_level, "Start on this surface, 0 = lowest")
      ->needs(from)
      ->check(CLI::NonNegativeNumber);
  verb->add_option("--to-level", options->to_level, "End on this surface, 0 = lowest")
      ->needs(to)
      ->check(CLI::NonNegativeNumber);
  verb->add_option(
          "--queries",
          options->queries_file,
          "File with X,Y,Z,X,Y,Z (start, goal) on each line; the answer is a JSON line each")
      ->type_name("FILE.csv")
      ->excludes(from)
      ->excludes(to);
}

}  // namespace

void AddPlanCommand(Commands& commands) {
  auto options = std::make_shared<PlanOptions>();
  CLI::App* verb =
      commands.Verb(&commands.root,
                    "plan",
                    "A path for a robot, or the reason why there is none",
                    "strata plan campus --from -14,0,0 --to 20,5,0 --radius 0.4 --out path.ply\n"
                    "  strata plan campus --from -14,0 --to 20,5 --avoid vegetation=5 "
                    "--avoid water=never\n"
                    "  strata plan campus --from -14,0 --to 20,5 --shape cart.stl",
                    [options](Context& context) {
                      return options->queries_file.empty() ? PlanOne(context, *options)
                                                           : PlanMany(context, *options);
                    });
  AddMapName(verb, options->map);
  AddEndpoints(verb, options);
  AddDriverOptions(verb, options->driver);
  AddShapeOptions(verb, options->shape);
  verb->add_option("--max-expanded", options->query.max_expanded, "Search limit: patches looked at")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  verb->add_option("--out",
                   options->out,
                   "Write the path, if there is one, as PLY: its waypoints as vertices in order, "
                   "joined by edges; map render --path reads it; or for Foxglove: /path")
      ->type_name("FILE.ply|FILE.mcap");
  verb->add_flag("--watch",
                 options->watch,
                 "Then say whenever the path stops to hold or holds again, until Ctrl-C")
      ->excludes("--queries");
  verb->parse_complete_callback([verb] {
    if (verb->count("--from") == 0 && verb->count("--queries") == 0) {
      throw CLI::RequiredError("--from and --to, or --queries");
    }
  });
}

}  // namespace strata::cli
