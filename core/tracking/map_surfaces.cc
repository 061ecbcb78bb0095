#include "core/tracking/map_surfaces.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/mls/tile_key.h"

namespace strata {
namespace {

constexpr double kRadiusM = kTrackedRangeM + kSurfacesSlackM;
// As of a scan's upright patches (ScanFeatureOptions::samples_per_metre); of one 100 m tall all.
constexpr double kPointsPerMetre = 4.0;
constexpr double kMostPoints = 400.0;

FeatureClass ClassOf(const Surface& surface) {
  if (surface.vertical()) return FeatureClass::kVertical;
  return surface.underside() ? FeatureClass::kNonTraversable : FeatureClass::kTraversable;
}

}  // namespace

bool MapSurfacesCollector::Add(const SurfaceTile& tile) {
  const double cell_m = std::ldexp(cell_size_m_, tile.key.level);
  widest_cell_m_ = std::max(widest_cell_m_, cell_m);
  for (const Surface& surface : tile.surfaces) {
    if (count_ >= kMost) return false;
    const CellIndex cell = CellOf(tile.key, surface.cell);
    const double x = (cell.x + 0.5) * cell_m - centre_.x();
    const double y = (cell.y + 0.5) * cell_m - centre_.y();
    if (x * x + y * y > kRadiusM * kRadiusM) continue;
    std::vector<Eigen::Vector3f>& list = points_[static_cast<std::size_t>(ClassOf(surface))];
    const double depth_m = surface.depth_m;
    const int n =
        static_cast<int>(std::clamp(std::round(depth_m * kPointsPerMetre), 1.0, kMostPoints));
    for (int i = 0; i < n; ++i) {
      const double below_m = surface.vertical() ? (i + 0.5) * depth_m / n : 0.0;
      list.push_back(Eigen::Vector3d(x, y, surface.z_m - below_m - centre_.z()).cast<float>());
    }
    count_ += static_cast<std::size_t>(n);
  }
  return true;
}

MapSurfaces MapSurfacesCollector::Finish() && {
  ScanFeatureOptions options;
  options.sample_count = 0;
  MapSurfaces surfaces;
  surfaces.centre = centre_;
  surfaces.blur_m = widest_cell_m_ * (points_kept_ ? 1.0 : 2.0);
  surfaces.features = ScanFeatures::FromPoints(std::move(points_), options);
  Pose T_map_features = Pose::Identity();
  T_map_features.translation() = centre_;
  const PlacedScan placed[] = {{&surfaces.features, T_map_features}};
  surfaces.target = RegistrationTarget(
      placed, {.from_one_place = false, .radius_m = kRadiusM, .centre = centre_});
  return surfaces;
}

}  // namespace strata
