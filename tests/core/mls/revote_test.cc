#include "core/mls/revote.h"

#include <cstdint>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "core/mls/join.h"
#include "tests/core/mls/reference_map.h"

namespace strata {
namespace {

using ::strata::testing::ReferenceMap;
using ::strata::testing::ReferenceMeasurement;

const MlsParameters kParameters{.cell_size_m = 0.1, .gap_size_m = 0.2, .thickness_m = 0.05};

// In some cells of one tile, with heights that bridge each other.
std::vector<ReferenceMeasurement> RandomMeasurements(std::mt19937_64& random) {
  std::vector<ReferenceMeasurement> result(1 + random() % 300);
  for (ReferenceMeasurement& m : result) {
    m.cell = {static_cast<std::int32_t>(random() % 6), static_cast<std::int32_t>(random() % 6)};
    m.z = static_cast<std::int64_t>(random() % 20000);
    m.sigma_code = static_cast<std::uint8_t>(random() % 256);
    m.label = static_cast<std::uint16_t>(random() % 4);
  }
  return result;
}

MlsTile TileOf(const std::vector<ReferenceMeasurement>& measurements) {
  return ReferenceMap(measurements, kParameters, true).tiles.at(0);
}

TEST(ReplaceVotesTest, IsWhatJoiningEverythingAgainWouldGive) {
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937_64 random(seed);
    std::vector<ReferenceMeasurement> part = RandomMeasurements(random);
    const MlsTile before = TileOf(part);
    const MlsTile others = JoinTiles(
        TileOf(RandomMeasurements(random)), TileOf(RandomMeasurements(random)), kParameters);
    for (ReferenceMeasurement& m : part) {
      if (random() % 2 == 0) m.label = static_cast<std::uint16_t>(random() % 5);
    }
    const MlsTile after = TileOf(part);
    const auto changed = ReplaceVotes(JoinTiles(before, others, kParameters), before, after);
    ASSERT_TRUE(changed.has_value());
    EXPECT_EQ(*changed, JoinTiles(after, others, kParameters));
  }
}

TEST(ReplaceVotesTest, ATileThatCannotHoldThePartIsSeen) {
  std::mt19937_64 random(1);
  const std::vector<ReferenceMeasurement> part = {{.cell = {1, 1}, .z = 100, .label = 2}};
  const std::vector<ReferenceMeasurement> elsewhere = {{.cell = {3, 1}, .z = 100, .label = 2}};
  const std::vector<ReferenceMeasurement> lower = {{.cell = {1, 1}, .z = 90, .label = 2}};
  EXPECT_FALSE(ReplaceVotes(TileOf(elsewhere), TileOf(part), TileOf(part)).has_value());
  EXPECT_FALSE(ReplaceVotes(TileOf(lower), TileOf(part), TileOf(part)).has_value());
  // Fewer votes than leave.
  MlsTile tile = TileOf(part);
  tile.votes.clear();
  MlsTile after = TileOf(part);
  after.votes.clear();
  EXPECT_FALSE(ReplaceVotes(tile, TileOf(part), after).has_value());
}

}  // namespace
}  // namespace strata
