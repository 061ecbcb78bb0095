#include "tests/support/simulator/park.h"

#include <random>

namespace strata::testing {

PointCloud MakePark(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<float> place(-4.0F, 4.0F);
  std::uniform_real_distribution<float> height(0.1F, 3.0F);
  std::normal_distribution<float> noise(0.0F, 0.01F);
  PointCloud cloud;
  for (int k = 0; k < 1500; ++k) {
    cloud.points.emplace_back(place(random), place(random), noise(random));
    cloud.label.push_back(kParkGround);
  }
  for (int pole = 0; pole < 6; ++pole) {
    const float x = place(random);
    const float y = place(random);
    for (int k = 0; k < 160; ++k) {
      cloud.points.emplace_back(x + noise(random), y + noise(random), height(random));
      cloud.label.push_back(kParkPole);
    }
  }
  return cloud;
}

}  // namespace strata::testing
