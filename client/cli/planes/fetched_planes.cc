#include "client/cli/planes/fetched_planes.h"

#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "client/cli/terminal/stale.h"
#include "core/common/status.h"

namespace strata::cli {

absl::StatusOr<FetchedPlanes> FetchPlanes(Context& context, const std::string& map) {
  FetchedPlanes planes;
  absl::StatusOr<PlaneModelInfo> info = context.database.models().GetPlaneModel(
      context.call, map, [&planes](const ModelPlane& plane) {
        planes.model.planes.push_back(plane);
        return absl::OkStatus();
      });
  STRATA_RETURN_IF_ERROR(info.status());
  planes.info = *std::move(info);
  planes.model.directions = planes.info.directions;
  STRATA_ASSIGN_OR_RETURN(planes.stale,
                          IsOfEarlierState(context,
                                           map,
                                           {planes.info.epoch, planes.info.scans},
                                           "these planes are",
                                           "planes find makes them anew"));
  return planes;
}

}  // namespace strata::cli
