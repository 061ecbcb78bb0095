// strata path check|watch
#include "client/cli/plan/path_commands.h"

#include <memory>

#include "absl/status/statusor.h"

#include "client/cli/plan/driver_options.h"
#include "client/cli/plan/shape_options.h"
#include "client/cli/terminal/arguments.h"
#include "client/cli/terminal/json.h"
#include "client/formats/path_file.h"
#include "core/common/status.h"

namespace strata::cli {
namespace {

struct PathOptions {
  std::string map;
  std::string file;
  DriverOptions driver;
  ShapeOptions shape;
};

absl::StatusOr<PathQuery> QueryOf(Context& context, const PathOptions& options) {
  PathQuery query;
  STRATA_ASSIGN_OR_RETURN(query.waypoints, ReadPath(options.file));
  STRATA_ASSIGN_OR_RETURN(query.profile, ProfileOf(context, options.map, options.driver));
  STRATA_ASSIGN_OR_RETURN(query.class_costs, ClassCostsOf(context, options.map, options.driver));
  query.inferred = options.driver.inferred;
  return query;
}

absl::Status Check(Context& context, const PathOptions& options) {
  STRATA_ASSIGN_OR_RETURN(const PathQuery query, QueryOf(context, options));
  STRATA_ASSIGN_OR_RETURN(const PathCheck check,
                          context.database.planning().CheckPath(context.call, options.map, query));
  Json json = ToJson(check);
  if (!options.shape.given()) {
    context.output.Object(json);
    return absl::OkStatus();
  }
  STRATA_ASSIGN_OR_RETURN(
      const ShapeCheck shape,
      CheckShape(
          context, options.map, options.shape, query.profile, query.inferred, query.waypoints));
  if (!context.output.text()) json["shape"] = ToJson(shape);
  context.output.Object(json);
  if (context.output.text()) PrintText(shape, context.output);
  return absl::OkStatus();
}

absl::Status Watch(Context& context, const PathOptions& options) {
  STRATA_ASSIGN_OR_RETURN(const PathQuery query, QueryOf(context, options));
  return FollowPath(context, options.map, query);
}

}  // namespace

absl::Status FollowPath(Context& context, const std::string& map, const PathQuery& query) {
  const absl::Status ended = context.database.planning().WatchPath(
      context.call, map, query, [&context](const PathCheck& check) {
        if (context.output.text()) {
          context.output.Verdict(check.message, check.valid);
        } else {
          context.output.JsonLine(ToJson(check));
        }
        return absl::OkStatus();
      });
  // A watch without an end is ended by its user.
  return context.call.stop.requested() ? absl::OkStatus() : ended;
}

void AddPathCommands(Commands& commands) {
  auto options = std::make_shared<PathOptions>();
  CLI::App* noun =
      commands.Noun("path", "Paths that there are already", "strata path check campus route.ply");
  const auto map_verb = MapVerbs(commands, noun, options);
  const auto verb = [&](const char* name, const char* description, const char* example, auto run) {
    CLI::App* app = map_verb(name, description, example, run);
    app->add_option("FILE", options->file, "PLY file of the path, as plan --out writes it")
        ->type_name("FILE.ply")
        ->required();
    AddDriverOptions(app, options->driver);
    return app;
  };
  CLI::App* check = verb("check",
                         "Whether a path may still be driven, and where it may not",
                         "strata path check campus route.ply --radius 0.4\n"
                         "  strata path check campus route.ply --shape cart.stl --clearance 0.05",
                         Check);
  AddShapeOptions(check, options->shape);
  verb("watch",
       "Say whether a path may be driven, and whenever that changes, until Ctrl-C",
       "strata path watch campus route.ply --output json",
       Watch);
}

}  // namespace strata::cli
