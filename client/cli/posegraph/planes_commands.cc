// strata planes list
#include <memory>
#include <string>
#include <vector>

#include "client/cli/terminal/arguments.h"
#include "client/cli/terminal/command.h"
#include "client/cli/terminal/world_json.h"
#include "core/common/status.h"

namespace strata::cli {
namespace {

absl::Status List(Context& context, const std::string& map) {
  STRATA_ASSIGN_OR_RETURN(const api::PoseGraphState state,
                          context.database.posegraph().Get(context.call, map));
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

}  // namespace

void AddPlanesCommands(Commands& commands) {
  auto map = std::make_shared<std::string>();
  CLI::App* noun = commands.Noun(
      "planes", "Walls, floors and roofs that many scans see", "strata planes list campus");
  CLI::App* list =
      commands.Verb(noun,
                    "list",
                    "The planes that optimize holds scans against; posegraph disable switches one "
                    "off. WEIGHT is the area [m2] or length of edges [m] that the scans see",
                    "strata planes list campus --output json",
                    [map](Context& context) { return List(context, *map); });
  AddMapName(list, *map);
}

}  // namespace strata::cli
