// A small scene with two classes, for tests of classification.
#ifndef STRATA_TESTS_SUPPORT_SIMULATOR_PARK_H_
#define STRATA_TESTS_SUPPORT_SIMULATOR_PARK_H_

#include <cstdint>

#include "core/cloud/point_cloud.h"

namespace strata::testing {

inline constexpr std::uint16_t kParkGround = 1;
inline constexpr std::uint16_t kParkPole = 2;

// A noisy level floor of 8 × 8 m with six poles of 3 m somewhere on it, every point labelled; about
// 2,500 points, others for another seed.
PointCloud MakePark(std::uint64_t seed);

}  // namespace strata::testing

#endif  // STRATA_TESTS_SUPPORT_SIMULATOR_PARK_H_
