#include "core/mls/join.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "core/mls/mls_map.h"
#include "core/mls/patch.h"
#include "tests/core/mls/reference_map.h"

namespace strata {
namespace {

using ::strata::testing::RandomPose;
using ::strata::testing::ReferenceMap;
using ::strata::testing::ReferenceMeasurement;
using ::strata::testing::Uniform;

// A few cells on both sides of a tile corner, so dense that intervals bridge each other; heights
// from a coarse raster (ties with different σ) or fine, colours and labels in some.
std::vector<ReferenceMeasurement> RandomMeasurements(std::mt19937_64& random, bool annotated) {
  std::vector<ReferenceMeasurement> result(random() % 400);
  const int step = 1 << (random() % 9);
  const int span = 1 + static_cast<int>(random() % 20000);
  const int cells = 1 + static_cast<int>(random() % 5);
  for (ReferenceMeasurement& m : result) {
    m.cell = {static_cast<std::int32_t>(random() % (2 * cells)) - cells,
              static_cast<std::int32_t>(random() % (2 * cells)) - cells};
    m.z = static_cast<std::int64_t>(random() % span) / step * step - span / 2;
    m.sigma_code = static_cast<std::uint8_t>(random() % 256);
    if (!annotated) continue;
    m.colour = {static_cast<std::uint8_t>(random()), static_cast<std::uint8_t>(random()), 7};
    m.label = static_cast<std::uint16_t>(random() % 4);
  }
  return result;
}

MlsParameters RandomParameters(std::mt19937_64& random) {
  return {.cell_size_m = 0.1,
          .gap_size_m = Uniform(random, 0.01, 1.5),
          .thickness_m = Uniform(random, 0.001, 1.0)};
}

TEST(JoinTest, JoinOfMapsIsMapOfUnionInAnyOrderAndAssociation) {
  for (std::uint64_t seed = 1; seed <= 1500; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937_64 random(seed);
    const bool annotated = seed % 3 == 0;
    const MlsParameters parameters = RandomParameters(random);
    std::vector<ReferenceMeasurement> all;
    std::vector<MlsMap> maps;
    for (int part = 0; part < 4; ++part) {
      const auto measurements = RandomMeasurements(random, annotated);
      all.insert(all.end(), measurements.begin(), measurements.end());
      maps.push_back(ReferenceMap(measurements, parameters, annotated));
    }
    const MlsMap expected = ReferenceMap(all, parameters, annotated);
    std::shuffle(maps.begin(), maps.end(), random);
    const MlsMap left = JoinMaps(JoinMaps(JoinMaps(maps[0], maps[1]), maps[2]), maps[3]);
    const MlsMap right = JoinMaps(maps[3], JoinMaps(JoinMaps(maps[2], maps[1]), maps[0]));
    ASSERT_TRUE(left == expected);
    ASSERT_TRUE(right == expected);
    ASSERT_TRUE(JoinAll(maps, parameters) == expected);
    MlsMap accumulated{.parameters = parameters, .tiles = {}};
    for (const MlsMap& map : maps) JoinInto(accumulated, map);
    ASSERT_TRUE(accumulated == expected);
  }
}

}  // namespace
}  // namespace strata
