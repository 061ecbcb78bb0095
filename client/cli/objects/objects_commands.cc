// strata objects find|list|show|complete|export
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include <Eigen/Geometry>

#include "client/cli/job/job_runner.h"
#include "client/cli/objects/entity_files.h"
#include "client/cli/objects/fetched_entities.h"
#include "client/cli/objects/fetched_inferred.h"
#include "client/cli/terminal/arguments.h"
#include "client/cli/terminal/command.h"
#include "client/cli/terminal/json.h"
#include "client/cli/terminal/names.h"
#include "client/cli/terminal/on_earth.h"
#include "core/common/status.h"
#include "core/world/job_kinds.h"
#include "core/world/things/kind.h"

namespace strata::cli {
namespace {

struct ObjectsOptions {
  std::string map;
  JobParameters parameters;
  bool wait = false;
  std::string class_name;
  std::string kind;
  std::optional<Eigen::AlignedBox3d> region;
  std::uint64_t id = 0;
  std::string out;
  bool inferred = false;
};

absl::StatusOr<FetchedEntities> FetchChosen(Context& context, const ObjectsOptions& options) {
  return FetchEntities(
      context, options.map, {.region = options.region, .kind = options.kind}, options.class_name);
}

absl::Status FindObjects(Context& context, const ObjectsOptions& options) {
  return StartJob(context, options.map, kObjectsJob, options.parameters, options.wait);
}

absl::Status CompleteObjects(Context& context, const ObjectsOptions& options) {
  return StartJob(context, options.map, kCompleteJob, options.parameters, options.wait);
}

Json SearchJson(const FetchedEntities& fetched) {
  Json distances = Json::object();
  for (const ClassReach& reach : fetched.info.reaches) {
    distances[ClassOf(fetched.classes, reach.class_id).name] = reach.distance_m;
  }
  return {{"job", fetched.info.job},
          {"epoch", fetched.info.epoch},
          {"made", TimeText(fetched.info.made)},
          {"stale", fetched.stale},
          {"scans", fetched.info.scans},
          {"points", fetched.info.points},
          {"distance_m", distances}};
}

absl::Status ListObjects(Context& context, const ObjectsOptions& options) {
  STRATA_ASSIGN_OR_RETURN(const FetchedEntities fetched, FetchChosen(context, options));
  Json entities = Json::array();
  for (const Entity& entity : fetched.entities) {
    entities.push_back(EntityJson(entity, fetched.classes));
  }
  if (context.output.json()) {
    Json all = SearchJson(fetched);
    all["entities"] = std::move(entities);
    context.output.Object(all);
    return absl::OkStatus();
  }
  for (std::size_t i = 0; i < entities.size(); ++i) {
    entities[i]["seen_by"] = entities[i]["scans"].size();
    entities[i]["kind"] = KindText(fetched.entities[i]);
  }
  context.output.List(entities,
                      {{"id", "ID"},
                       {"class", "CLASS"},
                       {"kind", "KIND"},
                       {"centre", "CENTRE"},
                       {"size_m", "SIZE"},
                       {"yaw_rad", "YAW"},
                       {"points", "POINTS"},
                       {"seen_by", "SCANS"}});
  return absl::OkStatus();
}

absl::Status ShowObject(Context& context, const ObjectsOptions& options) {
  STRATA_ASSIGN_OR_RETURN(const FetchedEntities fetched, FetchChosen(context, options));
  const auto found = std::find_if(fetched.entities.begin(),
                                  fetched.entities.end(),
                                  [&](const Entity& entity) { return entity.id == options.id; });
  if (found == fetched.entities.end()) {
    return absl::NotFoundError(
        absl::StrCat("map ", options.map, ": no entity ", options.id, "; see objects list"));
  }
  Json entity = EntityJson(*found, fetched.classes);
  Json base = Json::array();
  for (const Eigen::Vector3d& p : BaseOf(found->box)) base.push_back(ToJson(p));
  entity["base"] = std::move(base);
  STRATA_ASSIGN_OR_RETURN(const std::optional<LocalFrame> earth, EarthOf(context, options.map));
  if (earth.has_value()) AddPlaceOnEarth(*earth, found->box.centre, entity);
  context.output.Object(entity);
  return absl::OkStatus();
}

absl::Status ExportInferred(Context& context, const ObjectsOptions& options) {
  STRATA_ASSIGN_OR_RETURN(const FetchedInferred fetched,
                          FetchInferred(context,
                                        options.map,
                                        {.region = options.region, .kind = options.kind},
                                        options.class_name));
  STRATA_RETURN_IF_ERROR(WriteInferred(options.out, fetched));
  Json exported = {{"file", options.out},
                   {"points", fetched.points},
                   {"entities", fetched.parts.size()},
                   {"epoch", fetched.info.epoch},
                   {"stale", fetched.stale}};
  Json parts = Json::array();
  for (const InferredPart& part : fetched.parts) {
    parts.push_back({{"entity", part.entity},
                     {"kind", KindIdText(part.kind)},
                     {"points", part.points.size()},
                     {"agreeing", part.agreeing},
                     {"contradicting", part.contradicting}});
  }
  // Hundreds, which nobody reads on a line.
  if (context.output.json()) exported["parts"] = std::move(parts);
  context.output.Object(exported);
  return absl::OkStatus();
}

absl::Status ExportObjects(Context& context, const ObjectsOptions& options) {
  if (options.inferred) return ExportInferred(context, options);
  STRATA_ASSIGN_OR_RETURN(const FetchedEntities fetched, FetchChosen(context, options));
  STRATA_ASSIGN_OR_RETURN(const std::optional<LocalFrame> earth, EarthOf(context, options.map));
  STRATA_RETURN_IF_ERROR(WriteEntities(options.out, fetched, earth));
  context.output.Object({{"file", options.out},
                         {"entities", fetched.entities.size()},
                         {"epoch", fetched.info.epoch},
                         {"stale", fetched.stale}});
  return absl::OkStatus();
}

void AddChoice(CLI::App* verb, ObjectsOptions& options) {
  verb->add_option("--class", options.class_name, "Only this class, by name or number");
  TakesName(verb->add_option(
                "--kind", options.kind, "Only those of this kind, by name or first digits of id"),
            kKindNames);
  AddRegion(verb, options.region);
}

}  // namespace

void AddObjectsCommands(Commands& commands) {
  auto options = std::make_shared<ObjectsOptions>();
  CLI::App* noun = commands.Noun("objects",
                                 "The things in a map: cars, benches, windows",
                                 "strata objects find campus --wait");
  const auto verb = MapVerbs(commands, noun, options);
  CLI::App* find = verb("find",
                        "Find the things that points with a class make up, across scans, in place "
                        "of those found before, and which of them are the same (job objects); map "
                        "render --objects draws them",
                        "strata objects find campus class=car --wait",
                        FindObjects);
  AddJobParameters(find, options->parameters);
  AddWait(find, options->wait);
  find->footer(absl::StrCat(find->get_footer(),
                            "\n\nParameters:\n",
                            JobParametersText(*FindJobKind(kObjectsJob).value())));
  CLI::App* complete = verb("complete",
                            "Infer what nobody saw of things by what others of their kinds look "
                            "like, after objects find (job complete); objects export --inferred "
                            "and map render --inferred show it",
                            "strata objects complete campus --wait",
                            CompleteObjects);
  AddJobParameters(complete, options->parameters);
  AddWait(complete, options->wait);
  complete->footer(absl::StrCat(complete->get_footer(),
                                "\n\nParameters:\n",
                                JobParametersText(*FindJobKind(kCompleteJob).value())));
  AddChoice(verb("list",
                 "The things that objects find found, by class and falling number of points: the "
                 "middle and length, width and height of the box around each [m]",
                 "strata objects list campus --class car --output json",
                 ListObjects),
            *options);
  verb("show",
       "One of them: its box, and how many points of it each scan saw",
       "strata objects show campus 7",
       ShowObject)
      ->add_option("ID", options->id, "As objects list has it")
      ->required();
  CLI::App* out = verb("export",
                       "Their boxes for GIS and tables: GeoJSON on earth where the map has an "
                       "origin, or CSV; with --inferred the points that objects complete added, "
                       "the entity's id as label",
                       "strata objects export campus things.geojson --class car",
                       ExportObjects);
  out->add_option("FILE", options->out, "Where to, by its ending")
      ->type_name("FILE.(geojson|csv|ply|pcd)")
      ->required();
  out->add_flag("--inferred", options->inferred, "What was inferred, as PLY or PCD");
  AddChoice(out, *options);
}

}  // namespace strata::cli
