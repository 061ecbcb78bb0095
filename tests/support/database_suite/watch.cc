// Conformance: watching a map.
#include <cstdint>
#include <map>
#include <thread>
#include <vector>

#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/database_suite/database_suite.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::_;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;
using Code = absl::StatusCode;

// What a watcher knows who was told everything.
struct Known {
  std::uint64_t commit_sequence = 0;
  std::uint64_t epoch = 0;
  std::map<ScanId, api::ScanChange> scans;
  std::map<TileKey, std::uint64_t> tiles;  // versions
  int messages = 0;
  bool whole = false;  // the last message

  absl::Status Take(const api::MapUpdate& update) {
    EXPECT_TRUE(update.whole || update.commit_sequence >= commit_sequence);
    whole = update.whole;
    if (whole) {
      scans.clear();
      tiles.clear();
    }
    commit_sequence = update.commit_sequence;
    epoch = update.epoch;
    for (const api::ScanChange& scan : update.scans) {
      scans[scan.id] = scan;
      if (scan.gone) scans.erase(scan.id);
    }
    for (const api::TileChangeNotice& tile : update.tiles) {
      EXPECT_EQ(tile.key.level, 0);
      tiles[tile.key] = tile.version;
      if (tile.gone) tiles.erase(tile.key);
    }
    ++messages;
    return absl::OkStatus();
  }
};

// Tells `known` what is new.
void CatchUp(api::Database& db, Known& known, api::WatchOptions options = {}) {
  options.since = known.commit_sequence;
  options.epoch = known.epoch;
  options.once = true;
  const int before = known.messages;
  STRATA_ASSERT_OK(db.maps().Watch(
      {}, kMap, options, [&known](const api::MapUpdate& update) { return known.Take(update); }));
  EXPECT_GT(known.messages, before);  // the first message always comes
}

std::map<TileKey, std::uint64_t> ListedTiles(api::Database& db) {
  std::map<TileKey, std::uint64_t> tiles;
  const auto listed = db.tiles().List({}, kMap, {});
  STRATA_EXPECT_OK(listed);
  if (listed.ok()) {
    for (const api::TileInfo& tile : *listed) tiles[tile.key] = tile.version;
  }
  return tiles;
}

TEST_P(DatabaseSuite, AWatcherKnowsWhatTheMapHolds) {
  Known known;
  CatchUp(db(), known);
  EXPECT_THAT(known.scans, IsEmpty());
  EXPECT_THAT(known.tiles, IsEmpty());
  EXPECT_THAT(known.messages, 1);
  EXPECT_TRUE(known.whole);

  PutFloor(db(), {"run", 1}, 3.0);
  CatchUp(db(), known);
  ASSERT_THAT(known.scans, SizeIs(1));
  const api::ScanChange& scan = known.scans.begin()->second;
  EXPECT_EQ(scan.state, ScanState::kIntegrated);
  EXPECT_NEAR(scan.T_map_scan.translation().x(), 3.0, 1e-12);
  EXPECT_THAT(known.tiles, Not(IsEmpty()));
  EXPECT_EQ(known.tiles, ListedTiles(db()));
  STRATA_ASSERT_OK_AND_ASSIGN(const MapStats stats, db().maps().Stats({}, kMap));
  EXPECT_EQ(known.commit_sequence, stats.commit_sequence);
  EXPECT_EQ(known.epoch, stats.epoch);

  PutFloor(db(), {"run", 2}, 80.0);
  const Pose moved = MakePose(Eigen::Quaterniond::Identity(), {40.0, 0.0, 1.0});
  STRATA_ASSERT_OK(db().posegraph().SetPose({}, kMap, {"run", 1}, moved));
  CatchUp(db(), known);
  ASSERT_THAT(known.scans, SizeIs(2));
  EXPECT_TRUE(known.scans.at({"run", 1}).T_map_scan.isApprox(moved, 1e-12));
  EXPECT_EQ(known.tiles, ListedTiles(db()));

  STRATA_ASSERT_OK(db().scans().Delete({}, kMap, {"run", 2}));
  CatchUp(db(), known);
  EXPECT_THAT(known.scans, SizeIs(1));
  EXPECT_EQ(known.tiles, ListedTiles(db()));
}

TEST_P(DatabaseSuite, AWatcherWhoKnowsAllIsToldNothingTwice) {
  PutFloor(db(), {"run", 1});
  Known known;
  CatchUp(db(), known);
  Known again;
  again.commit_sequence = known.commit_sequence;
  again.epoch = known.epoch;
  CatchUp(db(), again);
  EXPECT_THAT(again.scans, IsEmpty());
  EXPECT_THAT(again.tiles, IsEmpty());
  EXPECT_EQ(again.commit_sequence, known.commit_sequence);
  EXPECT_EQ(again.messages, 1);
}

TEST_P(DatabaseSuite, AWatcherWhoComesBackInTimeIsToldTheDifference) {
  PutFloor(db(), {"run", 1});
  Known known;
  CatchUp(db(), known);
  EXPECT_TRUE(known.whole);
  PutFloor(db(), {"run", 2}, 80.0);
  CatchUp(db(), known);
  EXPECT_FALSE(known.whole);
  EXPECT_THAT(known.scans, SizeIs(2));
  EXPECT_EQ(known.tiles, ListedTiles(db()));
  Reopen();  // the clock stands where the watcher saw it
  CatchUp(db(), known);
  EXPECT_FALSE(known.whole);
}

TEST_P(DatabaseSuite, AWatcherWhoMissedARestartKnowsWhatIsThereThen) {
  PutFloor(db(), {"run", 1});
  PutFloor(db(), {"run", 2}, 80.0);
  Known known;
  CatchUp(db(), known);
  STRATA_ASSERT_OK(db().scans().Delete({}, kMap, {"run", 2}));
  Reopen();
  CatchUp(db(), known);
  EXPECT_THAT(known.scans, SizeIs(1));  // as a whole, where nobody can tell that one has gone
  EXPECT_EQ(known.tiles, ListedTiles(db()));
  STRATA_ASSERT_OK_AND_ASSIGN(const MapStats stats, db().maps().Stats({}, kMap));
  EXPECT_EQ(known.commit_sequence, stats.commit_sequence);
  EXPECT_EQ(known.epoch, stats.epoch);
  CatchUp(db(), known);
  EXPECT_FALSE(known.whole);
}

TEST_P(DatabaseSuite, AWatcherOfAMapThatWasReplacedTakesTheNewOneAsAWhole) {
  PutFloor(db(), {"run", 1});
  Known known;
  CatchUp(db(), known);
  // However much has happened in the new one.
  for (const bool reopen : {false, true}) {
    for (std::uint64_t scans = 0; scans < 3; ++scans) {
      const std::uint64_t before = known.commit_sequence;
      const std::map<TileKey, std::uint64_t> tiles = known.tiles;
      STRATA_ASSERT_OK(db().maps().Delete({}, kMap));
      if (reopen) Reopen();
      STRATA_ASSERT_OK(db().maps().Create({}, kMap, {}));
      for (std::uint64_t i = 1; i <= scans; ++i) PutFloor(db(), {"other", i});
      CatchUp(db(), known);
      EXPECT_TRUE(known.whole);
      EXPECT_GT(known.commit_sequence, before);
      EXPECT_THAT(known.scans, SizeIs(scans));
      EXPECT_EQ(known.tiles, ListedTiles(db()));
      for (const auto& [key, version] : known.tiles) {
        const auto it = tiles.find(key);
        EXPECT_TRUE(it == tiles.end() || it->second != version);
      }
    }
  }
}

TEST_P(DatabaseSuite, AWatcherMayAskForATrajectoryAndForNoTiles) {
  PutFloor(db(), {"a", 1});
  PutFloor(db(), {"b", 1}, 30.0);
  Known known;
  CatchUp(db(), known, {.trajectory = "b", .tiles = false});
  ASSERT_THAT(known.scans, SizeIs(1));
  EXPECT_EQ(known.scans.begin()->first.trajectory, "b");
  EXPECT_THAT(known.tiles, IsEmpty());
  const auto ignore = [](const api::MapUpdate&) { return absl::OkStatus(); };
  EXPECT_THAT(db().maps().Watch({}, kMap, {.trajectory = "../b", .once = true}, ignore),
              StatusIs(Code::kInvalidArgument, _));
}

TEST_P(DatabaseSuite, AWatcherIsToldWhileItHappens) {
  Known known;
  std::thread robot;
  const absl::Status ended = db().maps().Watch({}, kMap, {}, [&](const api::MapUpdate& update) {
    if (!robot.joinable()) robot = std::thread([this] { PutFloor(db(), {"run", 1}); });
    STRATA_EXPECT_OK(known.Take(update));
    const auto scan = known.scans.find({"run", 1});
    const bool there = scan != known.scans.end() && scan->second.state == ScanState::kIntegrated;
    return there && !known.tiles.empty() ? absl::OutOfRangeError("enough") : absl::OkStatus();
  });
  EXPECT_THAT(ended, StatusIs(Code::kOutOfRange, "enough"));
  ASSERT_TRUE(robot.joinable());
  robot.join();
}

TEST_P(DatabaseSuite, AWatchEndsWithItsCall) {
  const api::Call cancelled;
  EXPECT_THAT(db().maps().Watch(cancelled,
                                kMap,
                                {},
                                [&](const api::MapUpdate&) {
                                  cancelled.stop.Request();
                                  return absl::OkStatus();
                                }),
              StatusIs(Code::kCancelled, _));
  const api::Call late{Stop(absl::UnixEpoch()), "", ""};
  EXPECT_THAT(db().maps().Watch(late, kMap, {}, [](const auto&) { return absl::OkStatus(); }),
              StatusIs(Code::kDeadlineExceeded, _));
}

}  // namespace
}  // namespace strata::testing
