#include "core/mls/patch.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

#include "core/mls/mls_parameters.h"

namespace strata {
namespace {

constexpr double kMinSigmaM = 0.002;
constexpr double kHalfStep = 1.0109322217097118;  // 2^(4/255)

// Everything here comes from products and quotients, which every machine rounds alike; exp2 and
// log2 may differ in the last bit, and one bit decides a code.
struct CodeTable {
  std::array<double, 256> sigma_m;
  std::array<double, 256> boundary_m;  // from here on, code c and not c − 1
  std::array<std::uint32_t, 256> weight;
};

const CodeTable& Codes() {
  static const CodeTable table = [] {
    CodeTable t;
    double sigma = kMinSigmaM;
    for (int code = 0; code < 256; ++code) {
      const double ratio = kMinSigmaM / sigma;
      t.sigma_m[code] = sigma;
      t.boundary_m[code] = code == 0 ? 0.0 : sigma / kHalfStep;
      t.weight[code] = static_cast<std::uint32_t>(std::lround(65536.0 * (ratio * ratio)));
      sigma = sigma * (kHalfStep * kHalfStep);
    }
    return t;
  }();
  return table;
}

// Moves the reference of the sums down by `shift` ticks: Σw(z+s), Σw(z+s)².
void ShiftReference(Patch& patch, std::uint64_t shift) {
  patch.sum_wzz += 2 * shift * patch.sum_wz + shift * shift * patch.sum_w;
  patch.sum_wz = patch.sum_wz + shift * patch.sum_w;
}

void MakeVertical(Patch& patch) {
  patch.sum_w = 0;
  patch.sum_wz = 0;
  patch.sum_wzz = 0;
}

}  // namespace

std::uint8_t SigmaCode(double sigma_m) {
  const auto& boundary = Codes().boundary_m;
  const auto above = std::upper_bound(boundary.begin() + 1, boundary.end(), sigma_m);
  return static_cast<std::uint8_t>(above - boundary.begin() - 1);
}

double SigmaCodeBoundary(std::uint8_t code) { return Codes().boundary_m[code]; }

double SigmaOfCode(std::uint8_t code) { return Codes().sigma_m[code]; }

std::uint32_t WeightOfCode(std::uint8_t code) { return Codes().weight[code]; }

double Patch::mean_m() const {
  if (vertical()) return top_m();
  if (sum_wz == 0 && sum_wzz == 0) return 0.5 * (bottom_m() + top_m());  // one height, or full
  return (static_cast<double>(z_min) + static_cast<double>(sum_wz) / static_cast<double>(sum_w)) /
         kTicksPerMetre;
}

double Patch::sigma_m() const {
  if (vertical()) return SigmaOfCode(static_cast<std::uint8_t>(top_sigma_code));
  return std::sqrt(1.0 / (static_cast<double>(sum_w) * kPrecisionPerWeight));
}

double Patch::spread_m() const {
  if (vertical() || sum_wz == 0) return 0.0;
  const double w = static_cast<double>(sum_w);
  const double mean = static_cast<double>(sum_wz) / w;
  const double variance = static_cast<double>(sum_wzz) / w - mean * mean;
  return std::sqrt(std::max(variance, 0.0)) / kTicksPerMetre;
}

std::uint64_t MaxWeightSum(std::int32_t thickness_ticks) {
  // (z − z_min)² ≤ τ² < 2^(2b) with b = bit width of τ.
  const int bits = 2 * std::bit_width(static_cast<std::uint32_t>(thickness_ticks));
  return (std::uint64_t{1} << std::min(44, 64 - bits)) - 1;
}

Patch PatchOfMeasurement(std::uint16_t cell, std::int32_t z_ticks, std::uint8_t sigma_code) {
  Patch patch;
  patch.cell = cell;
  patch.z_min = z_ticks;
  patch.z_max = z_ticks;
  patch.top_sigma_code = sigma_code;
  patch.count = 1;
  patch.sum_w = WeightOfCode(sigma_code);
  return patch;
}

bool Touching(const Patch& a, const Patch& b, const MlsParameters& parameters) {
  const std::int64_t gap = std::max(a.z_min - b.z_max, b.z_min - a.z_max);
  return gap < parameters.gap_ticks();
}

Patch Join(const Patch& a, const Patch& b, const MlsParameters& parameters) {
  Patch low = a.z_min <= b.z_min ? a : b;
  Patch high = a.z_min <= b.z_min ? b : a;

  Patch joined;
  joined.cell = a.cell;
  joined.z_min = low.z_min;
  joined.z_max = std::max(a.z_max, b.z_max);
  joined.count = std::min<std::uint64_t>(a.count + b.count, Patch::kMaxCount);
  if (a.z_max == b.z_max) {
    joined.top_sigma_code = std::min(a.top_sigma_code, b.top_sigma_code);
  } else {
    joined.top_sigma_code = a.z_max > b.z_max ? a.top_sigma_code : b.top_sigma_code;
  }
  const std::int32_t thickness = parameters.thickness_ticks();
  if (a.vertical() || b.vertical() || joined.height_ticks() > thickness) {
    MakeVertical(joined);
    return joined;
  }
  const std::uint64_t bound = MaxWeightSum(thickness);
  joined.sum_w = std::min<std::uint64_t>(std::uint64_t{a.sum_w} + b.sum_w, bound);
  if (joined.sum_w == bound) return joined;  // full
  ShiftReference(high, static_cast<std::uint64_t>(high.z_min - low.z_min));
  joined.sum_wz = low.sum_wz + high.sum_wz;
  joined.sum_wzz = low.sum_wzz + high.sum_wzz;
  return joined;
}

}  // namespace strata
