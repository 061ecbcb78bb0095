// Random choices that are the same on every machine and library.
#ifndef STRATA_CORE_COMMON_RANDOM_H_
#define STRATA_CORE_COMMON_RANDOM_H_

#include <cstdint>
#include <utility>
#include <vector>

namespace strata {

// SplitMix64 (Steele, Lea, Flood 2014).
class SplitMix64 {
 public:
  explicit SplitMix64(std::uint64_t seed) : state_(seed) {}
  std::uint64_t Next() {
    std::uint64_t z = (state_ += 0x9E3779B97F4A7C15U);
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9U;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBU;
    return z ^ (z >> 31);
  }
  // Uniform in [0, bound); the bias is below 2⁻³². REQUIRES: bound > 0.
  std::uint32_t Below(std::uint32_t bound) {
    return static_cast<std::uint32_t>(((Next() >> 32) * bound) >> 32);
  }
  // Uniform in [0, 1).
  double Uniform() { return static_cast<double>(Next() >> 11) * 0x1.0p-53; }

 private:
  std::uint64_t state_;
};

// `count` different numbers out of [0, size), one out of each of `count` equal stretches, in random
// order; all of them when count ≥ size. Even along the order of what they index, which for the
// features of a map means even over its area.
inline std::vector<std::uint32_t> SampleIndices(std::uint32_t size,
                                                std::uint32_t count,
                                                SplitMix64& random) {
  if (count > size) count = size;
  std::vector<std::uint32_t> indices(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    const auto begin = static_cast<std::uint32_t>(std::uint64_t{i} * size / count);
    const auto end = static_cast<std::uint32_t>((std::uint64_t{i} + 1) * size / count);
    indices[i] = begin + random.Below(end - begin);
  }
  for (std::uint32_t i = count; i > 1; --i) std::swap(indices[i - 1], indices[random.Below(i)]);
  return indices;
}

}  // namespace strata

#endif  // STRATA_CORE_COMMON_RANDOM_H_
