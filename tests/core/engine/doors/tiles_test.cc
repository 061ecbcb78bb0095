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
  options.cache_bytes = 400'000;  // tiles have an eighth of it: room for a few
  Reopen(options);
  MakeMap();
  std::set<TileKey> ever;
  const auto all_at_hand = [&] {
    std::map<TileKey, std::string> tiles;
    for (const TileKey& key : ever) {
      const auto tile = db().tiles().GetAtHand({}, kMapName, key);
      STRATA_EXPECT_OK(tile.status());
      if (tile.ok() && tile->has_value()) tiles[key] = (*tile)->bytes;
    }
    return tiles;
  };
  std::size_t at_hand = 0;
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
    auto held = all_at_hand();  // of what the step before left in memory, only what is still so
    const auto tiles = AllTiles(db());
    for (const auto& tile : tiles) ever.insert(tile.first);
    held.merge(all_at_hand());
    at_hand += held.size();
    for (const auto& [key, bytes] : held) {
      ASSERT_TRUE(tiles.contains(key)) << key.ToString();
      EXPECT_EQ(bytes, tiles.at(key)) << key.ToString();
    }
    for (const TileKey& key : ever) {
      const auto tile = db().tiles().Get({}, kMapName, key);
      ASSERT_EQ(tile.ok(), tiles.contains(key)) << key.ToString();
      EXPECT_TRUE(!tile.ok() || tile->bytes == tiles.at(key)) << key.ToString();
    }
    if (step % 3 != 0) continue;
    Reopen(options);
    EXPECT_EQ(AllTiles(db()), tiles) << "after step " << step;
  }
  EXPECT_GT(at_hand, 0U);
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

// Bytes of level 0 in an epoch, the version left out.
std::map<TileKey, std::vector<Surface>> SurfacesAt(api::Database& database,
                                                   std::uint64_t epoch,
                                                   const api::TileArea& area = {},
                                                   const std::string& map = kMapName) {
  std::map<TileKey, std::vector<Surface>> tiles;
  api::TileArea asked = area;
  asked.epoch = epoch;
  STRATA_EXPECT_OK(database.tiles().Fetch({}, map, asked, {}, [&](const api::TileUpdate& update) {
    EXPECT_EQ(update.tile.epoch, epoch);
    const SurfaceTile tile = DecodeSurfaceTile(update.tile.bytes).value();
    EXPECT_EQ(tile.version, update.tile.version);
    EXPECT_TRUE(tiles.emplace(update.tile.key, tile.surfaces).second);
    return absl::OkStatus();
  }));
  return tiles;
}

class EngineEpochTilesTest : public EngineTest {
 protected:
  // Moves some rooms of a map of seven, again and again; what each epoch looked like.
  void MakeHistory() {
    MakeMap();
    UploadRooms(7);
    for (const std::uint64_t i : {0U, 3U, 5U, 3U}) {
      if (i != 0) {
        const Pose moved = PoseAt(9.0 * static_cast<double>(history_.size()) - 20.0, 31.0, 0.4);
        STRATA_ASSERT_OK(db().posegraph().SetPose({}, kMapName, {"run", i}, moved));
      }
      const MapStats stats = WaitIntegrated(db());
      history_[stats.epoch] = SurfacesAt(db(), stats.epoch);
    }
  }
  std::map<std::uint64_t, std::map<TileKey, std::vector<Surface>>> history_;
};

TEST_F(EngineEpochTilesTest, AnEarlierEpochHasTheTilesThatWereServedInIt) {
  MakeHistory();
  ASSERT_EQ(history_.size(), 4U);
  for (const auto& [epoch, tiles] : history_) EXPECT_EQ(SurfacesAt(db(), epoch), tiles) << epoch;
  EXPECT_NE(history_.begin()->second, history_.rbegin()->second);
  EngineOptions options = Options();
  options.worker_threads = 4;
  Reopen(options);
  for (const auto& [epoch, tiles] : history_) EXPECT_EQ(SurfacesAt(db(), epoch), tiles) << epoch;
}

TEST_F(EngineEpochTilesTest, AnAreaOfItHasTheTilesOfTheWhole) {
  MakeHistory();
  const auto& [epoch, whole] = *history_.begin();
  for (const auto& [key, surfaces] : whole) {
    const auto one = SurfacesAt(
        db(), epoch, {.x_min = key.x, .x_max = key.x + 1, .y_min = key.y, .y_max = key.y + 1});
    ASSERT_EQ(one.size(), 1U) << key.ToString();
    EXPECT_EQ(one.at(key), surfaces) << key.ToString();
  }
}

TEST_F(EngineEpochTilesTest, ScansThatCameSinceAreNotInItAndDeletedOnesAreGone) {
  MakeHistory();
  UploadRoom(8, PoseAt(0.0, 0.0));
  WaitIntegrated(db());
  const std::uint64_t first = history_.begin()->first;
  EXPECT_EQ(SurfacesAt(db(), first), history_.at(first));
  STRATA_ASSERT_OK(db().scans().Delete({}, kMapName, {"run", 3}));
  STRATA_ASSERT_OK(db().scans().Delete({}, kMapName, {"run", 6}));
  MakeMap(SmallMap(), "other");
  for (const std::uint64_t i : {1U, 2U, 4U, 5U, 7U}) UploadRoom(i, RoomPose(i), "other");
  const MapStats other = WaitIntegrated(db(), "other");
  EXPECT_EQ(SurfacesAt(db(), first), SurfacesAt(db(), other.epoch, {}, "other"));
}

TEST_F(EngineEpochTilesTest, OnlyTilesThatAreOtherwiseNowAreSentToOneWhoHoldsThoseOfNow) {
  MakeHistory();
  STRATA_ASSERT_OK_AND_ASSIGN(const auto infos, db().tiles().List({}, kMapName, {}));
  std::vector<api::HeldTile> held;
  for (const api::TileInfo& info : infos) held.push_back({info.key, info.version});
  const auto& [epoch, then] = *history_.begin();
  const auto& now = history_.rbegin()->second;
  std::map<TileKey, api::TileUpdate::Kind> kinds;
  STRATA_ASSERT_OK(
      db().tiles().Fetch({}, kMapName, {.epoch = epoch}, held, [&](const api::TileUpdate& u) {
        EXPECT_EQ(u.tile.version, 0U);
        kinds[u.tile.key] = u.kind;
        return absl::OkStatus();
      }));
  using Kind = api::TileUpdate::Kind;
  for (const auto& [key, surfaces] : then) {
    const auto it = now.find(key);
    if (it == now.end()) {
      EXPECT_EQ(kinds[key], Kind::kNew) << key.ToString();
    } else if (it->second != surfaces) {
      EXPECT_EQ(kinds[key], Kind::kChanged) << key.ToString();
    } else {
      EXPECT_FALSE(kinds.contains(key)) << key.ToString();
    }
  }
  for (const auto& [key, surfaces] : now) {
    if (then.contains(key)) continue;
    EXPECT_EQ(kinds[key], Kind::kGone) << key.ToString();
  }
  STRATA_ASSERT_OK_AND_ASSIGN(const auto listed, db().tiles().List({}, kMapName, {.epoch = epoch}));
  ASSERT_EQ(listed.size(), then.size());
  for (const api::TileInfo& info : listed) {
    EXPECT_EQ(info.patches, then.at(info.key).size());
    EXPECT_EQ(info.version == 0, kinds.contains(info.key)) << info.key.ToString();
  }
}

TEST_F(EngineEpochTilesTest, OtherEpochsAndLevelsAreRefused) {
  MakeHistory();
  const std::uint64_t now = history_.rbegin()->first;
  EXPECT_THAT(db().tiles().List({}, kMapName, {.epoch = now + 1}),
              StatusIs(absl::StatusCode::kNotFound, ::testing::HasSubstr("see map history")));
  EXPECT_THAT(db().tiles().List({}, kMapName, {.level = 1, .epoch = now - 1}),
              StatusIs(absl::StatusCode::kInvalidArgument, ::testing::HasSubstr("level 1")));
  STRATA_EXPECT_OK(db().tiles().List({}, kMapName, {.level = 1, .epoch = now}));
}

}  // namespace
}  // namespace strata::testing
