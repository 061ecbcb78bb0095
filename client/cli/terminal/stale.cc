#include "client/cli/terminal/stale.h"

#include <algorithm>
#include <vector>

#include "absl/strings/str_cat.h"

#include "core/common/status.h"

namespace strata::cli {

absl::StatusOr<bool> IsOfEarlierState(Context& context,
                                      const std::string& map,
                                      const LookedAt& looked_at,
                                      absl::string_view what,
                                      absl::string_view cure) {
  STRATA_ASSIGN_OR_RETURN(const std::vector<EpochInfo> epochs,
                          context.database.maps().History(context.call, map));
  const auto now = std::find_if(
      epochs.begin(), epochs.end(), [](const EpochInfo& each) { return each.current; });
  if (now != epochs.end() && now->epoch != looked_at.epoch) {
    context.output.Talk(absl::StrCat(
        what, " of epoch ", looked_at.epoch, ", the map is at ", now->epoch, "; ", cure));
    return true;
  }
  if (looked_at.scans == 0) return false;
  STRATA_ASSIGN_OR_RETURN(const MapStats stats, context.database.maps().Stats(context.call, map));
  if (stats.scans >= looked_at.scans) return false;
  context.output.Talk(
      absl::StrCat(what, " of ", looked_at.scans, " scans, the map has ", stats.scans, "; ", cure));
  return true;
}

}  // namespace strata::cli
