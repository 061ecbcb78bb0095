// Watchers against a model: after random lives of a map each of them knows what is there.
#include <array>
#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/core/engine/engine_fixture.h"
#include "tests/support/patience.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using Random = std::mt19937_64;

constexpr int kLives = 3;
constexpr int kRobots = 3;
constexpr int kScansOfRobot = 4;  // in one life
// A watcher that was told of nothing for so long will not be told.

int Below(Random& random, int bound) {
  return static_cast<int>(random() % static_cast<std::uint64_t>(bound));
}

void Pause(Random& random) {
  absl::SleepFor(absl::Microseconds(Below(random, 8) == 0 ? Below(random, 8000) : 0));
}

// What of a scan and of a tile a watcher knows.
using ScanState3 = std::tuple<ScanState, double, double>;  // and where it is
using ScanStates = std::map<ScanId, ScanState3>;
using TileVersions = std::map<TileKey, std::uint64_t>;

ScanState3 StateOf(ScanState state, const Pose& T_map_scan) {
  return {state, T_map_scan.translation().x(), T_map_scan.translation().y()};
}

// A plane of points around `middle`, `along` and `across` of them a step of 0.1 m apart.
PointCloud Plane(const Eigen::Vector3f& middle,
                 const Eigen::Vector3f& right,
                 const Eigen::Vector3f& up,
                 int along,
                 int across) {
  PointCloud cloud;
  for (int i = -along / 2; i <= along / 2; ++i) {
    for (int k = -across / 2; k <= across / 2; ++k) {
      cloud.points.emplace_back(
          middle + 0.1F * (static_cast<float>(i) * right + static_cast<float>(k) * up));
    }
  }
  return cloud;
}

PointCloud Floor(int along, int across) {
  return Plane({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, along, across);
}
PointCloud WallAt(float x_m, int along, int across) {
  return Plane({x_m, 0, 0.5F}, {0, 1, 0}, {0, 0, 1}, along, across);
}

// What somebody uploads: clutter anywhere, a wall across the corridor, a thing that a scan of the
// wall behind it looks through.
std::pair<PointCloud, Pose> DrawScan(Random& random) {
  const Pose aside = PoseAt(0.0, 40.0);
  switch (Below(random, 6)) {
    case 0:
      return {WallAt(0.25F, 16, 6), PoseAt(0, 0)};
    case 1:
      return {WallAt(1.0F, 2, 2), aside};
    case 2:
      return {WallAt(3.0F, 20, 20), aside};
    default:
      return {Floor(4, 4), PoseAt(20.0 * (1 + Below(random, 4)), 20.0 * (1 + Below(random, 4)))};
  }
}

// A thread that is told of the map's changes, by fits and starts, and keeps a copy of it.
class MapWatcher {
 public:
  void Start(api::Database& db, std::uint64_t seed) {
    stop_ = Stop();
    thread_ = std::thread([this, &db, seed] { Follow(db, seed); });
  }
  void End() {
    stop_.Request();
    thread_.join();
  }
  std::uint64_t commit_sequence() const { return commit_sequence_; }
  std::uint64_t epoch() const { return epoch_; }
  const ScanStates& scans() const { return scans_; }
  const TileVersions& tiles() const { return tiles_; }

 private:
  void Follow(api::Database& db, std::uint64_t seed) {
    Random random(seed);
    while (!stop_.requested()) {
      api::WatchOptions options;
      options.since = commit_sequence_;
      options.epoch = epoch_;
      options.once = Below(random, 2) == 0;
      const absl::Status ended = db.maps().Watch(
          {stop_, "", ""}, kMapName, options, [&](const api::MapUpdate& update) -> absl::Status {
            Take(update);
            return Below(random, 8) == 0 ? absl::OutOfRangeError("enough") : absl::OkStatus();
          });
      EXPECT_TRUE(ended.ok() || absl::IsOutOfRange(ended) || absl::IsCancelled(ended)) << ended;
      Pause(random);
    }
  }
  void Take(const api::MapUpdate& update) {
    if (update.whole) {
      scans_.clear();
      tiles_.clear();
    }
    for (const api::ScanChange& scan : update.scans) {
      scans_[scan.id] = StateOf(scan.state, scan.T_map_scan);
      if (scan.gone) scans_.erase(scan.id);
    }
    for (const api::TileChangeNotice& tile : update.tiles) {
      tiles_[tile.key] = tile.version;
      if (tile.gone) tiles_.erase(tile.key);
    }
    epoch_ = update.epoch;
    commit_sequence_ = update.commit_sequence;
  }

  Stop stop_;
  std::thread thread_;
  ScanStates scans_;
  TileVersions tiles_;
  std::atomic<std::uint64_t> epoch_ = 0;
  std::atomic<std::uint64_t> commit_sequence_ = 0;
};

// Threads that are told how the path through the corridor stands: one waits, one asks with what it
// knows.
class PathWatcher {
 public:
  void Start(api::Database& db, const PathQuery& path, std::uint64_t seed) {
    stop_ = Stop();
    {
      absl::MutexLock lock(&mutex_);
      told_.reset();
    }
    threads_.emplace_back([this, &db, path] {
      const absl::Status ended =
          db.planning().WatchPath({stop_, "", ""}, kMapName, path, [this](const PathCheck& check) {
            absl::MutexLock lock(&mutex_);
            told_ = check.valid;
            return absl::OkStatus();
          });
      EXPECT_TRUE(absl::IsCancelled(ended)) << ended;
    });
    threads_.emplace_back([this, &db, path, seed] {
      Random random(seed);
      while (!stop_.requested()) {
        Ask(db, path);
        Pause(random);
      }
    });
  }
  void End() {
    stop_.Request();
    for (std::thread& thread : threads_) thread.join();
    threads_.clear();
  }
  std::optional<bool> told() const {
    absl::MutexLock lock(&mutex_);
    return told_;
  }
  // The answer that builds on all answers before; not while the threads run.
  PathCheck Ask(api::Database& db, PathQuery path) {
    path.known = known_;
    const absl::StatusOr<PathCheck> check = db.planning().CheckPath({}, kMapName, path);
    EXPECT_THAT(check, IsOk());
    if (check.ok()) known_ = *check;
    return known_.value_or(PathCheck());
  }

 private:
  Stop stop_;
  std::vector<std::thread> threads_;
  mutable absl::Mutex mutex_;
  std::optional<bool> told_ ABSL_GUARDED_BY(mutex_);
  std::optional<PathCheck> known_;  // of the thread that asks
};

class WatchModelTest : public EngineTest, public ::testing::WithParamInterface<std::uint64_t> {
 protected:
  void SetUp() override {
    MapParameters parameters;
    parameters.mls.cell_size_m = 0.1;
    MakeMap(parameters);
    Put({"corridor", 1}, Floor(40, 30), PoseAt(0, 0));
    path_.profile.radius_m = 0.3;
    path_.waypoints = {{-1.05, 0.05, 0.0}, {1.05, 0.05, 0.0}};
    WaitIntegrated(db());
    const auto check = db().planning().CheckPath({}, kMapName, path_);
    ASSERT_THAT(check, IsOk());
    ASSERT_TRUE(check->valid) << check->message;
  }

  void Put(const ScanId& id, const PointCloud& cloud, const Pose& T_map_scan) {
    STRATA_EXPECT_OK(Upload(db(), HeaderOf(id, cloud, T_map_scan), cloud));
    absl::MutexLock lock(&mutex_);
    ids_.push_back(id);
  }

  void Robot(int robot, int life, Random random) {
    for (int k = 0; k < kScansOfRobot; ++k) {
      const auto sequence = static_cast<std::uint64_t>(life * kScansOfRobot + k + 1);
      const auto [cloud, T_map_scan] = DrawScan(random);
      Put({absl::StrCat("robot", robot), sequence}, cloud, T_map_scan);
      Pause(random);
    }
  }

  // People and jobs. What they ask for may be refused: a scan is gone, or not integrated yet.
  void Operator(Random random) {
    for (int k = 0; k < kScansOfRobot; ++k) {
      Pause(random);
      ScanId id;
      {
        absl::MutexLock lock(&mutex_);
        id = ids_[random() % ids_.size()];
      }
      Operate(random, id);
    }
  }
  void Operate(Random& random, const ScanId& id) {
    switch (Below(random, 8)) {
      case 0:
      case 1:
        if (id.trajectory != "corridor") db().scans().Delete({}, kMapName, id).IgnoreError();
        break;
      case 2:
      case 3:
        if (id.trajectory != "corridor") MoveALittle(random, id);
        break;
      case 4:
        Label(random, id);
        break;
      case 5:
        RunJob(db(), "fade", {{"scans", "1"}, {"rays", "1"}});
        break;
      case 6:
        RunJob(db(), "fade", {{"undo", "1"}});
        break;
      case 7:
        RunJob(db(), Below(random, 2) == 0 ? "rebuild" : "optimize");
        RunJob(db(), "revert", {{"epoch", "1"}});
        break;
    }
  }
  void MoveALittle(Random& random, const ScanId& id) {
    const absl::StatusOr<ScanInfo> scan = db().scans().Get({}, kMapName, id);
    if (!scan.ok()) return;
    Pose T_map_scan = scan->T_map_scan;
    T_map_scan.translation().x() += 0.1 * Below(random, 30);
    db().posegraph().SetPose({}, kMapName, id, T_map_scan).IgnoreError();
  }
  void Label(Random& random, const ScanId& id) {
    const absl::StatusOr<ScanInfo> scan = db().scans().Get({}, kMapName, id);
    if (!scan.ok()) return;
    const std::vector<std::uint16_t> labels(scan->header.point_count,
                                            static_cast<std::uint16_t>(1 + Below(random, 3)));
    db().scans().SetLabels({}, kMapName, id, labels, api::LabelMode::kReplace).IgnoreError();
  }

  void Live(int life, Random& random) {
    for (MapWatcher& watcher : watchers_) watcher.Start(db(), random());
    path_watcher_.Start(db(), path_, random());
    std::vector<std::thread> threads;
    for (int robot = 0; robot < kRobots; ++robot) {
      threads.emplace_back(
          [this, robot, life, seed = random()] { Robot(robot, life, Random(seed)); });
    }
    threads.emplace_back([this, seed = random()] { Operator(Random(seed)); });
    for (std::thread& thread : threads) thread.join();
  }
  void EndWatchers() {
    for (MapWatcher& watcher : watchers_) watcher.End();
    path_watcher_.End();
  }

  ScanStates ListedScans() {
    ScanStates scans;
    STRATA_EXPECT_OK(db().scans().List({}, kMapName, {}, [&](const ScanInfo& scan) {
      scans[scan.header.id] = StateOf(scan.state, scan.T_map_scan);
      return absl::OkStatus();
    }));
    return scans;
  }
  TileVersions ListedTiles() {
    TileVersions tiles;
    const auto listed = db().tiles().List({}, kMapName, {});
    EXPECT_THAT(listed, IsOk());
    if (!listed.ok()) return tiles;
    for (const api::TileInfo& tile : *listed) tiles[tile.key] = tile.version;
    return tiles;
  }

  // Once nothing happens any more all watchers know what is there.
  void ExpectNothingMissed() {
    const MapStats stats = WaitIntegrated(db());
    const bool valid = db().planning().CheckPath({}, kMapName, path_)->valid;
    const absl::Time deadline = absl::Now() + kPatience;
    const auto await = [&](auto known) {
      while (!known() && absl::Now() < deadline) absl::SleepFor(absl::Microseconds(200));
    };
    for (const MapWatcher& watcher : watchers_) {
      await([&] { return watcher.commit_sequence() >= stats.commit_sequence; });
    }
    await([&] { return path_watcher_.told() == valid; });
    EndWatchers();
    for (const MapWatcher& watcher : watchers_) {
      EXPECT_EQ(watcher.commit_sequence(), stats.commit_sequence);
      EXPECT_EQ(watcher.epoch(), stats.epoch);
      EXPECT_EQ(watcher.scans(), ListedScans());
      EXPECT_EQ(watcher.tiles(), ListedTiles());
    }
    EXPECT_EQ(path_watcher_.told(), valid);
    const PathCheck known = path_watcher_.Ask(db(), path_);
    const auto fresh = db().planning().CheckPath({}, kMapName, path_);
    ASSERT_THAT(fresh, IsOk());
    EXPECT_EQ(known.message, fresh->message);
    EXPECT_EQ(known.valid, fresh->valid);
    EXPECT_EQ(known.epoch, fresh->epoch);
    EXPECT_EQ(known.commit_sequence, stats.commit_sequence);
  }

  PathQuery path_;
  absl::Mutex mutex_;
  std::vector<ScanId> ids_ ABSL_GUARDED_BY(mutex_);
  std::array<MapWatcher, 2> watchers_;
  PathWatcher path_watcher_;
};

TEST_P(WatchModelTest, WhatWatchersWereToldIsWhatIsThere) {
  Random random(GetParam());
  for (int life = 0; life < kLives; ++life) {
    Live(life, random);
    if (life + 1 == kLives) break;
    if (Below(random, 2) == 0) WaitIntegrated(db());
    EndWatchers();
    Reopen();
  }
  ExpectNothingMissed();
}

// Seeds from 1 on; STRATA_RUNS=1000 makes it a campaign.
int Runs() {
  constexpr int kInTheGate = 12;
  int runs = 0;
  const char* const asked = std::getenv("STRATA_RUNS");
  return asked != nullptr && absl::SimpleAtoi(asked, &runs) ? runs : kInTheGate;
}

INSTANTIATE_TEST_SUITE_P(Seeds,
                         WatchModelTest,
                         ::testing::Range(std::uint64_t{1},
                                          static_cast<std::uint64_t>(Runs()) + 1));

}  // namespace
}  // namespace strata::testing
