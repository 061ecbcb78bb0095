// Tiles: a function of the scans alone, and streams of what changed.
#include <algorithm>
#include <cstdint>
#include <map>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/codec/surface_tile_codec.h"
#include "tests/core/engine/engine_fixture.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

class EngineTilesTest : public EngineTest {};

TEST_F(EngineTilesTest, TilesDoNotDependOnOrderBatchesOrThreads) {
  MakeMap();
  UploadRooms(7);
  const MapStats forward = WaitIntegrated(db());
  EXPECT_EQ(forward.scans, 7U);
  EXPECT_EQ(forward.scans_failed, 0U);
  EXPECT_GT(forward.patches, 5000U);
  EXPECT_GT(forward.tiles, 3U);
  const auto tiles = AllTiles(db());
  Close();

  EngineOptions options = Options();
  options.max_batch_scans = 1;
  options.worker_threads = 4;
  Reopen(options);
  MakeMap(SmallMap(), "other");
  for (std::uint64_t i = 7; i >= 1; --i) UploadRoom(i, RoomPose(i), "other");
  EXPECT_EQ(WaitIntegrated(db(), "other").content_digest, forward.content_digest);
  const auto other = AllTiles(db(), "other");
  ASSERT_EQ(other.size(), tiles.size());
  for (const auto& [key, bytes] : tiles) {
    const SurfaceTile a = DecodeSurfaceTile(bytes).value();
    const SurfaceTile b = DecodeSurfaceTile(other.at(key)).value();
    EXPECT_EQ(a.surfaces, b.surfaces) << key.ToString();
  }
}

TEST_F(EngineTilesTest, FetchSendsOnlyWhatChangedOrIsGone) {
  MakeMap();
  UploadRoom(1, PoseAt(0, 0));
  UploadRoom(2, PoseAt(200, 0));
  WaitIntegrated(db());
  STRATA_ASSERT_OK_AND_ASSIGN(const auto infos, db().tiles().List({}, kMapName, {}));
  std::vector<api::HeldTile> held;
  for (const api::TileInfo& info : infos) held.push_back({info.key, info.version});
  const auto fetch = [&] {
    std::map<TileKey, api::TileUpdate::Kind> kinds;
    STRATA_EXPECT_OK(db().tiles().Fetch({}, kMapName, {}, held, [&](const api::TileUpdate& u) {
      kinds[u.tile.key] = u.kind;
      return absl::OkStatus();
    }));
    return kinds;
  };
  EXPECT_TRUE(fetch().empty());
  STRATA_ASSERT_OK(db().scans().Delete({}, kMapName, {"run", 2}));
  const auto kinds = fetch();
  EXPECT_FALSE(kinds.empty());
  for (const auto& [key, kind] : kinds) {
    EXPECT_EQ(kind, api::TileUpdate::Kind::kGone) << key.ToString();
    EXPECT_GT(key.x, 5);
  }
}

TEST_F(EngineTilesTest, ADamagedTileIsMarkedAndTheOthersAreServed) {
  MakeMap();
  UploadRooms(4);
  WaitIntegrated(db());
  STRATA_ASSERT_OK_AND_ASSIGN(const auto infos, db().tiles().List({}, kMapName, {}));
  ASSERT_GT(infos.size(), 3U);
  const api::TileInfo damaged = infos[1];
  const auto before = AllTiles(db());
  Close();
  DamageSurfaceTile(damaged.key);
  Reopen();
  const auto fetch = [&](const std::vector<api::HeldTile>& held) {
    std::map<TileKey, api::TileUpdate> updates;
    STRATA_EXPECT_OK(db().tiles().Fetch({}, kMapName, {}, held, [&](const api::TileUpdate& u) {
      updates[u.tile.key] = u;
      return absl::OkStatus();
    }));
    return updates;
  };
  const auto updates = fetch({});
  EXPECT_EQ(updates.size(), infos.size());
  for (const auto& [key, update] : updates) {
    const bool whole = key != damaged.key;
    EXPECT_EQ(update.kind, whole ? api::TileUpdate::Kind::kNew : api::TileUpdate::Kind::kDamaged);
    EXPECT_EQ(update.tile.bytes, whole ? before.at(key) : "");
  }
  EXPECT_EQ(updates.at(damaged.key).tile.version, damaged.version);
  // Whoever has it whole is not told; whoever has an old one is.
  EXPECT_FALSE(fetch({{damaged.key, damaged.version}}).contains(damaged.key));
  EXPECT_EQ(fetch({{damaged.key, damaged.version + 1}}).at(damaged.key).kind,
            api::TileUpdate::Kind::kDamaged);
  EXPECT_EQ(RunJob(db(), "rebuild").state, JobState::kSucceeded);
  EXPECT_EQ(fetch({}).at(damaged.key).kind, api::TileUpdate::Kind::kNew);
}

TEST_F(EngineTilesTest, TilesKeptInMemoryAreThoseOfTheStore) {
  const unsigned seed = std::random_device()();
  SCOPED_TRACE(seed);
  std::mt19937 draw(seed);
  EngineOptions options = Options();
  options.cache_bytes = 40'000;  // room for a few tiles
  Reopen(options);
  MakeMap();
  std::set<TileKey> ever;
  for (std::uint64_t step = 1; step <= 12; ++step) {
    switch (step < 4 ? 0 : draw() % 3) {
      case 0:
        UploadRoom(step, PoseAt(draw() % 30, draw() % 30));
        break;
      case 1:
        STRATA_ASSERT_OK(db().posegraph().SetPose({}, kMapName, {"run", 1}, PoseAt(step, 5)));
        break;
      default:
        db().scans().Delete({}, kMapName, {"run", 2 + draw() % step}).IgnoreError();
    }
    WaitIntegrated(db());
    const auto tiles = AllTiles(db());
    for (const auto& [key, _] : tiles) ever.insert(key);
    for (const TileKey& key : ever) {
      const auto tile = db().tiles().Get({}, kMapName, key);
      ASSERT_EQ(tile.ok(), tiles.contains(key)) << key.ToString();
      EXPECT_TRUE(!tile.ok() || tile->bytes == tiles.at(key)) << key.ToString();
    }
    if (step % 3 != 0) continue;
    Reopen(options);
    EXPECT_EQ(AllTiles(db()), tiles) << "after step " << step;
  }
}

TEST_F(EngineTilesTest, AStreamKeepsToTheStateItBeganWith) {
  MakeMap();
  UploadRooms(4);
  WaitIntegrated(db());
  const auto before = AllTiles(db());
  std::map<TileKey, std::string> streamed;
  bool moved = false;
  STRATA_ASSERT_OK(db().tiles().Fetch({}, kMapName, {}, {}, [&](const api::TileUpdate& update) {
    streamed[update.tile.key] = update.tile.bytes;
    if (!moved) {
      moved = true;
      STRATA_EXPECT_OK(db().posegraph().SetPose({}, kMapName, {"run", 4}, PoseAt(60, 60)));
      STRATA_EXPECT_OK(db().scans().Delete({}, kMapName, {"run", 1}));
    }
    return absl::OkStatus();
  }));
  for (const auto& [key, bytes] : streamed) EXPECT_EQ(bytes, before.at(key)) << key.ToString();
  EXPECT_EQ(streamed.size(), std::count_if(before.begin(), before.end(), [](const auto& tile) {
              return tile.first.level == 0;
            }));
}

}  // namespace
}  // namespace strata::testing
