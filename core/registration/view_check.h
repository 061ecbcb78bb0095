// Do two scans contradict each other at a relative pose? What one sees must not stand where the
// other looked through, and what the other should see too must be there.
// Internal to core/registration, not installed.
#ifndef STRATA_CORE_REGISTRATION_VIEW_CHECK_H_
#define STRATA_CORE_REGISTRATION_VIEW_CHECK_H_

#include <vector>

#include <Eigen/Core>

#include "core/registration/scan_features.h"

namespace strata {

// What a scan says of a point in the world.
enum class Sight {
  kUnknown,      // it did not look there, or something was in the way
  kAgreeing,     // it measured about that far in that direction
  kSeenThrough,  // it measured farther only
  kNoReturn,     // near, it looked there, and nothing came back
};

// How far a scan sees in every direction: a spherical image with the least and the greatest
// distance of the features in each cell. Immutable.
class ViewImage {
 public:
  ViewImage() = default;
  ViewImage(const ScanFeatures& features, const Eigen::Vector3d& sensor_origin);

  // `p_scan` in the frame of the scan. Points within 2 m and beyond 40 m are unknown. Beams that
  // pass just above a `level` surface meet it farther on: how far is known to an image cell.
  Sight At(const Eigen::Vector3f& p_scan, bool level = false) const;

 private:
  struct Cell {
    float nearest_m = 0.0F;  // of the cell and the eight around it; 0: nothing in the cell
    float farthest_m = 0.0F;
    bool measured_around = false;
  };
  std::vector<Cell> cells_;
  std::vector<bool> rows_;     // measured anywhere
  std::vector<bool> columns_;  // measured anywhere
  Eigen::Vector3f origin_ = Eigen::Vector3f::Zero();
  Eigen::Vector3f up_ = Eigen::Vector3f::UnitZ();
};

}  // namespace strata

#endif  // STRATA_CORE_REGISTRATION_VIEW_CHECK_H_
