// What readers saw of a map is there after a power cut, and no version is given again.
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <utility>

#include "absl/status/statusor.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/engine/engine.h"
#include "tests/core/engine/engine_fixture.h"
#include "tests/support/faults/power_cut_disk.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

// Bytes of tiles by key and version.
using Seen = std::map<std::pair<TileKey, std::uint64_t>, std::string>;

Seen SeenNow(api::Database& db) {
  Seen seen;
  for (int level = 0; level <= kMaxLevel; ++level) {
    api::TileArea area;
    area.level = level;
    STRATA_EXPECT_OK(db.tiles().Fetch({}, kMapName, area, {}, [&](const api::TileUpdate& update) {
      seen[{update.tile.key, update.tile.version}] = update.tile.bytes;
      return absl::OkStatus();
    }));
  }
  return seen;
}

std::unique_ptr<api::Database> Open(const std::filesystem::path& directory, int batch_scans) {
  EngineOptions options;
  options.directory = directory;
  options.max_batch_scans = batch_scans;
  absl::StatusOr<std::unique_ptr<api::Database>> opened = OpenEngine(options);
  EXPECT_THAT(opened, IsOk());
  return opened.ok() ? *std::move(opened) : nullptr;
}

// Uploads rooms at one place and collects what is seen of it until they are all in the tiles.
void PutRooms(api::Database& db, std::uint64_t first, std::uint64_t last, Seen& seen) {
  for (std::uint64_t seed = first; seed <= last; ++seed) {
    const PointCloud cloud = MakeRoom(seed, 500);
    STRATA_ASSERT_OK(Upload(db, HeaderOf({"run", seed}, cloud, PoseAt(0, 0)), cloud));
  }
  for (bool pending = true; pending;) {
    STRATA_ASSERT_OK_AND_ASSIGN(const MapStats stats, db.maps().Stats({}, kMapName));
    pending = stats.scans_pending > 0;
    seen.merge(SeenNow(db));
  }
}

// What a watcher is told behind `since`.
api::MapUpdate NewsSince(api::Database& db, std::uint64_t since) {
  api::MapUpdate news;
  api::WatchOptions options;
  options.since = since;
  options.once = true;
  STRATA_EXPECT_OK(db.maps().Watch({}, kMapName, options, [&](const api::MapUpdate& update) {
    news = update;
    return absl::OkStatus();
  }));
  return news;
}

class DurableVersionsTest : public ::testing::TestWithParam<std::uint64_t> {
 protected:
  TempDir directory_;
};

TEST_P(DurableVersionsTest, OutliveAPowerCut) {
  const std::filesystem::path before = directory_.path() / "before";
  const std::filesystem::path after = directory_.path() / "after";
  std::filesystem::create_directory(before);
  Seen seen;
  std::uint64_t told = 0;
  {
    PowerCutDisk disk(before);
    const std::unique_ptr<api::Database> db = Open(before, 1);
    ASSERT_NE(db, nullptr);
    STRATA_ASSERT_OK(db->maps().Create({}, kMapName, SmallMap()));
    PutRooms(*db, 1, 6, seen);
    told = NewsSince(*db, 0).commit_sequence;
    disk.CutAfter(0, GetParam(), after);
    // The first thing that would be written.
    db->planning().SetProfile({}, kMapName, "cut", RobotProfile()).IgnoreError();
    ASSERT_TRUE(disk.is_cut());
  }
  // Were scans integrated again, then others together, and under numbers that were given before.
  const std::unique_ptr<api::Database> db = Open(after, 16);
  ASSERT_NE(db, nullptr);
  Seen later = SeenNow(*db);
  PutRooms(*db, 11, 13, later);
  for (const auto& [version, bytes] : later) {
    const auto it = seen.find(version);
    if (it == seen.end()) continue;
    EXPECT_TRUE(it->second == bytes) << version.first.ToString() << " version " << version.second;
  }
  // Whoever goes on from before the cut is told of the three new scans.
  const api::MapUpdate news = NewsSince(*db, told);
  EXPECT_EQ(news.scans.size(), news.whole ? 9U : 3U);
}

INSTANTIATE_TEST_SUITE_P(Seeds,
                         DurableVersionsTest,
                         ::testing::Range(std::uint64_t{1}, std::uint64_t{9}));

}  // namespace
}  // namespace strata::testing
