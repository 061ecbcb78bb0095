// Random choices that are the same on every machine and library.
#ifndef STRATA_CORE_REGISTRATION_RANDOM_H_
#define STRATA_CORE_REGISTRATION_RANDOM_H_

#include <cstdint>
#include <numeric>
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

// `count` different numbers out of [0, size) in random order; all of them when count ≥ size.
inline std::vector<std::uint32_t> SampleIndices(std::uint32_t size,
                                                std::uint32_t count,
                                                std::uint64_t seed) {
  std::vector<std::uint32_t> indices(size);
  std::iota(indices.begin(), indices.end(), 0U);
  SplitMix64 random(seed);
  if (count > size) count = size;
  for (std::uint32_t i = 0; i < count; ++i) {
    std::swap(indices[i], indices[i + random.Below(size - i)]);
  }
  indices.resize(count);
  return indices;
}

}  // namespace strata

#endif  // STRATA_CORE_REGISTRATION_RANDOM_H_
