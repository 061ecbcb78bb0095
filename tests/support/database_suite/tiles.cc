// Conformance: tiles.
#include <algorithm>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/codec/surface_tile_codec.h"
#include "tests/support/database_suite/database_suite.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::_;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using Code = absl::StatusCode;

std::vector<api::TileUpdate> Fetched(api::Database& db, const std::vector<api::HeldTile>& held) {
  std::vector<api::TileUpdate> updates;
  STRATA_EXPECT_OK(db.tiles().Fetch({}, kMap, {}, held, [&updates](const api::TileUpdate& update) {
    updates.push_back(update);
    return absl::OkStatus();
  }));
  return updates;
}

TEST_P(DatabaseSuite, TilesAreFetchedOnlyWhenTheyDiffer) {
  PutFloor(db(), {"run", 1});
  const std::vector<api::TileUpdate> all = Fetched(db(), {});
  ASSERT_THAT(all, SizeIs(4));  // the floor lies around the corner of four tiles
  std::vector<api::HeldTile> held;
  for (const api::TileUpdate& update : all) {
    EXPECT_EQ(update.kind, api::TileUpdate::Kind::kNew);
    STRATA_ASSERT_OK_AND_ASSIGN(const SurfaceTile tile, DecodeSurfaceTile(update.tile.bytes));
    EXPECT_EQ(tile.surfaces.size(), 1600U);  // 4 m × 4 m of 10 cm cells
    STRATA_ASSERT_OK_AND_ASSIGN(const api::EncodedTile got,
                                db().tiles().Get({}, kMap, update.tile.key));
    EXPECT_EQ(got.bytes, update.tile.bytes);
    held.push_back({update.tile.key, update.tile.version});
  }
  EXPECT_THAT(Fetched(db(), held), IsEmpty());
  PutFloor(db(), {"run", 2}, 100.0);
  for (const api::TileUpdate& update : Fetched(db(), held)) {
    EXPECT_EQ(update.kind, api::TileUpdate::Kind::kNew);
    EXPECT_GE(update.tile.key.x, 3);
  }
  held[0].version += 1000;
  const auto kinds = [&](api::TileUpdate::Kind kind) {
    const auto updates = Fetched(db(), held);
    return std::count_if(
        updates.begin(), updates.end(), [kind](const auto& u) { return u.kind == kind; });
  };
  EXPECT_EQ(kinds(api::TileUpdate::Kind::kChanged), 1);
  STRATA_ASSERT_OK(db().scans().Delete({}, kMap, {"run", 1}));
  EXPECT_EQ(kinds(api::TileUpdate::Kind::kGone), 4);
  EXPECT_THAT(db().tiles().Get({}, kMap, held[1].key), StatusIs(Code::kNotFound, _));
  EXPECT_THAT(db().scans().Delete({}, kMap, {"run", 1}), StatusIs(Code::kNotFound, _));
}

TEST_P(DatabaseSuite, TileListingsKeepToTheirArea) {
  PutFloor(db(), {"run", 1});
  api::TileArea area;
  area.x_min = 0;
  STRATA_ASSERT_OK_AND_ASSIGN(const auto tiles, db().tiles().List({}, kMap, area));
  ASSERT_THAT(tiles, SizeIs(2));
  EXPECT_EQ(tiles[0].key, (TileKey{0, 0, -1}));
  EXPECT_EQ(tiles[1].key, (TileKey{0, 0, 0}));
  EXPECT_EQ(tiles[0].patches, 1600U);
  area.level = kMaxLevel + 1;
  EXPECT_THAT(db().tiles().List({}, kMap, area), StatusIs(Code::kInvalidArgument, HasSubstr("13")));
}

TEST_P(DatabaseSuite, AnEarlierEpochHasTheTilesOfItsPoses) {
  PutFloor(db(), {"run", 1});
  const std::vector<api::TileUpdate> before = Fetched(db(), {});
  STRATA_ASSERT_OK_AND_ASSIGN(const MapStats then, db().maps().Stats({}, kMap));
  const Pose moved = MakePose(Eigen::Quaterniond::Identity(), {300.0, 0.0, 0.0});
  STRATA_ASSERT_OK(db().posegraph().SetPose({}, kMap, {"run", 1}, moved));
  std::vector<api::TileUpdate> again;
  const auto take = [&again](const api::TileUpdate& update) {
    again.push_back(update);
    return absl::OkStatus();
  };
  STRATA_ASSERT_OK(db().tiles().Fetch({}, kMap, {.epoch = then.epoch}, {}, take));
  ASSERT_EQ(again.size(), before.size());
  for (std::size_t i = 0; i < again.size(); ++i) {
    EXPECT_EQ(again[i].tile.key, before[i].tile.key);
    EXPECT_EQ(again[i].tile.epoch, then.epoch);
    EXPECT_EQ(again[i].tile.version, 0U);
    STRATA_ASSERT_OK_AND_ASSIGN(const SurfaceTile a, DecodeSurfaceTile(again[i].tile.bytes));
    STRATA_ASSERT_OK_AND_ASSIGN(const SurfaceTile b, DecodeSurfaceTile(before[i].tile.bytes));
    EXPECT_EQ(a.surfaces, b.surfaces);
  }
  EXPECT_THAT(db().tiles().List({}, kMap, {.epoch = then.epoch + 9}),
              StatusIs(Code::kNotFound, HasSubstr("map history")));
  EXPECT_THAT(db().tiles().List({}, kMap, {.level = 1, .epoch = then.epoch}),
              StatusIs(Code::kInvalidArgument, HasSubstr("level 1")));
}

}  // namespace
}  // namespace strata::testing
