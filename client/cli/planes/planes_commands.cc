// strata planes list|find|model|export
#include <cstddef>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

#include "client/cli/job/job_runner.h"
#include "client/cli/planes/fetched_planes.h"
#include "client/cli/terminal/arguments.h"
#include "client/cli/terminal/command.h"
#include "client/cli/terminal/world_json.h"
#include "client/formats/planes/plane_model_file.h"
#include "core/common/status.h"
#include "core/world/job_kinds.h"

namespace strata::cli {
namespace {

struct PlanesOptions {
  std::string map;
  JobParameters parameters;
  bool wait = false;
  std::string out;
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

void PrintDirections(const PlaneModelInfo& info, Output& output) {
  for (std::size_t k = 0; k < info.directions.size(); ++k) {
    const MainDirection& one = info.directions[k];
    output.Text(absl::StrFormat("direction %d: %.4f %.4f %.4f, %d planes",
                                k,
                                one.direction.x(),
                                one.direction.y(),
                                one.direction.z(),
                                one.planes));
  }
}

absl::Status Model(Context& context, const PlanesOptions& options) {
  STRATA_ASSIGN_OR_RETURN(const FetchedPlanes fetched, FetchPlanes(context, options.map));
  Json planes = Json::array();
  for (const ModelPlane& plane : fetched.model.planes) planes.push_back(ToJson(plane));
  if (context.output.json()) {
    Json model = ToJson(fetched.info);
    model["stale"] = fetched.stale;
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
  PrintDirections(fetched.info, context.output);
  return absl::OkStatus();
}

absl::Status Export(Context& context, const PlanesOptions& options) {
  STRATA_ASSIGN_OR_RETURN(const FetchedPlanes fetched, FetchPlanes(context, options.map));
  STRATA_ASSIGN_OR_RETURN(const MapInfo info,
                          context.database.maps().Get(context.call, options.map));
  STRATA_RETURN_IF_ERROR(WritePlaneModel(options.out, fetched.model, info.parameters.origin));
  context.output.Object({{"file", options.out},
                         {"planes", fetched.model.planes.size()},
                         {"epoch", fetched.info.epoch},
                         {"stale", fetched.stale}});
  return absl::OkStatus();
}

}  // namespace

void AddPlanesCommands(Commands& commands) {
  auto options = std::make_shared<PlanesOptions>();
  CLI::App* noun = commands.Noun(
      "planes", "Walls, floors and roofs of a map", "strata planes find campus --wait");
  const auto verb = MapVerbs(commands, noun, options);
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
  verb("export",
       "These planes for CAD, GIS and viewers: GeoJSON on earth where the map has an origin, DXF "
       "with walls, levels and slopes on layers, triangles",
       "strata planes export campus walls.dxf",
       Export)
      ->add_option("FILE", options->out, "Where to, by its ending")
      ->type_name("FILE.(geojson|dxf|ply|obj|glb)")
      ->required();
}

}  // namespace strata::cli
