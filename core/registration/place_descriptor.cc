#include "core/registration/place_descriptor.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

#include "core/common/option_checks.h"
#include "core/mls/mls_map.h"

namespace strata {
namespace {

constexpr int kDirections = PlaceDescriptor::kDirections;
constexpr int kWaves = PlaceDescriptor::kWaves;
constexpr int kHarmonics = PlaceDescriptor::kHarmonics;
// Waves 1 and 2 see little but the outline of the window.
constexpr int kFirstWave = 3;
constexpr int kBinsOfProjection = 256;
constexpr double kSpreadUnits = 20.0;
constexpr char kVersion = 1;

// A cell of the image.
struct Structure {
  double x = 0.0;
  double y = 0.0;
  double weight = 0.0;
};

// The tallest vertical patch of every cell, fading out towards the radius.
std::vector<Structure> StructureOf(const MlsMap& map, const PlaceDescriptorOptions& options) {
  const int size = 2 * static_cast<int>(std::ceil(options.radius_m / options.cell_m));
  std::vector<Structure> image(static_cast<std::size_t>(size) * static_cast<std::size_t>(size));
  const double cell_size_m = map.parameters.cell_size_m;
  for (const MlsTile& tile : map.tiles) {
    for (const Patch& patch : tile.patches) {
      const double height = patch.depth_m();
      if (height < options.min_height_m) continue;
      const CellIndex cell = CellOf(tile.key, patch.cell);
      const double x = (cell.x + 0.5) * cell_size_m;
      const double y = (cell.y + 0.5) * cell_size_m;
      const double distance = std::hypot(x, y);
      if (distance >= options.radius_m) continue;
      const auto column = static_cast<std::size_t>(std::floor(x / options.cell_m) + size / 2);
      const auto row = static_cast<std::size_t>(std::floor(y / options.cell_m) + size / 2);
      const double fade = std::cos(0.5 * std::numbers::pi * distance / options.radius_m);
      const double weight = fade * std::min(height, options.max_height_m) / options.max_height_m;
      Structure& s = image[row * static_cast<std::size_t>(size) + column];
      if (weight > s.weight) s = {x, y, weight};
    }
  }
  std::erase_if(image, [](const Structure& s) { return s.weight <= 0.0; });
  return image;
}

// Magnitudes of the waves kFirstWave … of the structure's projection onto a direction.
std::array<double, kWaves> Slice(const std::vector<Structure>& image,
                                 double direction_rad,
                                 double radius_m) {
  static const std::vector<std::complex<double>> kRoots = [] {
    std::vector<std::complex<double>> roots;
    for (int i = 0; i < kBinsOfProjection; ++i) {
      roots.push_back(std::polar(1.0, 2.0 * std::numbers::pi * i / kBinsOfProjection));
    }
    return roots;
  }();
  const double c = std::cos(direction_rad) * 0.5 * kBinsOfProjection / radius_m;
  const double s = std::sin(direction_rad) * 0.5 * kBinsOfProjection / radius_m;
  std::array<double, kBinsOfProjection + 1> projection{};
  for (const Structure& p : image) {
    const double at = c * p.x + s * p.y + 0.5 * kBinsOfProjection;
    const int bin = std::clamp(static_cast<int>(at), 0, kBinsOfProjection - 1);
    projection[static_cast<std::size_t>(bin)] += p.weight * (bin + 1.0 - at);
    projection[static_cast<std::size_t>(bin) + 1] += p.weight * (at - bin);
  }
  std::array<double, kWaves> magnitudes{};
  for (int w = 0; w < kWaves; ++w) {
    std::complex<double> sum = 0.0;
    for (int i = 0; i <= kBinsOfProjection; ++i) {
      sum += projection[static_cast<std::size_t>(i)] *
             kRoots[static_cast<std::size_t>((w + kFirstWave) * i % kBinsOfProjection)];
    }
    magnitudes[static_cast<std::size_t>(w)] = std::abs(sum);
  }
  return magnitudes;
}

// Σ a·b with b turned by every number of directions; b's spectrum twice in a row is the turning.
double Correlate(const PlaceDescriptor& a, const PlaceDescriptor& b, int shift) {
  std::int64_t sum = 0;
  for (int w = 0; w < kWaves; ++w) {
    const std::int8_t* const x = &a.spectrum[static_cast<std::size_t>(w * kDirections)];
    const std::int8_t* const y = &b.spectrum[static_cast<std::size_t>(w * kDirections)];
    std::int32_t row = 0;
    for (int d = shift; d < kDirections; ++d) row += x[d] * y[d - shift];
    for (int d = 0; d < shift; ++d) row += x[d] * y[d - shift + kDirections];
    sum += row;
  }
  return static_cast<double>(sum);
}

}  // namespace

bool PlaceDescriptor::empty() const {
  return std::all_of(spectrum.begin(), spectrum.end(), [](std::int8_t v) { return v == 0; });
}

absl::Status PlaceDescriptorOptions::Validate() const {
  OptionChecks checks("place descriptor options");
  checks.InRange("radius_m", radius_m, 5.0, 1000.0);
  checks.InRange("cell_m", cell_m, 0.1, 10.0);
  checks.InRange("min_height_m", min_height_m, 0.0, 100.0);
  checks.InRange("max_height_m", max_height_m, min_height_m + 1e-3, 100.0);
  checks.InRange("min_cells", min_cells, 1, 100000);
  return checks.status();
}

PlaceDescriptor DescribePlace(const MlsMap& local_map, const PlaceDescriptorOptions& options) {
  PlaceDescriptor descriptor;
  const std::vector<Structure> image = StructureOf(local_map, options);
  if (static_cast<int>(image.size()) < options.min_cells) return descriptor;
  std::array<std::array<double, kWaves>, kDirections> slices;
  for (int d = 0; d < kDirections; ++d) {
    slices[static_cast<std::size_t>(d)] =
        Slice(image, std::numbers::pi * d / kDirections, options.radius_m);
  }
  for (std::size_t w = 0; w < kWaves; ++w) {
    double sum = 0.0;
    double squares = 0.0;
    for (const auto& slice : slices) {
      sum += slice[w];
      squares += slice[w] * slice[w];
    }
    const double mean = sum / kDirections;
    const double spread = std::sqrt(std::max(0.0, squares / kDirections - mean * mean));
    if (spread < 1e-9) continue;
    for (std::size_t d = 0; d < kDirections; ++d) {
      const double value = kSpreadUnits * (slices[d][w] - mean) / spread;
      descriptor.spectrum[w * kDirections + d] =
          static_cast<std::int8_t>(std::lround(std::clamp(value, -127.0, 127.0)));
    }
  }
  return descriptor;
}

PlaceSimilarity ComparePlaces(const PlaceDescriptor& a, const PlaceDescriptor& b) {
  const double norm = std::sqrt(Correlate(a, a, 0) * Correlate(b, b, 0));
  if (norm == 0.0) return {};
  PlaceSimilarity similarity{2.0, 0.0};
  for (int shift = 0; shift < kDirections; ++shift) {
    const double distance = 1.0 - Correlate(a, b, shift) / norm;
    if (distance < similarity.distance) {
      similarity = {distance, std::numbers::pi * shift / kDirections};
    }
  }
  return similarity;
}

std::vector<float> InvariantOf(const PlaceDescriptor& descriptor) {
  static const auto kTurns = [] {
    std::array<std::complex<float>, kDirections> turns;
    for (int d = 0; d < kDirections; ++d) {
      turns[static_cast<std::size_t>(d)] =
          std::polar(1.0F, static_cast<float>(2.0 * std::numbers::pi * d / kDirections));
    }
    return turns;
  }();
  std::vector<float> invariant;
  float squares = 0.0F;
  for (int w = 0; w < kWaves; ++w) {
    for (int h = 1; h <= kHarmonics; ++h) {
      std::complex<float> sum = 0.0F;
      for (int d = 0; d < kDirections; ++d) {
        sum +=
            static_cast<float>(descriptor.spectrum[static_cast<std::size_t>(w * kDirections + d)]) *
            kTurns[static_cast<std::size_t>(h * d % kDirections)];
      }
      invariant.push_back(std::abs(sum));
      squares += std::norm(sum);
    }
  }
  if (squares > 0.0F) {
    for (float& v : invariant) v /= std::sqrt(squares);
  }
  return invariant;
}

std::string EncodePlace(const PlaceDescriptor& descriptor) {
  std::string bytes(1, kVersion);
  for (const std::int8_t v : descriptor.spectrum) bytes.push_back(static_cast<char>(v));
  return bytes;
}

absl::StatusOr<PlaceDescriptor> DecodePlace(absl::string_view bytes) {
  PlaceDescriptor descriptor;
  const std::size_t expected = 1 + descriptor.spectrum.size();
  if (bytes.size() != expected || bytes[0] != kVersion) {
    return absl::DataLossError(absl::StrCat("place descriptor of ",
                                            bytes.size(),
                                            " bytes, expected ",
                                            expected,
                                            " that begin with version ",
                                            static_cast<int>(kVersion),
                                            "; describe the place again"));
  }
  for (std::size_t i = 0; i < descriptor.spectrum.size(); ++i) {
    descriptor.spectrum[i] = static_cast<std::int8_t>(bytes[i + 1]);
  }
  return descriptor;
}

}  // namespace strata
