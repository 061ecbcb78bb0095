// Numbers that say what a place looks like from where a 360° range scan was taken, whichever way
// the scanner was turned (Martínez Mozos, Stachniss, Burgard 2005; thesis 9.4.4).
#ifndef STRATA_CORE_CLASSIFICATION_PLACES_RANGE_SCAN_FEATURES_H_
#define STRATA_CORE_CLASSIFICATION_PLACES_RANGE_SCAN_FEATURES_H_

#include <complex>
#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace strata {

// Of scans with so many beams at equal angles once around. Immutable, thread-safe.
class RangeScanFeatures {
 public:
  // REQUIRES: beams even and at least eight.
  explicit RangeScanFeatures(int beams);

  // `ranges_m`: one a beam, finite and not negative. Of the beams: their lengths and steps, also
  // cut off at several ranges; gaps and short beams by several thresholds; widths across. Of the
  // polygon of their ends: area, perimeter, moments, distances to its centroid, Fourier magnitudes.
  // The same number of features for any number of beams.
  std::vector<float> Of(std::span<const float> ranges_m) const;

  int beams() const { return static_cast<int>(directions_.size()); }

 private:
  std::vector<Eigen::Vector2d> directions_;        // of every beam
  std::vector<std::complex<double>> frequencies_;  // of every magnitude and beam
};

}  // namespace strata

#endif  // STRATA_CORE_CLASSIFICATION_PLACES_RANGE_SCAN_FEATURES_H_
