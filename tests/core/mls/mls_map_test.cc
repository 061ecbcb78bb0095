#include "core/mls/mls_map.h"

#include <cstdint>
#include <random>
#include <set>
#include <vector>

#include <gtest/gtest.h>

#include "tests/core/mls/reference_map.h"

namespace strata {
namespace {

using ::strata::testing::ReferenceMap;
using ::strata::testing::ReferenceMeasurement;

TEST(MlsMapTest, FindsEveryCellAndNoOther) {
  std::mt19937_64 random(1);
  std::vector<ReferenceMeasurement> measurements(5000);
  std::set<CellIndex> occupied;
  for (ReferenceMeasurement& m : measurements) {
    m.cell = {static_cast<std::int32_t>(random() % 1200) - 600,
              static_cast<std::int32_t>(random() % 30) - 15};
    m.z = static_cast<std::int64_t>(random() % 40000);
    occupied.insert(m.cell);
  }
  MlsMap map = ReferenceMap(measurements, MlsParameters{});
  std::size_t patches = 0;
  for (int x = -700; x < 700; ++x) {
    for (int y = -20; y < 20; ++y) {
      const auto cell = map.Cell({x, y});
      ASSERT_EQ(cell.empty(), occupied.count({x, y}) == 0);
      patches += cell.size();
      for (std::size_t i = 1; i < cell.size(); ++i) ASSERT_LT(cell[i - 1].z_max, cell[i].z_min);
    }
  }
  EXPECT_EQ(patches, map.patch_count());
  EXPECT_EQ(map.occupied_cell_count(), occupied.size());
  const MlsMap expected = map;
  for (MlsTile& tile : map.tiles) {
    tile.row_begin.fill(77);
    tile.IndexRows();
  }
  EXPECT_TRUE(map == expected);
}

TEST(MlsMapTest, EmptyMapHasNothing) {
  const MlsMap map;
  EXPECT_TRUE(map.Cell({0, 0}).empty());
  EXPECT_EQ(map.Find({0, 0, 0}), nullptr);
  EXPECT_EQ(map.patch_count(), 0U);
}

}  // namespace
}  // namespace strata
