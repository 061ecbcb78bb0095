#include "client/cli/terminal/stale.h"

#include <algorithm>
#include <vector>

#include "absl/strings/str_cat.h"

#include "core/common/status.h"

namespace strata::cli {

absl::StatusOr<bool> IsOfEarlierEpoch(Context& context,
                                      const std::string& map,
                                      std::uint64_t epoch,
                                      absl::string_view what,
                                      absl::string_view cure) {
  STRATA_ASSIGN_OR_RETURN(const std::vector<EpochInfo> epochs,
                          context.database.maps().History(context.call, map));
  const auto now = std::find_if(
      epochs.begin(), epochs.end(), [](const EpochInfo& each) { return each.current; });
  if (now == epochs.end() || now->epoch == epoch) return false;
  context.output.Talk(
      absl::StrCat(what, " of epoch ", epoch, ", the map is at ", now->epoch, "; ", cure));
  return true;
}

}  // namespace strata::cli
