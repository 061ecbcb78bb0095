#include "core/planning/ground/ground_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/mls/local_plane.h"
#include "core/planning/ground/ground_window.h"

namespace strata {
namespace {

constexpr int kFitWidth = 2 * kFitRadius + 1;
constexpr double kBrokenGround = 0.5;

// Numbers of the surfaces that a window's cells give, row by row; kNothing where none.
using Members = std::array<std::uint32_t, std::size_t{kFitWidth} * kFitWidth>;
constexpr std::uint32_t kNothing = 0xFFFFFFFFU;

std::uint32_t NearestInCell(const GroundWindow& window, int cell, float z, float reach_m) {
  std::uint32_t nearest = kNothing;
  for (std::uint32_t i = window.begin(cell); i < window.begin(cell + 1); ++i) {
    const float dz = std::abs(window.surface(i).z_m - z);
    if (dz > reach_m || window.surface(i).underside()) continue;
    reach_m = dz;
    nearest = i;
  }
  return nearest;
}

Members CollectMembers(const GroundWindow& window, const WindowSurface& middle) {
  Members members;
  for (int y = -kFitRadius, k = 0; y <= kFitRadius; ++y) {
    for (int x = -kFitRadius; x <= kFitRadius; ++x, ++k) {
      const auto d = static_cast<float>(std::sqrt(x * x + y * y) * window.cell_size_m());
      const int cell = static_cast<int>(middle.cell) + y * window.width() + x;
      members[k] = NearestInCell(window, cell, middle.z_m, 2.0F * d + 0.05F);
    }
  }
  return members;
}

// The plane of the square of members at columns [x0, x0 + width), rows [y0, y0 + width).
std::optional<LocalPlane> FitSquare(
    const GroundWindow& window, const Members& members, float z, int x0, int y0, int width) {
  LocalPlaneFit fit(window.cell_size_m());
  for (int y = y0; y < y0 + width; ++y) {
    for (int x = x0; x < x0 + width; ++x) {
      const std::uint32_t i = members[y * kFitWidth + x];
      if (i == kNothing) continue;
      fit.Add(x - kFitRadius, y - kFitRadius, window.surface(i).z_m - z, window.surface(i));
    }
  }
  return fit.Solve();
}

}  // namespace

GroundFit FitGround(const GroundWindow& window, std::uint32_t i) {
  const WindowSurface& middle = window.surface(i);
  const Members members = CollectMembers(window, middle);
  std::optional<LocalPlane> plane = FitSquare(window, members, middle.z_m, 0, 0, kFitWidth);
  if (!plane.has_value()) return {};
  if (plane->roughness_m() > 0.0) {
    double bound = kBrokenGround * plane->residual_m;
    for (int corner = 0; corner < 4; ++corner) {
      const int x0 = (corner & 1) * kFitRadius;
      const int y0 = (corner >> 1) * kFitRadius;
      const std::optional<LocalPlane> side =
          FitSquare(window, members, middle.z_m, x0, y0, kFitRadius + 1);
      if (!side.has_value() || side->residual_m >= bound) continue;
      bound = side->residual_m;
      plane = side;
    }
  }
  const double certain = plane->gradient.norm() - kNoiseGate * plane->gradient_sigma;
  return {.slope_rad = static_cast<float>(plane->slope_rad()),
          .certain_slope_tan = static_cast<float>(std::max(0.0, certain)),
          .roughness_m = static_cast<float>(plane->roughness_m())};
}

}  // namespace strata
