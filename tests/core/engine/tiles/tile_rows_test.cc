// Rows of tiles that newer ones stand in for: dropped as tiles change, not only when a map is
// opened.
#include <cstdint>
#include <string>

#include <gtest/gtest.h>

#include "tests/core/engine/engine_fixture.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

constexpr std::uint64_t kChanges = 6;

class TileRowsTest : public EngineTest {
 protected:
  // The served tiles' newest row, and the one that a reader who began before may still see.
  void ExpectNoOldRows() {
    Close();
    constexpr char kMost[] = "SELECT max(n) FROM (SELECT count(*) AS n FROM ";
    constexpr char kByTile[] = " GROUP BY level, x, y)";
    EXPECT_LE(Number(std::string(kMost) + "derived_surface_tile" + kByTile), 2);
    EXPECT_EQ(
        Number("SELECT max(n) FROM (SELECT count(*) AS n FROM derived_mls_tile GROUP BY x, y)"), 1);
  }
};

TEST_F(TileRowsTest, ScansThatComeInLeaveNoOldRows) {
  MakeMap();
  for (std::uint64_t i = 1; i <= kChanges; ++i) {
    UploadRoom(i, RoomPose(1));
    WaitIntegrated(db());
  }
  ExpectNoOldRows();
}

TEST_F(TileRowsTest, ScansThatMoveLeaveNoOldRows) {
  MakeMap();
  const ScanId id = UploadRoom(1, RoomPose(1));
  WaitIntegrated(db());
  for (std::uint64_t i = 1; i <= kChanges; ++i) {
    Pose T_map_scan = RoomPose(1);
    T_map_scan.translation().x() += 0.01 * static_cast<double>(i);
    STRATA_EXPECT_OK(db().posegraph().SetPose({}, kMapName, id, T_map_scan));
  }
  ExpectNoOldRows();
}

}  // namespace
}  // namespace strata::testing
