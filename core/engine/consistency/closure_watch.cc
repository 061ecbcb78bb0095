#include "core/engine/consistency/closure_watch.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "core/common/status.h"
#include "core/engine/consistency/closure_search.h"
#include "core/engine/consistency/optimize_settings.h"
#include "core/engine/scans/scan_views.h"

namespace strata {

std::size_t CountFreshContacts(const GraphWorld& world, std::size_t first_new) {
  std::vector<bool> joined(world.size(), false);  // the younger one to another pass
  for (const ScanPair& pair : world.Problem(DefaultOptimizeSettings()).pairs) {
    if (!pair.measured.has_value() || world.SamePass(pair.i, pair.j)) continue;
    joined[std::max(pair.i, pair.j)] = true;
  }
  std::size_t fresh = 0;
  for (std::size_t node = first_new; node < joined.size(); ++node) {
    if (!joined[node]) continue;
    const auto& [t, index] = world.PlaceOf(node);
    const auto here = world.Trajectories()[t].begin() + static_cast<std::ptrdiff_t>(index);
    const auto before = here - static_cast<std::ptrdiff_t>(std::min(index, GraphWorld::kPass));
    if (std::none_of(before, here, [&](std::size_t other) { return joined[other]; })) ++fresh;
  }
  return fresh;
}

absl::StatusOr<std::size_t> ClosureWatch::Look(const Stop& stop) {
  const MapView view = core_.snapshots().current();
  if (view == seen_.view) return 0;
  STRATA_ASSIGN_OR_RETURN(const GraphWorld world, GraphWorld::Read(core_));
  const auto& scans = world.Scans();
  const auto first_new = static_cast<std::size_t>(
      std::find_if(scans.begin(),
                   scans.end(),
                   [this](const ScanRecord& s) { return s.number > seen_.scan; }) -
      scans.begin());
  std::size_t found = 0;
  if (first_new < scans.size()) {
    found = CountFreshContacts(world, first_new);
    ScanViews views(ScanAccess(core_), scans);
    SilentContext context(stop);
    STRATA_ASSIGN_OR_RETURN(const ClosureSearch search,
                            SearchClosures(world,
                                           views,
                                           first_new,
                                           DefaultOptimizeSettings(),
                                           core_.options().worker_threads,
                                           context));
    found += search.closures.size();
    seen_.scan = scans.back().number;
  }
  seen_.view = view;
  return found;
}

}  // namespace strata
