#include "core/engine/closure_watch.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "core/common/status.h"
#include "core/engine/closure_search.h"
#include "core/engine/optimize_settings.h"
#include "core/engine/scan_views.h"

namespace strata {
namespace {

// Scans so near each other on one trajectory are of one pass.
constexpr std::size_t kSamePass = 10;

struct Place {
  std::size_t trajectory = 0;
  std::size_t place = 0;
};

std::vector<Place> PlacesOf(const GraphWorld& world) {
  std::vector<Place> places(world.size());
  for (std::size_t t = 0; t < world.Trajectories().size(); ++t) {
    const std::vector<std::size_t>& trajectory = world.Trajectories()[t];
    for (std::size_t k = 0; k < trajectory.size(); ++k) places[trajectory[k]] = {t, k};
  }
  return places;
}

bool SamePass(const Place& a, const Place& b) {
  return a.trajectory == b.trajectory &&
         std::max(a.place, b.place) - std::min(a.place, b.place) <= kSamePass;
}

}  // namespace

std::size_t CountFreshContacts(const GraphWorld& world, std::size_t first_new) {
  const std::vector<Place> places = PlacesOf(world);
  std::vector<bool> joined(world.size(), false);  // the younger one to another pass
  for (const ScanPair& pair : world.Problem({}).pairs) {
    if (!pair.measured.has_value() || SamePass(places[pair.i], places[pair.j])) continue;
    joined[std::max(pair.i, pair.j)] = true;
  }
  std::size_t fresh = 0;
  for (std::size_t node = first_new; node < joined.size(); ++node) {
    if (!joined[node]) continue;
    const auto [t, place] = places[node];
    const std::vector<std::size_t>& trajectory = world.Trajectories()[t];
    const auto here = trajectory.begin() + static_cast<std::ptrdiff_t>(place);
    const auto before = here - static_cast<std::ptrdiff_t>(std::min(place, kSamePass));
    if (std::none_of(before, here, [&](std::size_t other) { return joined[other]; })) ++fresh;
  }
  return fresh;
}

absl::StatusOr<std::size_t> ClosureWatch::Look(const Stop& stop) {
  const MapView view = core_.snapshots().current();
  if (view == seen_view_) return 0;
  STRATA_ASSIGN_OR_RETURN(const GraphWorld world, GraphWorld::Read(core_));
  const auto& scans = world.Scans();
  const auto first_new = static_cast<std::size_t>(
      std::find_if(
          scans.begin(), scans.end(), [this](const ScanRecord& s) { return s.number > seen_; }) -
      scans.begin());
  std::size_t found = 0;
  if (first_new < scans.size()) {
    found = CountFreshContacts(world, first_new);
    ScanViews views(core_, scans);
    SilentContext context(stop);
    STRATA_ASSIGN_OR_RETURN(
        const ClosureSearch search,
        SearchClosures(world, views, first_new, {}, core_.options().worker_threads, context));
    found += search.closures.size();
    seen_ = scans.back().number;
  }
  seen_view_ = view;
  return found;
}

}  // namespace strata
