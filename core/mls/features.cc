#include "core/mls/features.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <random>
#include <span>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

#include "core/mls/patch.h"
#include "core/mls/tile_key.h"

namespace strata {
namespace {

// mt19937_64 is the same everywhere; the standard's distributions are not.

// Uniform in [0, 2⁵³).
std::uint64_t Bits53(std::mt19937_64& random) { return random() >> 11; }

// Uniform in [0, bound), without bias: draws beyond the last whole multiple are repeated.
std::uint64_t Below(std::mt19937_64& random, std::uint64_t bound) {
  const std::uint64_t limit = (std::uint64_t{1} << 53) / bound * bound;
  std::uint64_t draw = Bits53(random);
  while (draw >= limit) draw = Bits53(random);
  return draw % bound;
}

// The first `count` of `indices` shuffled, sorted.
std::vector<std::uint32_t> Choose(std::vector<std::uint32_t> indices,
                                  std::size_t count,
                                  std::mt19937_64& random) {
  count = std::min(count, indices.size());
  for (std::size_t i = 0; i < count; ++i) {
    std::swap(indices[i], indices[i + Below(random, indices.size() - i)]);
  }
  indices.resize(count);
  std::sort(indices.begin(), indices.end());
  return indices;
}

std::vector<Feature> Pick(std::span<const Feature> features,
                          std::span<const std::uint32_t> indices) {
  std::vector<Feature> picked;
  picked.reserve(indices.size());
  for (const std::uint32_t index : indices) picked.push_back(features[index]);
  return picked;
}

FeatureClass ClassOf(const Patch& patch, Traversability traversability) {
  if (patch.vertical()) return FeatureClass::kVertical;
  const bool ground = traversability != Traversability::kNonTraversable &&
                      traversability != Traversability::kUnderside;
  return ground ? FeatureClass::kTraversable : FeatureClass::kNonTraversable;
}

// Appends the points of one patch, `feature` being the topmost.
void AppendPoints(Feature feature,
                  double depth_m,
                  double points_per_metre,
                  std::vector<Feature>& features) {
  const double top_m = feature.p_map.z();
  const auto steps = static_cast<std::size_t>(depth_m * points_per_metre);
  for (std::size_t i = 0; i <= steps; ++i) {
    feature.p_map.z() = top_m - static_cast<double>(i) / points_per_metre;
    features.push_back(feature);
  }
}

}  // namespace

absl::StatusOr<std::vector<Feature>> ExtractFeatures(
    const MlsMap& map,
    const FeatureOptions& options,
    std::span<const Traversability> traversability) {
  if (!(options.points_per_metre >= 0.1 && options.points_per_metre <= 1000.0)) {
    return absl::InvalidArgumentError(absl::StrCat(
        "features: points_per_metre = ", options.points_per_metre, " is not in [0.1, 1000]"));
  }
  if (!traversability.empty() && traversability.size() != map.patch_count()) {
    return absl::InvalidArgumentError(absl::StrCat(
        "features: ", traversability.size(), " classes for ", map.patch_count(), " patches"));
  }
  const double cell_size_m = map.parameters.cell_size_m;
  std::vector<Feature> features;
  features.reserve(map.patch_count());
  std::size_t place = 0;
  for (std::uint32_t t = 0; t < map.tiles.size(); ++t) {
    const MlsTile& tile = map.tiles[t];
    for (std::uint32_t i = 0; i < tile.patches.size(); ++i, ++place) {
      const Patch& patch = tile.patches[i];
      const CellIndex cell = CellOf(tile.key, static_cast<std::uint16_t>(patch.cell));
      Feature feature;
      feature.p_map = {(cell.x + 0.5) * cell_size_m, (cell.y + 0.5) * cell_size_m, patch.mean_m()};
      feature.sigma_m = static_cast<float>(patch.sigma_m());
      feature.feature_class =
          ClassOf(patch, traversability.empty() ? Traversability::kUnknown : traversability[place]);
      feature.tile = t;
      feature.patch = i;
      AppendPoints(feature, patch.depth_m(), options.points_per_metre, features);
    }
  }
  return features;
}

std::vector<Feature> SampleUniform(std::span<const Feature> features,
                                   std::size_t count,
                                   std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<std::uint32_t> all(features.size());
  std::iota(all.begin(), all.end(), 0U);
  return Pick(features, Choose(std::move(all), count, random));
}

std::vector<Feature> SampleFraction(std::span<const Feature> features,
                                    double fraction,
                                    std::uint64_t seed) {
  if (!(fraction > 0.0)) return {};
  const double count = std::min(fraction, 1.0) * static_cast<double>(features.size());
  return SampleUniform(features, static_cast<std::size_t>(std::llround(count)), seed);
}

std::vector<Feature> SampleClasswise(std::span<const Feature> features,
                                     const std::array<std::size_t, kFeatureClasses>& counts,
                                     std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<std::uint32_t> chosen;
  for (int c = 0; c < kFeatureClasses; ++c) {
    std::vector<std::uint32_t> members;
    for (std::uint32_t i = 0; i < features.size(); ++i) {
      if (static_cast<int>(features[i].feature_class) == c) members.push_back(i);
    }
    const std::vector<std::uint32_t> some = Choose(std::move(members), counts[c], random);
    chosen.insert(chosen.end(), some.begin(), some.end());
  }
  std::sort(chosen.begin(), chosen.end());
  return Pick(features, chosen);
}

std::vector<Feature> SampleInverseVariance(std::span<const Feature> features,
                                           std::size_t count,
                                           std::uint64_t seed) {
  // Exponential clocks: the first `count` of arrival times −ln(u)/weight are such a sample
  // (Efraimidis and Spirakis 2006).
  std::mt19937_64 random(seed);
  std::vector<std::pair<double, std::uint32_t>> arrivals(features.size());
  for (std::uint32_t i = 0; i < features.size(); ++i) {
    const double u = (static_cast<double>(Bits53(random)) + 0.5) * 0x1p-53;
    const double sigma_m = std::max<double>(features[i].sigma_m, 1e-4);
    arrivals[i] = {-std::log(u) * sigma_m * sigma_m, i};
  }
  count = std::min(count, arrivals.size());
  std::nth_element(
      arrivals.begin(), arrivals.begin() + static_cast<std::ptrdiff_t>(count), arrivals.end());
  std::vector<std::uint32_t> chosen;
  for (std::size_t i = 0; i < count; ++i) chosen.push_back(arrivals[i].second);
  std::sort(chosen.begin(), chosen.end());
  return Pick(features, chosen);
}

}  // namespace strata
