// strata posegraph show|add-constraint|remove-constraint|enable|disable; those that read and write
// files have files of their own.
#include <algorithm>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"

#include "client/cli/posegraph/constraint_residual.h"
#include "client/cli/posegraph/posegraph_files.h"
#include "client/cli/terminal/angles.h"
#include "client/cli/terminal/arguments.h"
#include "client/cli/terminal/command.h"
#include "client/cli/terminal/confirm.h"
#include "client/cli/terminal/world_json.h"
#include "core/common/status.h"

namespace strata::cli {
namespace {

// The word that stands for the map itself where a scan is expected.
constexpr char kMapItself[] = "map";

struct PoseGraphOptions {
  std::string map;
  bool worst = false;
  std::uint64_t id = 0;
  Constraint constraint;
  bool position_only = false;
  double sigma_m = 0.05;
  double sigma_rad = 0.01;
  bool yes = false;
};

Json Row(const ConstraintResidual& residual) {
  Json json = ToJson(*residual.constraint);
  if (residual.constraint->is_prior()) json["i"] = kMapItself;
  json["chi2"] = residual.normalised_chi2;
  json["residual_m"] = residual.translation_m;
  json["residual_rad"] = residual.rotation_rad;
  return json;
}

// How many constraints there are of each origin, and how many are switched off.
Json Summary(const api::PoseGraphState& state) {
  std::map<std::string, int> origins;
  int priors = 0;
  int disabled = 0;
  for (const Constraint& constraint : state.constraints) {
    ++origins[ToString(constraint.origin)];
    if (constraint.is_prior()) ++priors;
    if (!constraint.enabled) ++disabled;
  }
  return {{"epoch", state.epoch},
          {"scans", state.nodes.size()},
          {"constraint_count", state.constraints.size()},
          {"by_origin", origins},
          {"priors", priors},
          {"disabled", disabled},
          {"planes", state.planes.size()}};
}

absl::Status Show(Context& context, const PoseGraphOptions& options) {
  STRATA_ASSIGN_OR_RETURN(const api::PoseGraphState state,
                          context.database.posegraph().Get(context.call, options.map));
  std::vector<ConstraintResidual> residuals = ResidualsOf(state);
  if (options.worst) {
    std::stable_sort(residuals.begin(), residuals.end(), [](const auto& a, const auto& b) {
      return a.normalised_chi2 > b.normalised_chi2;
    });
  }
  Json rows = Json::array();
  for (const ConstraintResidual& residual : residuals) rows.push_back(Row(residual));
  Json summary = Summary(state);
  if (context.output.json()) {
    summary["constraints"] = rows;
    context.output.Object(summary);
    return absl::OkStatus();
  }
  context.output.Object(summary);
  context.output.Text("");
  context.output.List(rows,
                      {{"id", "ID"},
                       {"i", "FROM"},
                       {"j", "TO"},
                       {"origin", "ORIGIN"},
                       {"enabled", "ENABLED"},
                       {"may_be_false", "MAY BE FALSE"},
                       {"residual_m", "RESIDUAL [M]"},
                       {"residual_rad", "TURN"},
                       {"chi2", "CHI2"},
                       {"note", "NOTE"}});
  return absl::OkStatus();
}

absl::Status AddConstraint(Context& context, PoseGraphOptions options) {
  Vector6d information;
  information.head<3>().setConstant(
      options.position_only ? 0.0 : 1.0 / (options.sigma_rad * options.sigma_rad));
  information.tail<3>().setConstant(1.0 / (options.sigma_m * options.sigma_m));
  options.constraint.information = information.asDiagonal();
  options.constraint.origin = ConstraintOrigin::kPerson;
  STRATA_ASSIGN_OR_RETURN(
      const Constraint added,
      context.database.posegraph().AddConstraint(context.call, options.map, options.constraint));
  context.output.Object(ToJson(added));
  return absl::OkStatus();
}

absl::Status RemoveConstraint(Context& context, const PoseGraphOptions& options) {
  STRATA_RETURN_IF_ERROR(Confirm(
      options.yes,
      absl::StrCat("take constraint ", options.id, " out of map ", options.map, " for good?")));
  STRATA_RETURN_IF_ERROR(
      context.database.posegraph().RemoveConstraint(context.call, options.map, options.id));
  context.output.Object({{"removed", options.id}});
  return absl::OkStatus();
}

absl::Status Enable(Context& context, const PoseGraphOptions& options, bool enabled) {
  STRATA_RETURN_IF_ERROR(context.database.posegraph().EnableConstraint(
      context.call, options.map, options.id, enabled));
  context.output.Object({{"id", options.id}, {"enabled", enabled}});
  return absl::OkStatus();
}

// A positional argument that takes a scan, and, if `or_map`, the word "map".
void AddEnd(
    CLI::App* app, const std::string& name, ScanId& id, bool or_map, const std::string& text) {
  app->add_option_function<std::string>(
         name,
         [name, &id, or_map](const std::string& word) {
           if (or_map && word == kMapItself) return;
           const absl::Status status = ParseScanId(word, id);
           if (!status.ok()) throw CLI::ValidationError(name, std::string(status.message()));
         },
         text)
      ->type_name(or_map ? "TRAJECTORY/SEQUENCE|map" : "TRAJECTORY/SEQUENCE")
      ->required();
}

void AddAddConstraint(Commands& commands,
                      CLI::App* noun,
                      const std::shared_ptr<PoseGraphOptions>& options) {
  CLI::App* app = commands.Verb(
      noun,
      "add-constraint",
      "Say where a scan is against another one, or in the map; optimize uses it",
      "strata posegraph add-constraint campus segway/12 segway/480 --pose 0.2,1,0,0.1",
      [options](Context& context) { return AddConstraint(context, *options); });
  AddMapName(app, options->map);
  AddEnd(
      app, "FROM", options->constraint.i, true, "The scan to measure from, or map (GPS, a mark)");
  AddEnd(app, "TO", options->constraint.j, false, "The scan that is said to be there");
  AddPose(
      app,
      "--pose",
      [options](const Pose& pose, std::size_t numbers) {
        options->constraint.T_i_j = pose;
        options->position_only = numbers == 3;
      },
      "Pose of TO's frame in FROM's [m, degrees]; X,Y,Z alone says nothing about the rotation")
      ->required();
  app->add_option("--sigma-m", options->sigma_m, "Standard deviation of the place [m]")
      ->check(CLI::Range(1e-6, 1e6))
      ->capture_default_str();
  TakesAngle(app->add_option(
                 "--sigma-rad", options->sigma_rad, "Standard deviation of the rotation [rad]"),
             AngleUnit::kRadians)
      ->check(CLI::Range(1e-6, 10.0))
      ->capture_default_str();
  app->add_flag("--may-be-false",
                options->constraint.may_be_false,
                "Optimize may reject it if everything else contradicts it");
  app->add_option("--note", options->constraint.note, "For people: how it is known");
}

}  // namespace

void AddPosegraphCommands(Commands& commands) {
  auto options = std::make_shared<PoseGraphOptions>();
  CLI::App* noun = commands.Noun(
      "posegraph", "What holds the scans in their places", "strata posegraph show campus --worst");
  const auto verb = MapVerbs(commands, noun, options);
  verb("show",
       "The constraints and how well the poses keep them: chi2 is about 1 where noise is all",
       "strata posegraph show campus --worst",
       Show)
      ->add_flag("--worst", options->worst, "Those that are kept worst first");
  AddAddConstraint(commands, noun, options);
  const auto with_id = [&](CLI::App* app) {
    app->add_option("ID", options->id, "Number of the constraint or plane")
        ->check(CLI::PositiveNumber)
        ->required();
    return app;
  };
  AddYes(with_id(verb("remove-constraint",
                      "Take a constraint out for good",
                      "strata posegraph remove-constraint campus 17",
                      RemoveConstraint)),
         options->yes);
  with_id(
      verb("disable",
           "Switch a constraint or a plane off for the jobs to come",
           "strata posegraph disable campus 17",
           [](Context& context, const PoseGraphOptions& o) { return Enable(context, o, false); }));
  with_id(
      verb("enable",
           "Switch a constraint or a plane on again",
           "strata posegraph enable campus 17",
           [](Context& context, const PoseGraphOptions& o) { return Enable(context, o, true); }));
  AddPosegraphExchange(commands, noun);
  AddPosegraphOptimize(commands, noun);
  AddPosegraphTrack(commands, noun);
}

}  // namespace strata::cli
