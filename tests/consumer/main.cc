#include <cstdio>

#include "core/mls/build.h"

int main() {
  strata::PointCloud cloud;  // a floor and a deck above it, in one cell
  cloud.points = {{0.05F, 0.05F, 0.0F}, {0.05F, 0.05F, 4.0F}};
  const auto built = strata::BuildMlsMap(cloud, strata::Pose::Identity(), {}, {});
  if (!built.ok()) return 1;
  std::printf("%zu patches\n", built->map.patch_count());
}
