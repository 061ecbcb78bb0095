// strata planes list|find|model
#include <algorithm>
#include <cstddef>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

#include "client/cli/job/job_runner.h"
#include "client/cli/terminal/arguments.h"
#include "client/cli/terminal/command.h"
#include "client/cli/terminal/world_json.h"
#include "core/common/status.h"
#include "core/world/job_kinds.h"

namespace strata::cli {
namespace {

struct PlanesOptions {
  std::string map;
  JobParameters parameters;
  bool wait = false;
};

absl::Status List(Context& context, const PlanesOptions& options) {
  STRATA_ASSIGN_OR_RETURN(const api::PoseGraphState state,
                          context.database.posegraph().Get(context.call, options.map));
  Json rows = Json::array();
  for (const GlobalPlane& plane : state.planes) {
    rows.push_back(ToJson(plane));
  }
  context.output.List(rows,
                      {{"id", "ID"},
                       {"kind", "KIND"},
                       {"normal", "NORMAL"},
                       {"distance_m", "DISTANCE"},
                       {"from", "FROM"},
                       {"supporters", "SCANS"},
                       {"weight", "WEIGHT"},
                       {"enabled", "ENABLED"},
                       {"note", "NOTE"}});
  return absl::OkStatus();
}

absl::Status Find(Context& context, const PlanesOptions& options) {
  return StartJob(context, options.map, kPlanesJob, options.parameters, options.wait);
}

// What a table shows in place of polygons.
Json RowOf(Json plane) {
  std::size_t holes = 0;
  for (const Json& polygon : plane["polygons"]) holes += polygon["holes"].size();
  plane["pieces"] = plane["polygons"].size();
  plane["holes"] = holes;
  return plane;
}

absl::Status Model(Context& context, const PlanesOptions& options) {
  Json planes = Json::array();
  STRATA_ASSIGN_OR_RETURN(const PlaneModelInfo info,
                          context.database.models().GetPlaneModel(
                              context.call, options.map, [&](const ModelPlane& plane) {
                                planes.push_back(ToJson(plane));
                                return absl::OkStatus();
                              }));
  STRATA_ASSIGN_OR_RETURN(const std::vector<EpochInfo> epochs,
                          context.database.maps().History(context.call, options.map));
  const auto now = std::find_if(
      epochs.begin(), epochs.end(), [](const EpochInfo& epoch) { return epoch.current; });
  const bool stale = now != epochs.end() && now->epoch != info.epoch;
  if (context.output.json()) {
    Json model = ToJson(info);
    model["stale"] = stale;
    model["planes"] = std::move(planes);
    context.output.Object(model);
    return absl::OkStatus();
  }
  Json rows = Json::array();
  for (Json& plane : planes) rows.push_back(RowOf(std::move(plane)));
  context.output.List(rows,
                      {{"id", "ID"},
                       {"kind", "KIND"},
                       {"normal", "NORMAL"},
                       {"distance_m", "DISTANCE"},
                       {"direction", "DIRECTION"},
                       {"area_m2", "AREA"},
                       {"rms_m", "RMS"},
                       {"pieces", "PIECES"},
                       {"holes", "HOLES"}});
  for (std::size_t k = 0; k < info.directions.size(); ++k) {
    const MainDirection& one = info.directions[k];
    context.output.Text(absl::StrFormat("direction %d: %.4f %.4f %.4f, %d planes",
                                        k,
                                        one.direction.x(),
                                        one.direction.y(),
                                        one.direction.z(),
                                        one.planes));
  }
  if (stale) {
    context.output.Talk(absl::StrCat("these planes are of epoch ",
                                     info.epoch,
                                     ", the map is at ",
                                     now->epoch,
                                     "; planes find makes them anew"));
  }
  return absl::OkStatus();
}

}  // namespace

void AddPlanesCommands(Commands& commands) {
  auto options = std::make_shared<PlanesOptions>();
  CLI::App* noun = commands.Noun(
      "planes", "Walls, floors and roofs of a map", "strata planes find campus --wait");
  const auto verb = [&](const char* name, const char* description, const char* example, auto run) {
    CLI::App* app =
        commands.Verb(noun, name, description, example, [options, run](Context& context) {
          return run(context, *options);
        });
    AddMapName(app, options->map);
    return app;
  };
  verb("list",
       "The planes that optimize holds scans against; posegraph disable switches one off. WEIGHT "
       "is the area [m2] or length of edges [m] that the scans see",
       "strata planes list campus --output json",
       List);
  CLI::App* find = verb("find",
                        "Find the flat surfaces of the map, their main directions and outlines, in "
                        "place of those found before (job planes)",
                        "strata planes find campus min_area_m2=4 --wait",
                        Find);
  AddJobParameters(find, options->parameters);
  AddWait(find, options->wait);
  find->footer(absl::StrCat(find->get_footer(),
                            "\n\nParameters:\n",
                            JobParametersText(*FindJobKind(kPlanesJob).value())));
  verb("model",
       "The planes that planes find found, by falling area; with --output json, their outlines "
       "with holes, too",
       "strata planes model campus --output json",
       Model);
}

}  // namespace strata::cli
