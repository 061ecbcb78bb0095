#include "core/mls/difference.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <tuple>

namespace strata {
namespace {

using Surfaces = std::span<const Surface>;
using Kind = SurfaceChange::Kind;

// The surfaces of the cell with which `rest` begins, which are taken off it; none unless that is
// `cell`.
Surfaces TakeCell(Surfaces& rest, std::uint16_t cell) {
  std::size_t count = 0;
  while (count < rest.size() && rest[count].cell == cell) ++count;
  const Surfaces taken = rest.first(count);
  rest = rest.subspan(count);
  return taken;
}

SurfaceChange ChangeOf(const Surface& earlier, const Surface& later) {
  const double rise_m = static_cast<double>(later.z_m) - static_cast<double>(earlier.z_m);
  const double sigma_m =
      std::hypot(static_cast<double>(earlier.sigma_m), static_cast<double>(later.sigma_m));
  const bool moved = std::abs(rise_m) >= kLeastRiseM && std::abs(rise_m) > 3.0 * sigma_m;
  return {moved ? Kind::kMoved : Kind::kSame, later, static_cast<float>(rise_m)};
}

void CompareCells(Surfaces earlier,
                  Surfaces later,
                  double gap_size_m,
                  std::vector<SurfaceChange>& changes) {
  std::vector<std::tuple<double, std::size_t, std::size_t>> pairs;
  for (std::size_t i = 0; i < earlier.size(); ++i) {
    for (std::size_t j = 0; j < later.size(); ++j) {
      const double apart =
          std::abs(static_cast<double>(later[j].z_m) - static_cast<double>(earlier[i].z_m));
      if (apart < gap_size_m) pairs.emplace_back(apart, i, j);
    }
  }
  std::sort(pairs.begin(), pairs.end());
  std::vector<bool> earlier_taken(earlier.size());
  std::vector<bool> later_taken(later.size());
  const auto begin = static_cast<std::ptrdiff_t>(changes.size());
  for (const auto& [apart, i, j] : pairs) {
    if (earlier_taken[i] || later_taken[j]) continue;
    earlier_taken[i] = later_taken[j] = true;
    changes.push_back(ChangeOf(earlier[i], later[j]));
  }
  for (std::size_t i = 0; i < earlier.size(); ++i) {
    if (!earlier_taken[i]) changes.push_back({Kind::kRemoved, earlier[i]});
  }
  for (std::size_t j = 0; j < later.size(); ++j) {
    if (!later_taken[j]) changes.push_back({Kind::kAdded, later[j]});
  }
  std::stable_sort(changes.begin() + begin, changes.end(), [](const auto& a, const auto& b) {
    return a.surface.z_m < b.surface.z_m;
  });
}

}  // namespace

std::vector<SurfaceChange> CompareTiles(const SurfaceTile& earlier,
                                        const SurfaceTile& later,
                                        double gap_size_m) {
  std::vector<SurfaceChange> changes;
  changes.reserve(std::max(earlier.surfaces.size(), later.surfaces.size()));
  Surfaces before = earlier.surfaces;
  Surfaces after = later.surfaces;
  while (!before.empty() || !after.empty()) {
    const std::uint16_t cell = before.empty()  ? after[0].cell
                               : after.empty() ? before[0].cell
                                               : std::min(before[0].cell, after[0].cell);
    CompareCells(TakeCell(before, cell), TakeCell(after, cell), gap_size_m, changes);
  }
  return changes;
}

}  // namespace strata
