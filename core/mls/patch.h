// One surface in one cell, with the statistics that make joins exact (thesis 6.5.1–6.5.3).
#ifndef STRATA_CORE_MLS_PATCH_H_
#define STRATA_CORE_MLS_PATCH_H_

#include <bit>
#include <cstdint>
#include <cstring>

#include "core/mls/mls_parameters.h"

namespace strata {

// The standard deviation of a measurement, coded in 8 bits on a logarithmic scale from 2 mm (code
// 0) to 512 mm (code 255); steps of 2.2 %. Values outside are clamped.
std::uint8_t SigmaCode(double sigma_m);
double SigmaOfCode(std::uint8_t code);
// The smallest σ whose code is `code`; 0 for code 0.
double SigmaCodeBoundary(std::uint8_t code);
// 1/σ² in fixed point: 65536 at 2 mm, 1 at 512 mm. 1/σ² = weight · kPrecisionPerWeight [1/m²].
std::uint32_t WeightOfCode(std::uint8_t code);
inline constexpr double kPrecisionPerWeight = 1.0 / (65536.0 * 0.002 * 0.002);

// The statistics of one height interval, 32 bytes. A pure function of the multiset of its
// measurements (height in ticks, σ code), so that joining is commutative and associative, bit for
// bit:
//   z_min, z_max   lowest and highest height
//   top_sigma_code σ of the highest measurement; the smallest σ wins a tie
//   count          number of measurements, saturating at kMaxCount
//   sides          kSeenFromAbove, kSeenFromBelow, both or neither (nobody knows); see sides.h
//   sum_w, sum_wz, sum_wzz   Σw, Σw(z − z_min), Σw(z − z_min)² with w = WeightOfCode(σ code), while
//   the interval is
//                  horizontal (z_max − z_min ≤ τ); all zero once it is vertical, where only the
//                  highest measurement counts (6.5.2). A patch whose Σw reaches MaxWeightSum(τ) is
//                  *full*: sum_w stays there and the other sums are zero; its height is the middle
//                  of the interval.
// In memory the four words are sum_wzz; sum_wz | top_sigma_code · 2⁵⁴ | sides · 2⁶²; sum_w | count
// · 2⁴⁴; cell | z_min mod 2²⁴ · 2¹⁶ | z_max mod 2²⁴ · 2⁴⁰, little-endian. Widths: with τ ≤ 1 m, (z
// − z_min) ≤ 2¹² and MaxWeightSum keeps every sum inside its field.
struct Patch {
  std::uint64_t sum_wzz = 0;
  std::uint64_t sum_wz : 54 = 0;
  std::uint64_t top_sigma_code : 8 = 0;
  std::uint64_t sides : 2 = 0;
  std::uint64_t sum_w : 44 = 0;
  std::uint64_t count : 20 = 0;
  std::uint64_t cell : 16 = 0;  // CellInTile
  std::int64_t z_min : 24 = 0;  // ticks
  std::int64_t z_max : 24 = 0;  // ticks

  static constexpr std::uint32_t kMaxCount = (1U << 20) - 1;
  static constexpr std::uint8_t kSeenFromAbove = 1;
  static constexpr std::uint8_t kSeenFromBelow = 2;

  // Taller than τ: stands for a wall, a trunk, or a deck seen from both sides. Steers matching,
  // sampling and drawing only; the top of every patch may be driven on.
  bool vertical() const { return sum_w == 0; }
  // Seen from below only: its top is higher, nobody knows by how much.
  bool underside() const { return sides == kSeenFromBelow; }
  std::int32_t height_ticks() const { return static_cast<std::int32_t>(z_max - z_min); }

  // Height of the surface [m]: the fused mean (eq. 6.1), or of a vertical patch its highest
  // measurement.
  double mean_m() const;
  // σ of mean_m() [m]: √(1/Σ1/σ²) (eq. 6.2), or of a vertical patch that of its highest
  // measurement.
  double sigma_m() const;
  // Length of a vertical interval [m]; 0 for a horizontal one (6.5.1).
  double depth_m() const { return vertical() ? height_ticks() / double{kTicksPerMetre} : 0.0; }
  double bottom_m() const { return static_cast<double>(z_min) / kTicksPerMetre; }
  double top_m() const { return static_cast<double>(z_max) / kTicksPerMetre; }
  // Weighted standard deviation of the heights around their mean [m]: roughness and crispness; 0
  // when vertical.
  double spread_m() const;

  // `x == y` compares every field.
  friend bool operator==(const Patch&, const Patch&) = default;
};
static_assert(sizeof(Patch) == 32 && std::endian::native == std::endian::little);

// The plain numbers of a patch.
struct PatchFields {
  std::uint64_t sum_wzz = 0;
  std::uint64_t sum_wz = 0;
  std::uint64_t sum_w = 0;
  std::uint32_t count = 0;
  std::int32_t z_min = 0;
  std::int32_t z_max = 0;
  std::uint16_t cell = 0;
  std::uint8_t top_sigma_code = 0;
  std::uint8_t sides = 0;
};
// Writes a patch in four whole words. (Bit-fields written one by one, and words gathered in a
// temporary that is then copied, cost a round trip through memory each: half of the time of a map.)
inline void StorePatch(const PatchFields& f, Patch& patch) {
  const std::uint64_t sum_wz_and_top =
      f.sum_wz | std::uint64_t{f.top_sigma_code} << 54 | std::uint64_t{f.sides} << 62;
  const std::uint64_t sum_w_and_count = f.sum_w | std::uint64_t{f.count} << 44;
  const std::uint64_t place = f.cell | (static_cast<std::uint64_t>(f.z_min) & 0xFFFFFF) << 16 |
                              (static_cast<std::uint64_t>(f.z_max) & 0xFFFFFF) << 40;
  auto* const bytes = reinterpret_cast<unsigned char*>(&patch);
  std::memcpy(bytes, &f.sum_wzz, 8);
  std::memcpy(bytes + 8, &sum_wz_and_top, 8);
  std::memcpy(bytes + 16, &sum_w_and_count, 8);
  std::memcpy(bytes + 24, &place, 8);
}

// The bound of Patch::sum_w for a thickness of `thickness_ticks`: the largest 2^k − 1 < 2⁴⁴ with
// which Σw(z − z_min)² fits 64 bits.
std::uint64_t MaxWeightSum(std::int32_t thickness_ticks);

// One measurement as a patch.
Patch PatchOfMeasurement(std::uint16_t cell, std::int32_t z_ticks, std::uint8_t sigma_code);

// True if the two intervals of one cell are one: they overlap or are closer than γ (6.5.2).
bool Touching(const Patch& a, const Patch& b, const MlsParameters& parameters);

// a = the patch of the union of the two multisets. REQUIRES: same cell, Touching().
void JoinInto(Patch& a, const Patch& b, const MlsParameters& parameters);
inline Patch Join(Patch a, const Patch& b, const MlsParameters& parameters) {
  JoinInto(a, b, parameters);
  return a;
}

}  // namespace strata

#endif  // STRATA_CORE_MLS_PATCH_H_
