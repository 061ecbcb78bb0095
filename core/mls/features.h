// Feature points of a map and samples of them (thesis 6.5.4): what registration matches.
#ifndef STRATA_CORE_MLS_FEATURES_H_
#define STRATA_CORE_MLS_FEATURES_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include <Eigen/Core>

#include "core/mls/mls_map.h"
#include "core/mls/surface_tile.h"

namespace strata {

// The three classes of patches (6.5.4). A horizontal patch of unknown traversability counts as
// traversable, so that without annotation there are two classes: horizontal and vertical.
enum class FeatureClass : std::uint8_t {
  kTraversable = 0,
  kNonTraversable = 1,
  kVertical = 2,
};
inline constexpr int kFeatureClasses = 3;

struct Feature {
  Eigen::Vector3d p_map = Eigen::Vector3d::Zero();  // in the frame of the map [m]
  float sigma_m = 0.0F;                             // of the height of its patch
  FeatureClass feature_class = FeatureClass::kTraversable;
  std::uint32_t tile = 0;   // index into MlsMap::tiles
  std::uint32_t patch = 0;  // index into MlsTile::patches
};

struct FeatureOptions {
  // A vertical patch gives points from its top downwards, this many a metre (7.2.3), at least one;
  // in [0.1, 1000]. More costs matching time, fewer lose walls.
  double points_per_metre = 4.0;
};

// All features in the order of the map: one for a horizontal patch at (centre of the cell, mean),
// several for a vertical one. The thesis puts x and y at the cell's corner, i·s; the centre is the
// unbiased place. `traversability`, when not empty, has one entry a patch in the order of the map
// (tile after tile). INVALID_ARGUMENT for another length or options out of range.
absl::StatusOr<std::vector<Feature>> ExtractFeatures(
    const MlsMap& map,
    const FeatureOptions& options = {},
    std::span<const Traversability> traversability = {});

// Samples, each a pure function of features, size and seed: the same on every machine. Without
// replacement, in the order of the features.

// min(count, all) features, every subset equally likely.
std::vector<Feature> SampleUniform(std::span<const Feature> features,
                                   std::size_t count,
                                   std::uint64_t seed);
// The fraction in [0, 1] (clamped; NaN is 0) of the features, rounded to the nearest number.
std::vector<Feature> SampleFraction(std::span<const Feature> features,
                                    double fraction,
                                    std::uint64_t seed);
// min(counts[c], all of the class) of every class c; uniform within a class.
std::vector<Feature> SampleClasswise(std::span<const Feature> features,
                                     const std::array<std::size_t, kFeatureClasses>& counts,
                                     std::uint64_t seed);
// min(count, all) features drawn one after the other with probability proportional to 1/σ² among
// those left (weighted sampling without replacement). σ below 0.1 mm counts as 0.1 mm.
std::vector<Feature> SampleInverseVariance(std::span<const Feature> features,
                                           std::size_t count,
                                           std::uint64_t seed);

}  // namespace strata

#endif  // STRATA_CORE_MLS_FEATURES_H_
