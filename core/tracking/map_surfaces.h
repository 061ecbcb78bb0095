// What a map has around a place, out of its served tiles, for scans to be matched to.
#ifndef STRATA_CORE_TRACKING_MAP_SURFACES_H_
#define STRATA_CORE_TRACKING_MAP_SURFACES_H_

#include <array>
#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "core/mls/features.h"
#include "core/mls/surface_tile.h"
#include "core/registration/registration_target.h"
#include "core/registration/scan_features.h"

namespace strata {

// A robot's sensor is matched as far as this [m],
inline constexpr double kTrackedRangeM = 60.0;
// and may go so far from the centre of the surfaces before they have to be collected anew [m].
inline constexpr double kSurfacesSlackM = 15.0;

// Immutable, safe to share between threads.
struct MapSurfaces {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  // in the map
  // How wide the place is in which a surface was measured: a cell, two where points were dropped
  // and patches moved as a whole.
  double blur_m = 0.1;
  ScanFeatures features;      // relative to the centre, axes of the map
  RegistrationTarget target;  // of the features, in the map
};

// One feature for a level surface and points along each upright one, in the classes that
// ScanFeatures has for a scan: tops, undersides, walls. Memory is bounded by kMost.
class MapSurfacesCollector {
 public:
  // Features that are kept: some 40 bytes each, in all.
  static constexpr std::size_t kMost = 2'000'000;

  // `cell_size_m` of the tiles to come.
  MapSurfacesCollector(const Eigen::Vector3d& centre, double cell_size_m, bool points_kept)
      : centre_(centre), cell_size_m_(cell_size_m), points_kept_(points_kept) {}

  // What of the tile lies within range. False: there is no more room; nearer tiles come first.
  bool Add(const SurfaceTile& tile);
  MapSurfaces Finish() &&;

 private:
  const Eigen::Vector3d centre_;
  const double cell_size_m_;
  const bool points_kept_;
  std::size_t count_ = 0;
  double widest_cell_m_ = 0.0;
  std::array<std::vector<Eigen::Vector3f>, kFeatureClasses> points_;
};

}  // namespace strata

#endif  // STRATA_CORE_TRACKING_MAP_SURFACES_H_
