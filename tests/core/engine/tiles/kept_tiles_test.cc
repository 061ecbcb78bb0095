// Tiles that a map at rest prepares and keeps in its file for plans to come.
#include "core/engine/tiles/kept_tiles.h"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/codec/surface_tile_codec.h"
#include "core/common/cache_budget.h"
#include "core/common/status.h"
#include "core/engine/doors/map.h"
#include "core/engine/map/map_core.h"
#include "core/engine/map/map_state.h"
#include "core/engine/map/quarantine.h"
#include "core/engine/map/quarantine_file.h"
#include "core/engine/tiles/tile_keeper.h"
#include "core/planning/ground/profile_checks.h"
#include "core/planning/packed_tile.h"
#include "core/planning/tile_cache.h"
#include "core/storage/sqlite/sqlite_storage.h"
#include "core/storage/storage.h"
#include "tests/core/engine/engine_fixture.h"
#include "tests/support/faults/faulty_disk.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::HasSubstr;

constexpr WorkId kPrepare{WorkKind::kPrepare, 0};

// The served tiles of a store.
class StoredTiles final : public TileSource {
 public:
  explicit StoredTiles(StorageReader& reader)
      : reader_(reader),
        versions_(VersionsOfTiles(
            reader.ListSurfaceTiles(TileRange{}, std::numeric_limits<std::int64_t>::max())
                .value())) {}
  absl::StatusOr<std::shared_ptr<const SurfaceTile>> Load(const TileKey& key) override {
    STRATA_ASSIGN_OR_RETURN(const auto row, reader_.FindSurfaceTile(key, Version(key)));
    STRATA_ASSIGN_OR_RETURN(SurfaceTile tile, DecodeSurfaceTile(row->bytes));
    return std::make_shared<const SurfaceTile>(std::move(tile));
  }
  std::uint64_t Version(const TileKey& key) override {
    const auto it = versions_.find(key);
    return it == versions_.end() ? 0 : it->second;
  }
  const TileVersionMap& versions() const { return versions_; }

 private:
  StorageReader& reader_;
  const TileVersionMap versions_;
};

struct Kept {
  std::size_t tiles = 0;    // of level 0
  std::size_t rows = 0;     // kept
  std::size_t current = 0;  // of those, what would be used
};

class KeptTilesTest : public EngineTest {
 protected:
  // Nothing is prepared by itself.
  EngineOptions Busy() const {
    EngineOptions options = Options();
    options.prepare_after = absl::InfiniteDuration();
    return options;
  }
  EngineOptions Resting() const {
    EngineOptions options = Options();
    options.prepare_after = absl::ZeroDuration();
    return options;
  }
  // A map with scans beside and over each other.
  void MakeRooms() {
    Reopen(Busy());
    MakeMap();
    UploadRooms(4);
    WaitIntegrated(db());
  }
  // Goes on until all tiles are prepared.
  void Rest() {
    Reopen(Resting());
    AwaitRest();
  }
  void AwaitRest() {
    while (true) {
      const MapStats stats = WaitIntegrated(db());
      if (stats.tiles_prepared == stats.tiles || HasFailure()) return;
      absl::SleepFor(absl::Milliseconds(2));
    }
  }
  JobInfo Verified() {
    JobInfo verified = RunJob(db(), "verify");
    EXPECT_EQ(verified.state, JobState::kSucceeded) << verified.message;
    return verified;
  }
  // Closes the map and holds every row that would be used against a tile prepared here.
  Kept Look() {
    Close();
    const auto storage = OpenSqliteStorage(MapFile(), {});
    EXPECT_THAT(storage, IsOk());
    const std::unique_ptr<StorageReader> reader = (*storage)->NewReader().value();
    StoredTiles source(*reader);
    const MapParameters parameters = reader->GetMapInfo()->parameters;
    const double cell_size_m = parameters.mls.cell_size_m;
    const ProfileChecks checks = MakeProfileChecks(parameters.default_profile, cell_size_m).value();
    const std::vector<PreparedTileRow> rows = reader->ListPreparedTiles().value();
    Kept kept{source.versions().size(), rows.size(), 0};
    for (const PreparedTileRow& row : rows) {
      if (!IsCurrent(row, source.versions(), parameters.default_profile)) continue;
      ++kept.current;
      const auto bytes = reader->FindPreparedTile(row.key, row.made_of);
      const auto packed = UnsealTile(row.key, row.made_of, bytes.value().value());
      const auto tile = PrepareFrom(source, row.key, checks);
      EXPECT_THAT(packed, IsOk());
      EXPECT_TRUE(*packed == PackTile(**tile, cell_size_m)) << row.key.ToString();
    }
    return kept;
  }
  void ExpectAllKept() {
    Rest();
    while (Verified().metrics.at("prepared_tiles") > db().maps().Stats({}, kMapName)->tiles) {
    }
    const Kept kept = Look();
    EXPECT_GT(kept.tiles, 0U);
    EXPECT_EQ(kept.rows, kept.tiles);
    EXPECT_EQ(kept.current, kept.tiles);
  }

  struct Answer {
    std::string plan;
    TileCache::Statistics statistics;
  };
  // Of a map that is opened anew for it.
  Answer PlanAnew(double to_x_m) {
    Close();
    const EngineOptions options = Busy();
    const auto map =
        Map::Open(kMapName, MapFile(), options, std::make_shared<CacheBudget>(options.cache_bytes));
    EXPECT_THAT(map, IsOk());
    PlanQuery query;
    query.from = {.x_m = 2.0, .y_m = 3.0};
    query.to = {.x_m = to_x_m, .y_m = 3.0};
    MapState state((*map)->core());
    const auto plan = (*map)->planner().Plan(state, query, Stop());
    EXPECT_THAT(plan, IsOk());
    EXPECT_TRUE(plan->found()) << plan->message;
    return {absl::StrCat(plan->cost, " ", plan->expanded, " ", plan->waypoints.size()),
            (*map)->planner().cache_statistics()};
  }
  // A level strip of six tiles.
  void MakeStrip() {
    Reopen(Busy());
    MakeMap();
    PointCloud floor;
    for (double x = 0.0; x < 76.0; x += 0.05) {
      for (double y = 0.0; y < 6.0; y += 0.05) {
        floor.points.emplace_back(static_cast<float>(x + 0.02), static_cast<float>(y + 0.02), 0.0F);
      }
    }
    STRATA_ASSERT_OK(Upload(db(), HeaderOf({"run", 1}, floor, PoseAt(0, 0)), floor, 40'000));
    WaitIntegrated(db());
  }
};

TEST_F(KeptTilesTest, AreWhatPreparingMakesBitForBit) {
  MakeRooms();
  EXPECT_EQ(db().maps().Stats({}, kMapName)->tiles_prepared, 0U);
  ExpectAllKept();
}

TEST_F(KeptTilesTest, AMapIsClosedWhateverItPrepares) {
  MakeRooms();
  for (int i = 0; i < 5; ++i) {
    Reopen(Resting());
    absl::SleepFor(absl::Milliseconds(7 * i));
    const Kept kept = Look();
    EXPECT_EQ(kept.current, kept.rows);
  }
  ExpectAllKept();
}

TEST_F(KeptTilesTest, APlanAfterARestartPreparesNothing) {
  MakeStrip();
  const Answer before = PlanAnew(74.0);
  EXPECT_EQ(before.statistics.prepared, 6U);
  EXPECT_EQ(before.statistics.kept, 0U);
  Rest();
  const Answer after = PlanAnew(74.0);
  EXPECT_EQ(after.statistics.prepared, 0U);
  EXPECT_EQ(after.statistics.kept, 6U);
  EXPECT_EQ(after.plan, before.plan);
}

// Every way in which what a tile is prepared to can change: none leaves a row that would be used
// and is wrong, and each row that is of no use any more is made again, or goes.
TEST_F(KeptTilesTest, OfEarlierTilesAreNeverUsed) {
  MakeRooms();
  ExpectAllKept();
  const std::vector<std::pair<std::string, std::function<void()>>> changes = {
      {"one more scan", [&] { UploadRoom(9, PoseAt(-7.0, 0.5)); }},
      {"a scan elsewhere", [&] { UploadRoom(10, PoseAt(60.0, 60.0)); }},
      {"a scan that moves",
       [&] {
         STRATA_EXPECT_OK(
             db().posegraph().SetPose({}, kMapName, {"run", 2}, PoseAt(-2.5, 1.0, 0.2)));
       }},
      {"another robot",
       [&] {
         RobotProfile wide;
         wide.radius_m = 0.5;
         STRATA_EXPECT_OK(db().planning().SetProfile({}, kMapName, api::kDefaultProfile, wide));
       }},
      {"a scan that goes",
       [&] {
         db().scans().Delete({}, kMapName, {"run", 10}).IgnoreError();
       }},
      {"poses of before",
       [&] {
         EXPECT_EQ(RunJob(db(), "revert", {{"epoch", "1"}}).state, JobState::kSucceeded);
       }},
  };
  for (const auto& [what, change] : changes) {
    SCOPED_TRACE(what);
    Reopen(Busy());
    change();
    WaitIntegrated(db());
    const Kept stale = Look();
    EXPECT_TRUE(stale.current < stale.tiles || stale.rows > stale.tiles);
    ExpectAllKept();
    Reopen(Resting());  // the same while the map rests, but for the change
    change();
    AwaitRest();
    const Kept kept = Look();
    EXPECT_EQ(kept.current, kept.tiles);
  }
}

TEST_F(KeptTilesTest, ARebuildOfWhatDidNotChangeLeavesThem) {
  MakeRooms();
  ExpectAllKept();
  Reopen(Busy());
  EXPECT_EQ(RunJob(db(), "rebuild").state, JobState::kSucceeded);
  const Kept kept = Look();
  EXPECT_EQ(kept.current, kept.tiles);
}

// Whatever drops what is derived, an earlier program too, drops them with it.
TEST_F(KeptTilesTest, GoWithAllThatIsDerived) {
  MakeRooms();
  ExpectAllKept();
  Sql("UPDATE derived_state SET schema = 0");
  Reopen(Busy());
  ExpectSound();
  EXPECT_EQ(Look().rows, 0U);
  ExpectAllKept();
}

TEST_F(KeptTilesTest, AMapThatKnowsOfNoneGetsThem) {
  MakeRooms();
  Close();
  Sql("DROP TABLE derived_prepared_tile");
  ExpectAllKept();
}

// A tile of the strip each, but for one: cut short, empty, changed in the middle, another tile's,
// and made of what nobody has.
TEST_F(KeptTilesTest, DamagedOnesAreIgnoredAndMadeAgain) {
  MakeStrip();
  Rest();
  const std::string sound = PlanAnew(74.0).plan;
  Sql("UPDATE derived_prepared_tile SET bytes = x'00' WHERE x = 0");
  Sql("UPDATE derived_prepared_tile SET bytes = x'' WHERE x = 1");
  Sql("UPDATE derived_prepared_tile SET bytes = CAST(substr(bytes, 1, 30) || x'5a5a' || "
      "substr(bytes, 33) AS BLOB) WHERE x = 2");
  Sql("UPDATE derived_prepared_tile SET bytes = (SELECT bytes FROM derived_prepared_tile AS other "
      "WHERE other.x = derived_prepared_tile.x + 1) WHERE x = 3");
  Sql("UPDATE derived_prepared_tile SET made_of = x'77' WHERE x = 5");
  const Answer answer = PlanAnew(74.0);
  EXPECT_EQ(answer.plan, sound);
  EXPECT_EQ(answer.statistics.prepared, 5U);
  Reopen(Resting());
  // It names them, and that has them made again.
  while (Verified().metrics.at("prepared_tiles_damaged") > 0) {
  }
  AwaitRest();
  const Kept kept = Look();
  EXPECT_EQ(kept.current, kept.tiles);
  EXPECT_EQ(PlanAnew(74.0).statistics.prepared, 0U);
}

// The worker's steps, one by one.
class TileKeeperTest : public KeptTilesTest {
 protected:
  void Open(const EngineOptions& options) {
    CloseKeeper();
    Close();
    STRATA_ASSERT_OK_AND_ASSIGN(
        core_, MapCore::Open(kMapName, MapFile(), options, std::make_shared<CacheBudget>(1 << 20)));
    STRATA_ASSERT_OK_AND_ASSIGN(quarantine_, Quarantine::Open(*core_));
    keeper_ = std::make_unique<TileKeeper>(*core_, *quarantine_);
  }
  // As if the process died, unless Pause() was called before.
  void CloseKeeper() {
    keeper_.reset();
    quarantine_.reset();
    core_.reset();
  }
  void TearDown() override { CloseKeeper(); }
  std::size_t Rows() { return (*core_->Reader())->ListPreparedTiles()->size(); }

  std::unique_ptr<MapCore> core_;
  std::unique_ptr<Quarantine> quarantine_;
  std::unique_ptr<TileKeeper> keeper_;
};

TEST_F(TileKeeperTest, GoesOnWhereItStopped) {
  MakeStrip();
  for (std::size_t rows = 1; rows <= 6; ++rows) {
    Open(Resting());
    EXPECT_EQ(keeper_->Step(), absl::ZeroDuration());
    EXPECT_EQ(Rows(), rows);
    keeper_->Pause();
  }
  EXPECT_GT(keeper_->Step(), absl::ZeroDuration());  // all are there
  CloseKeeper();
  const Kept kept = Look();
  EXPECT_EQ(kept.current, kept.tiles);
}

// Nothing is made of what lies beside a damaged tile: it would be as if nothing were there.
TEST_F(TileKeeperTest, ADamagedTileAndThoseBesideItAreLeftOut) {
  MakeStrip();
  Close();
  DamageSurfaceTile({0, 2, 0});
  Open(Resting());
  while (keeper_->Step() == absl::ZeroDuration()) {
  }
  EXPECT_EQ(Rows(), 3U);
  keeper_->Pause();
  CloseKeeper();
  Reopen(Busy());
  EXPECT_EQ(RunJob(db(), "rebuild").state, JobState::kSucceeded);
  ExpectAllKept();
}

TEST_F(TileKeeperTest, TilesThatChangedLatelyWait) {
  MakeStrip();
  EngineOptions options = Resting();
  options.prepare_after = absl::Hours(1);
  Open(options);
  EXPECT_EQ(keeper_->Step(), absl::ZeroDuration());  // what was there when the map was opened
  STRATA_ASSERT_OK(core_->Publish(
      {}, {{{0, 0, 0}, 99, false}}, true, [](StorageWriter&) { return absl::OkStatus(); }));
  for (std::size_t rows = 2; rows <= 4; ++rows) {
    // A tenth of the time while the map changes.
    EXPECT_GT(keeper_->Step(), absl::ZeroDuration());
    EXPECT_EQ(Rows(), rows);
  }
  for (int i = 0; i < 3; ++i) keeper_->Step();
  EXPECT_EQ(Rows(), 5U);  // 0/0/0 was the first, 0/1/0 is beside it
}

TEST_F(TileKeeperTest, ListsAgainWhereMoreChangedThanIsRemembered) {
  MakeStrip();
  Open(Resting());
  while (keeper_->Step() == absl::ZeroDuration()) {
  }
  ASSERT_EQ(Rows(), 6U);
  std::vector<api::TileChangeNotice> many;
  for (std::int32_t i = 0; i < 70'000; ++i) many.push_back({{0, 1000 + i, 0}, 99, true});
  STRATA_ASSERT_OK(core_->Publish({}, many, true, [](StorageWriter& writer) {
    return writer.DeletePreparedTile({0, 3, 0});
  }));
  EXPECT_EQ(keeper_->Step(), absl::ZeroDuration());
  EXPECT_EQ(Rows(), 6U);
  EXPECT_GT(keeper_->Step(), absl::ZeroDuration());
  keeper_->Pause();
}

TEST_F(TileKeeperTest, WhatKilledTheProcessTwiceIsNotBegun) {
  MakeStrip();
  Open(Resting());
  for (const std::size_t rows : {1U, 2U}) {  // the second time as a suspect
    EXPECT_EQ(keeper_->Step(), absl::ZeroDuration());
    EXPECT_EQ(Rows(), rows);
    Open(Resting());
  }
  EXPECT_TRUE(quarantine_->IsHeld(kPrepare));
  EXPECT_EQ(keeper_->Step(), absl::InfiniteDuration());
  EXPECT_EQ(Rows(), 2U);
  CloseKeeper();
  EXPECT_GT(PlanAnew(74.0).statistics.prepared, 0U);  // as ever
  STRATA_ASSERT_OK_AND_ASSIGN(const auto held, ListQuarantine({directory_.path()}, kMapName));
  ASSERT_EQ(held.size(), 1U);
  EXPECT_EQ(held[0].name, "prepare");
  EXPECT_TRUE(held[0].held);
  STRATA_ASSERT_OK(ReleaseFromQuarantine({directory_.path()}, kMapName, "prepare"));
  ExpectAllKept();
}

TEST_F(TileKeeperTest, ASuspectWaitsUntilNothingElseIsUnderWay) {
  MakeStrip();
  Open(Resting());
  EXPECT_EQ(keeper_->Step(), absl::ZeroDuration());
  Open(Resting());
  EXPECT_TRUE(quarantine_->IsSuspect(kPrepare));
  const WorkId job{WorkKind::kJob, 3};
  STRATA_ASSERT_OK(quarantine_->Begin(job));
  EXPECT_GT(keeper_->Step(), absl::ZeroDuration());
  EXPECT_EQ(Rows(), 1U);
  STRATA_ASSERT_OK(quarantine_->End(job));
  while (keeper_->Step() == absl::ZeroDuration()) {
  }
  EXPECT_EQ(Rows(), 6U);
  EXPECT_FALSE(quarantine_->IsSuspect(kPrepare));  // it was not that
}

// Paused is as good as not begun: nobody is suspected of what happens then.
TEST_F(TileKeeperTest, IsNoSuspectWhilePaused) {
  MakeStrip();
  Open(Resting());
  EXPECT_EQ(keeper_->Step(), absl::ZeroDuration());
  keeper_->Pause();
  Open(Resting());
  EXPECT_FALSE(quarantine_->IsSuspect(kPrepare));
}

TEST_F(TileKeeperTest, ADiskThatFailsIsTriedAgainLater) {
  MakeStrip();
  Close();
  for (const DiskFault fault : {DiskFault::kFull, DiskFault::kWrite}) {
    FaultyDisk disk;
    Open(Resting());
    const std::size_t before = Rows();
    disk.Fail(fault, 0);
    for (int i = 0; i < 3; ++i) EXPECT_GT(keeper_->Step(), absl::ZeroDuration());
    EXPECT_GT(disk.failed(), 0);
    EXPECT_EQ(Rows(), before);
    disk.Mend();
    EXPECT_EQ(keeper_->Step(), absl::ZeroDuration());
    EXPECT_EQ(Rows(), before + 1);
    keeper_->Pause();
    CloseKeeper();
  }
  ExpectAllKept();
}

TEST_F(TileKeeperTest, LeavesTheLastQuarterOfAFileToScans) {
  MakeStrip();
  Close();
  EngineOptions options = Resting();
  options.max_map_bytes = std::filesystem::file_size(MapFile()) / 3 * 4 - 10'000;
  Open(options);
  EXPECT_GT(keeper_->Step(), absl::ZeroDuration());
  EXPECT_EQ(Rows(), 0U);
  options.max_map_bytes *= 2;
  Open(options);
  EXPECT_EQ(keeper_->Step(), absl::ZeroDuration());
  EXPECT_EQ(Rows(), 1U);
}

}  // namespace
}  // namespace strata::testing
