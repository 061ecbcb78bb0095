// What the experiments on global constraints (thesis 7.4.4) are run with. Fixed before the first
// result was seen: a change here makes every table a new one.
#ifndef STRATA_TESTS_EXPERIMENTS_PLANES_GLOBAL_CONSTRAINT_CASES_H_
#define STRATA_TESTS_EXPERIMENTS_PLANES_GLOBAL_CONSTRAINT_CASES_H_

#include <array>
#include <cstdint>

#include "tests/support/simulator/views.h"

namespace strata::testing {

// Variances (0.0005 rad² | 0.05 m²) and (0.0008 | 0.08), as standard deviations.
struct StartNoise {
  const char* name;
  double sigma_rad, sigma_m;
};
inline constexpr std::array<StartNoise, 2> kStartNoise = {StartNoise{"low", 0.0224, 0.224},
                                                          StartNoise{"high", 0.0283, 0.283}};

// Table 7.1 and Fig. 7.9: seeds of the range noise and of the starts; 4 views, and 2 to 6.
inline constexpr std::uint64_t kViewSeed = 71;
inline constexpr std::array<std::uint64_t, 10> kStartSeeds = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10};
inline constexpr int kTableViews = 4;
inline constexpr int kMinViews = 2, kMaxViews = 6;
// A start that ends farther from the truth than the noise put it on average (σ · 1.6 is the mean
// length of three errors) has diverged.
inline constexpr double kDivergedFactor = 1.6;

// σ_α: 6 views around the building, started with the low noise.
inline constexpr std::uint64_t kBuildingSeed = 78;
inline constexpr int kBuildingViews = 6;
inline constexpr Tour kBuildingTour = {.half_x_m = 55.0,
                                       .half_y_m = 32.0,
                                       .height_m = 1.8,
                                       .first_angle_rad = 0.3,
                                       .pixel_rad = 0.0044,
                                       .elevation_min_rad = -0.3,
                                       .elevation_max_rad = 0.5,
                                       .sigma_m = 0.015};

}  // namespace strata::testing

#endif  // STRATA_TESTS_EXPERIMENTS_PLANES_GLOBAL_CONSTRAINT_CASES_H_
