#include "core/registration/neighbours.h"

#include <algorithm>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "absl/status/status.h"

#include "core/common/option_checks.h"

namespace strata {

absl::Status NeighbourPolicy::Validate() const {
  OptionChecks checks("neighbour policy");
  checks.InRange("radius_m", radius_m, 1e-3, 1000.0);
  checks.InRange("max_scans", max_scans, 1, 1000);
  return checks.status();
}

std::vector<std::size_t> SelectNeighbours(std::span<const Pose> T_map_scans,
                                          const Pose& T_map_source_guess,
                                          const NeighbourPolicy& policy) {
  std::vector<std::pair<double, std::size_t>> near;
  for (std::size_t i = 0; i < T_map_scans.size(); ++i) {
    const double distance_m =
        (T_map_scans[i].translation() - T_map_source_guess.translation()).norm();
    if (distance_m <= policy.radius_m) near.emplace_back(distance_m, i);
  }
  std::sort(near.begin(), near.end(), [](const auto& a, const auto& b) {
    return a.first != b.first ? a.first < b.first : a.second > b.second;
  });
  if (near.size() > static_cast<std::size_t>(policy.max_scans)) near.resize(policy.max_scans);
  std::vector<std::size_t> chosen;
  chosen.reserve(near.size());
  for (const auto& [distance_m, index] : near) chosen.push_back(index);
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

}  // namespace strata
