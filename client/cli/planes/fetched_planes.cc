#include "client/cli/planes/fetched_planes.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

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
  STRATA_ASSIGN_OR_RETURN(const std::vector<EpochInfo> epochs,
                          context.database.maps().History(context.call, map));
  const auto now = std::find_if(
      epochs.begin(), epochs.end(), [](const EpochInfo& epoch) { return epoch.current; });
  planes.stale = now != epochs.end() && now->epoch != planes.info.epoch;
  if (planes.stale) {
    context.output.Talk(absl::StrCat("these planes are of epoch ",
                                     planes.info.epoch,
                                     ", the map is at ",
                                     now->epoch,
                                     "; planes find makes them anew"));
  }
  return planes;
}

}  // namespace strata::cli
