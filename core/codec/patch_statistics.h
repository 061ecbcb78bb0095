// The join statistics of a patch, told by as few numbers as they need.
//
// Most patches hold few measurements, and then nearly everything follows: of one measurement all
// sums follow from its σ code; of two, from the other's σ code; of three, from the σ codes of the
// other two and the height of the middle one. Only more need sums, and those are told relative to
// what the rest suggests.
#ifndef STRATA_CORE_CODEC_PATCH_STATISTICS_H_
#define STRATA_CORE_CODEC_PATCH_STATISTICS_H_

#include <cstdint>
#include <optional>

#include "core/mls/patch.h"

namespace strata {

enum class PatchShape : std::uint8_t {  // stored
  kSingle = 0,
  kVertical = 1,
  kPair = 2,
  kTriple = 3,
  kSums = 4,
};

// σ codes of the measurements that are not the highest; for a triple also the height above z_min of
// the middle one [ticks].
struct OtherMeasurements {
  std::uint8_t lowest_code = 0;
  std::uint8_t middle_code = 0;
  std::int32_t middle_ticks = 0;
};

// The sums that `shape` and `others` imply for a patch whose heights and top_sigma_code are set.
// For kSums they stay as they are.
void ImplySums(PatchShape shape, const OtherMeasurements& others, Patch& patch);

// The simplest shape whose implied statistics are exactly those of `patch`, with what it needs.
PatchShape ShapeOf(const Patch& patch, OtherMeasurements& others);

// What to expect of sums before they are known: from count, heights and top; then sum_w; then
// sum_wz. Whole-number arithmetic modulo 2⁶⁴: the same on every machine, for any patch.
std::uint64_t ExpectedSumW(const Patch& patch);
std::uint64_t ExpectedSumWz(const Patch& patch);
std::uint64_t ExpectedSumWzz(const Patch& patch);

}  // namespace strata

#endif  // STRATA_CORE_CODEC_PATCH_STATISTICS_H_
