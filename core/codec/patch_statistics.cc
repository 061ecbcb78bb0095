#include "core/codec/patch_statistics.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <optional>

namespace strata {
namespace {

std::uint64_t TopWeight(const Patch& patch) {
  return WeightOfCode(static_cast<std::uint8_t>(patch.top_sigma_code));
}

// The smallest code of that weight.
std::optional<std::uint8_t> CodeOfWeight(std::uint64_t weight) {
  static const std::array<std::uint32_t, 256> weights = [] {
    std::array<std::uint32_t, 256> descending{};
    for (int code = 0; code < 256; ++code) {
      descending[code] = WeightOfCode(static_cast<std::uint8_t>(code));
    }
    return descending;
  }();
  const auto* const found = std::lower_bound(
      weights.begin(), weights.end(), weight, [](std::uint32_t w, std::uint64_t wanted) {
        return w > wanted;
      });
  if (found == weights.end() || *found != weight) return std::nullopt;
  return static_cast<std::uint8_t>(found - weights.begin());
}

bool FindPair(const Patch& patch, OtherMeasurements& others) {
  const auto lowest = CodeOfWeight(patch.sum_w - TopWeight(patch));
  if (patch.count != 2 || !lowest.has_value()) return false;
  others.lowest_code = *lowest;
  return true;
}

// Solves w·z = Σwz − w_top·h and w·z² = Σwzz − w_top·h² for the middle measurement.
bool FindTriple(const Patch& patch, OtherMeasurements& others) {
  const auto height = static_cast<std::uint64_t>(patch.height_ticks());
  const std::uint64_t wz = patch.sum_wz - TopWeight(patch) * height;
  const std::uint64_t wzz = patch.sum_wzz - TopWeight(patch) * height * height;
  if (patch.count != 3 || wz == 0) return false;
  const std::uint64_t z = wzz / wz;
  if (z == 0 || z > height) return false;
  const std::uint64_t w = wz / z;
  const auto middle = CodeOfWeight(w);
  const auto lowest = CodeOfWeight(patch.sum_w - TopWeight(patch) - w);
  if (!middle.has_value() || !lowest.has_value()) return false;
  others = {*lowest, *middle, static_cast<std::int32_t>(z)};
  return true;
}

bool Implies(PatchShape shape, const OtherMeasurements& others, const Patch& patch) {
  Patch implied = patch;
  ImplySums(shape, others, implied);
  return implied == patch;
}

}  // namespace

void ImplySums(PatchShape shape, const OtherMeasurements& others, Patch& patch) {
  if (shape == PatchShape::kSums) return;
  const auto height = static_cast<std::uint64_t>(patch.height_ticks());
  std::uint64_t w = 0;
  std::uint64_t wz = 0;
  std::uint64_t wzz = 0;
  const auto add = [&](std::uint64_t weight, std::uint64_t z) {
    w += weight;
    wz += weight * z;
    wzz += weight * z * z;
  };
  if (shape != PatchShape::kVertical) add(TopWeight(patch), height);
  if (shape == PatchShape::kPair || shape == PatchShape::kTriple) {
    add(WeightOfCode(others.lowest_code), 0);
  }
  if (shape == PatchShape::kTriple) {
    add(WeightOfCode(others.middle_code), static_cast<std::uint64_t>(others.middle_ticks));
  }
  patch.sum_w = w;
  patch.sum_wz = wz;
  patch.sum_wzz = wzz;
}

PatchShape ShapeOf(const Patch& patch, OtherMeasurements& others) {
  if (patch.vertical()) {
    return Implies(PatchShape::kVertical, others, patch) ? PatchShape::kVertical
                                                         : PatchShape::kSums;
  }
  if (patch.count == 1 && patch.height_ticks() == 0 &&
      Implies(PatchShape::kSingle, others, patch)) {
    return PatchShape::kSingle;
  }
  if (FindPair(patch, others) && Implies(PatchShape::kPair, others, patch)) {
    return PatchShape::kPair;
  }
  if (FindTriple(patch, others) && Implies(PatchShape::kTriple, others, patch)) {
    return PatchShape::kTriple;
  }
  return PatchShape::kSums;
}

std::uint64_t ExpectedSumW(const Patch& patch) { return patch.count * TopWeight(patch); }

std::uint64_t ExpectedSumWz(const Patch& patch) {
  // One measurement at the top, one at the bottom, the others half-way on the whole.
  const auto height = static_cast<std::uint64_t>(patch.height_ticks());
  return TopWeight(patch) * height + (patch.sum_w - 2 * TopWeight(patch)) / 2 * height;
}

std::uint64_t ExpectedSumWzz(const Patch& patch) {
  // What is not at the top: Σw, Σwz of it, and at least (Σwz)²/Σw.
  const auto height = static_cast<std::uint64_t>(patch.height_ticks());
  const std::uint64_t top = TopWeight(patch);
  const std::uint64_t w = std::max<std::uint64_t>(patch.sum_w - top, 1);
  const std::uint64_t wz = patch.sum_wz - top * height;
  const std::uint64_t mean = wz / w;
  const std::uint64_t rest = wz % w;
  const int shift = std::max(0, static_cast<int>(std::bit_width(w)) - 31);
  const std::uint64_t rest_squared = ((rest >> shift) * (rest >> shift) / (w >> shift)) << shift;
  return top * height * height + mean * (wz + rest) + rest_squared;
}

}  // namespace strata
