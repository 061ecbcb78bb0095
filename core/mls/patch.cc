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
  StorePatch({.sum_w = WeightOfCode(sigma_code),
              .count = 1,
              .z_min = z_ticks,
              .z_max = z_ticks,
              .cell = cell,
              .top_sigma_code = sigma_code},
             patch);
  return patch;
}

bool Touching(const Patch& a, const Patch& b, const MlsParameters& parameters) {
  const std::int64_t gap = std::max(a.z_min - b.z_max, b.z_min - a.z_max);
  return gap < parameters.gap_ticks();
}

void JoinInto(Patch& a, const Patch& b, const MlsParameters& parameters) {
  const Patch& low = a.z_min <= b.z_min ? a : b;
  const Patch& high = a.z_min <= b.z_min ? b : a;
  const Patch& top = a.z_max >= b.z_max ? a : b;

  PatchFields joined;
  joined.cell = static_cast<std::uint16_t>(a.cell);
  joined.z_min = static_cast<std::int32_t>(low.z_min);
  joined.z_max = static_cast<std::int32_t>(top.z_max);
  joined.count = static_cast<std::uint32_t>(
      std::min<std::uint64_t>(std::uint64_t{a.count} + b.count, Patch::kMaxCount));
  joined.top_sigma_code = static_cast<std::uint8_t>(
      a.z_max == b.z_max ? std::min(a.top_sigma_code, b.top_sigma_code) : top.top_sigma_code);
  joined.sides = static_cast<std::uint8_t>(a.sides | b.sides);

  const std::int32_t thickness = parameters.thickness_ticks();
  if (low.vertical() || high.vertical() || joined.z_max - joined.z_min > thickness) {
    return StorePatch(joined, a);
  }
  const std::uint64_t bound = MaxWeightSum(thickness);
  joined.sum_w = std::min<std::uint64_t>(std::uint64_t{a.sum_w} + b.sum_w, bound);
  if (joined.sum_w == bound) return StorePatch(joined, a);  // full
  // The sums of the higher one, taken from the lower reference: Σw(z + s), Σw(z + s)².
  const auto shift = static_cast<std::uint64_t>(high.z_min - low.z_min);
  const std::uint64_t shifted_w = shift * high.sum_w;
  joined.sum_wz = low.sum_wz + high.sum_wz + shifted_w;
  joined.sum_wzz = low.sum_wzz + high.sum_wzz + 2 * shift * high.sum_wz + shift * shifted_w;
  StorePatch(joined, a);
}

}  // namespace strata
