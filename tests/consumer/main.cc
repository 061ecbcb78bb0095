#include <cstdio>

#include "core/mls/build.h"

int main() {
  strata::PointCloud cloud;
  cloud.points = {{0.05F, 0.05F, 0.0F},
                  {0.05F, 0.05F, 4.0F}};  // a floor and a deck above it, in one cell
  const auto result = strata::BuildMlsMap(
      cloud, strata::Pose::Identity(), strata::SensorModel{}, strata::MlsParameters{});
  std::printf("%zu patches\n", result.map.patch_count());
}
