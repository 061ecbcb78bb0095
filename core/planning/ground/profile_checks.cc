#include "core/planning/ground/profile_checks.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <tuple>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

#include "core/common/status.h"
#include "core/mls/local_plane.h"
#include "core/mls/tile_key.h"
#include "core/mls/traversability.h"
#include "core/planning/ground/ground_fit.h"
#include "core/world/robot_profile.h"

namespace strata {
namespace {

void FillDisc(ProfileChecks* checks) {
  const double cell = checks->cell_size_m;
  const int bound = static_cast<int>(std::ceil(checks->reach_m / cell + 0.5));
  for (int dy = -bound; dy <= bound; ++dy) {
    for (int dx = -bound; dx <= bound; ++dx) {
      const double near_x = std::max(0.0, std::abs(dx) - 0.5);
      const double near_y = std::max(0.0, std::abs(dy) - 0.5);
      const auto distance = static_cast<float>(std::hypot(near_x, near_y) * cell);
      if (distance >= checks->reach_m) continue;
      const double run = (std::hypot(dx, dy) + 1.0) * cell;
      checks->disc.push_back(
          {.dx = static_cast<std::int16_t>(dx),
           .dy = static_cast<std::int16_t>(dy),
           .distance_m = distance,
           .level_m = static_cast<float>(checks->step_m + run * checks->slope_tan)});
      checks->disc_cells = std::max(checks->disc_cells, std::abs(dx));
    }
  }
  std::sort(checks->disc.begin(), checks->disc.end(), [](const DiscCell& a, const DiscCell& b) {
    return std::tie(a.distance_m, a.dy, a.dx) < std::tie(b.distance_m, b.dy, b.dx);
  });
}

}  // namespace

float ProfileChecks::RiseOver(double length_m) const {
  return std::max(step_m, static_cast<float>(length_m * slope_tan) + kHeightTolerance);
}

double ProfileChecks::Danger(const GroundFit& fit, float sigma_m, float distance_m) const {
  const double nearness = 1.0 - (distance_m - footprint_m) / kDangerReachM;
  const TraversabilityLimits limits = {.max_slope_rad = profile.max_slope_rad,
                                       .max_step_m = profile.max_step_m,
                                       .max_roughness_m = profile.max_roughness_m,
                                       .clearance_m = profile.height_m};
  return strata::Danger(fit.slope_rad, fit.roughness_m, 0.0, sigma_m, limits) +
         2.0 * nearness * nearness;
}

absl::StatusOr<ProfileChecks> MakeProfileChecks(const RobotProfile& profile, double cell_size_m) {
  STRATA_RETURN_IF_ERROR(ValidateRobotProfile(profile));
  if (!(cell_size_m > 0.0)) {
    return absl::InvalidArgumentError(absl::StrCat("cell_size_m = ", cell_size_m, " is not > 0"));
  }
  ProfileChecks checks;
  checks.profile = profile;
  checks.cell_size_m = cell_size_m;
  checks.step_m = static_cast<float>(profile.max_step_m) + kHeightTolerance;
  checks.height_m = static_cast<float>(profile.height_m) - kHeightTolerance;
  checks.slope_tan = static_cast<float>(std::tan(profile.max_slope_rad) + 1e-4);
  checks.roughness_m = static_cast<float>(profile.max_roughness_m);
  checks.footprint_m = static_cast<float>(
      std::sqrt(profile.radius_m * profile.radius_m + 0.5 * cell_size_m * cell_size_m));
  checks.reach_m = checks.footprint_m + static_cast<float>(kDangerReachM);
  for (int d = 0; d < 2; ++d) {
    checks.gap_cells[d] = static_cast<int>(profile.max_gap_m / checks.StepLength(d) + 1e-6);
    checks.behind_cells[d] = static_cast<int>(checks.footprint_m / checks.StepLength(d)) + 1;
  }
  checks.sight_cells = std::max(checks.gap_cells[0], checks.behind_cells[0]) + 2;
  // Targets of moves, the disc around them, the surfaces that see its edges, what those see.
  const double disc_cells = checks.reach_m / cell_size_m + 1.5;
  const int seen_cells = checks.behind_cells[0] + 1 + checks.sight_cells + kMaxUnseenDeckCells;
  const double cells = checks.gap_cells[0] + 1 + disc_cells + seen_cells;
  if (cells > kTileCells - 1) {
    return absl::InvalidArgumentError(absl::StrCat("radius_m = ",
                                                   profile.radius_m,
                                                   " and max_gap_m = ",
                                                   profile.max_gap_m,
                                                   " reach over ",
                                                   static_cast<int>(cells),
                                                   " cells of ",
                                                   cell_size_m,
                                                   " m; at most ",
                                                   kTileCells - 1,
                                                   " are checked"));
  }
  FillDisc(&checks);
  checks.margin = checks.gap_cells[0] + 1 + checks.disc_cells + seen_cells;
  return checks;
}

}  // namespace strata
