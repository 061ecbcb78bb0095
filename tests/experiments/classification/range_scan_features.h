// Numbers that say what a place looks like from where a 360° range scan was taken, whichever way
// the scanner was turned (Martínez Mozos, Stachniss, Burgard 2005).
#ifndef STRATA_TESTS_EXPERIMENTS_CLASSIFICATION_RANGE_SCAN_FEATURES_H_
#define STRATA_TESTS_EXPERIMENTS_CLASSIFICATION_RANGE_SCAN_FEATURES_H_

#include <span>
#include <vector>

namespace strata::testing {

// `ranges_m`: beams at equal angles once around, at least eight. Of the beams: their lengths and
// steps, also cut off at several ranges; gaps and short beams by several thresholds; widths across.
// Of the polygon of their ends: area, perimeter, moments, distances to its centroid, Fourier
// magnitudes. The same number of features for any number of beams.
std::vector<float> RangeScanFeatures(std::span<const float> ranges_m);

}  // namespace strata::testing

#endif  // STRATA_TESTS_EXPERIMENTS_CLASSIFICATION_RANGE_SCAN_FEATURES_H_
