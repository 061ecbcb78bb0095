// Watches by a server that has not got the map: each change is told, once, soon, in order, also
// across the death of the one that has it, and where a watcher goes on at another server.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/common/status.h"
#include "core/common/stop.h"
#include "core/storage/postgresql/connection.h"
#include "tests/integration/cluster/sharing_servers.h"
#include "tests/integration/numbered_scans.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

constexpr std::size_t kPoints = 200;

absl::StatusOr<ScanAck> Put(api::Database& db, std::uint64_t sequence) {
  const PointCloud cloud = NumberedCloud(sequence, kPoints);
  STRATA_ASSIGN_OR_RETURN(const auto upload,
                          db.scans().Upload({}, kShared, NumberedHeader(sequence, cloud)));
  if (upload->points_held() < cloud.size()) STRATA_RETURN_IF_ERROR(upload->Write(cloud));
  return upload->Finish();
}

// What one who was told everything knows of the map.
struct Picture {
  std::uint64_t commit_sequence = 0;
  std::uint64_t epoch = 0;
  std::map<std::uint64_t, std::string> scans;  // state and pose, by sequence
  std::map<TileKey, std::uint64_t> tiles;
  int wholes = 0;
  std::map<std::uint64_t, int> integrated;  // how often it was told, by sequence

  void Take(const api::MapUpdate& update) {
    if (update.whole) {
      ++wholes;
      scans.clear();
      tiles.clear();
    } else {
      EXPECT_GE(update.commit_sequence, commit_sequence);
    }
    EXPECT_GE(update.epoch, epoch);
    commit_sequence = update.commit_sequence;
    epoch = update.epoch;
    for (const api::ScanChange& scan : update.scans) {
      if (scan.gone) {
        scans.erase(scan.id.sequence);
        continue;
      }
      std::string& known = scans[scan.id.sequence];
      known = absl::StrCat(static_cast<int>(scan.state),
                           " ",
                           scan.T_map_scan.translation().x(),
                           " ",
                           scan.T_map_scan.translation().y());
      if (scan.state == ScanState::kIntegrated) ++integrated[scan.id.sequence];
    }
    for (const api::TileChangeNotice& tile : update.tiles) {
      EXPECT_TRUE(tile.gone || tile.version >= tiles[tile.key]);
      tiles[tile.key] = tile.version;
      if (tile.gone) tiles.erase(tile.key);
    }
  }
  absl::Status CatchUp(api::Database& db) {
    api::WatchOptions options;
    options.since = commit_sequence;
    options.epoch = epoch;
    options.once = true;
    return db.maps().Watch({}, kShared, options, [this](const api::MapUpdate& update) {
      Take(update);
      return absl::OkStatus();
    });
  }
  void ExpectSameAs(const Picture& other) const {
    EXPECT_EQ(epoch, other.epoch);
    EXPECT_EQ(scans, other.scans);
    EXPECT_EQ(tiles, other.tiles);
  }
};

// Watches on a thread of its own, going on by itself where a server ends.
class Watching {
 public:
  Watching(SharingServer& server, api::WatchOptions options)
      : thread_([this, &server, options] {
          api::WatchOptions from = options;
          while (!call_.stop.requested()) {
            server.db()
                ->maps()
                .Watch(call_,
                       kShared,
                       from,
                       [&](const api::MapUpdate& update) {
                         absl::MutexLock lock(&mutex_);
                         picture_.Take(update);
                         for (const auto& [sequence, times] : picture_.integrated) {
                           told_.try_emplace(sequence, absl::Now());
                         }
                         from.since = update.commit_sequence;
                         from.epoch = update.epoch;
                         return absl::OkStatus();
                       })
                .IgnoreError();
            absl::SleepFor(absl::Milliseconds(20));
          }
        }) {}
  ~Watching() {
    call_.stop.Request();
    thread_.join();
  }
  Watching(const Watching&) = delete;
  Watching& operator=(const Watching&) = delete;

  // Once so many scans were told to be integrated, or too late.
  bool Await(std::size_t scans) {
    const auto there = [&] { return picture_.integrated.size() >= scans; };
    absl::MutexLock lock(&mutex_);
    return mutex_.AwaitWithTimeout(absl::Condition(&there), kPatience);
  }
  Picture picture() {
    absl::MutexLock lock(&mutex_);
    return picture_;
  }
  std::map<std::uint64_t, absl::Time> told() {
    absl::MutexLock lock(&mutex_);
    return told_;
  }

 private:
  const api::Call call_;
  absl::Mutex mutex_;
  Picture picture_;
  std::map<std::uint64_t, absl::Time> told_;
  std::thread thread_;
};

class WatchElsewhereTest : public SharingServersTest {
 protected:
  // What a new watcher is told of the map.
  Picture Now(std::size_t server) {
    Picture now;
    STRATA_EXPECT_OK(now.CatchUp(db(server)));
    EXPECT_EQ(now.wholes, 1);
    return now;
  }
  void PutAll(std::uint64_t first, std::uint64_t last, std::size_t server) {
    for (std::uint64_t sequence = first; sequence <= last; ++sequence) {
      STRATA_ASSERT_OK(Insist([&] { return Put(*servers_[server]->db(), sequence).status(); }));
    }
  }
  // That it is told of the map as it is, and of each scan once.
  static void ExpectToldOnce(const Picture& picture, std::size_t scans) {
    EXPECT_EQ(picture.integrated.size(), scans);
    for (const auto& [sequence, times] : picture.integrated) EXPECT_EQ(times, 1) << sequence;
  }
};

TEST_F(WatchElsewhereTest, EachScanIsToldOnceAndSoon) {
  constexpr std::uint64_t kScans = 40;
  PutAll(1, 1, 0);
  STRATA_ASSERT_OK(AtRest(db(0), kShared));
  Watching here(*servers_[0], {});
  Watching there(*servers_[1], {});
  ASSERT_TRUE(here.Await(1) && there.Await(1));
  for (std::uint64_t sequence = 2; sequence <= kScans; ++sequence) {
    PutAll(sequence, sequence, sequence % 2);
    absl::SleepFor(absl::Milliseconds(50));
  }
  ASSERT_TRUE(here.Await(kScans) && there.Await(kScans));
  STRATA_ASSERT_OK(AtRest(db(0), kShared));
  ExpectToldOnce(here.picture(), kScans);
  ExpectToldOnce(there.picture(), kScans);
  EXPECT_EQ(there.picture().wholes, 1);
  there.picture().ExpectSameAs(Now(0));
  there.picture().ExpectSameAs(Now(1));
  std::vector<double> later;
  const auto at_owner = here.told();
  for (const auto& [sequence, time] : there.told()) {
    later.push_back(absl::ToDoubleMilliseconds(time - at_owner.at(sequence)));
  }
  std::sort(later.begin(), later.end());
  std::printf("told after the owner's watchers: p50 %.0f ms, most %.0f ms\n",
              later[later.size() / 2],
              later.back());
}

TEST_F(WatchElsewhereTest, AWatchGoesOnWhenTheOwnerDies) {
  PutAll(1, 5, 0);
  STRATA_ASSERT_OK(AtRest(db(0), kShared));
  Watching there(*servers_[1], {});
  ASSERT_TRUE(there.Await(5));
  PutAll(6, 8, 0);
  servers_[0]->Kill();
  PutAll(9, 12, 1);
  ASSERT_TRUE(there.Await(12));
  servers_[0]->Start();
  PutAll(13, 15, 0);
  ASSERT_TRUE(there.Await(15));
  ExpectToldOnce(there.picture(), 15);
  EXPECT_EQ(there.picture().wholes, 1);
  STRATA_ASSERT_OK(AtRest(db(0), kShared));
  there.picture().ExpectSameAs(Now(0));
}

// Resume points are of the map, not of a server: by turns at both, through all that changes a map.
TEST_F(WatchElsewhereTest, ResumesAtTheOtherServerWhereItStopped) {
  Picture picture;
  std::size_t server = 0;
  const auto look = [&] {
    STRATA_ASSERT_OK(AtRest(db(0), kShared));
    STRATA_ASSERT_OK(picture.CatchUp(db(server)));
    picture.ExpectSameAs(Now(0));
    picture.ExpectSameAs(Now(1));
    server = 1 - server;
  };
  PutAll(7, 7, 0);
  look();
  for (std::uint64_t sequence = 1; sequence <= 6; ++sequence) {
    PutAll(sequence, sequence, sequence / 2 % 2);
    look();
  }
  for (int i = 0; i < 2; ++i) {
    Pose moved = Pose::Identity();
    moved.translation().x() = 30.0 + i;
    STRATA_ASSERT_OK(db(0).posegraph().SetPose({}, kShared, {"run", 1}, moved));
    look();
    STRATA_ASSERT_OK(db(0).scans().Delete({}, kShared, {"run", 5U + static_cast<unsigned>(i)}));
    look();
    RobotProfile profile;
    profile.radius_m = 0.5 + 0.1 * i;
    STRATA_ASSERT_OK(db(0).planning().SetProfile({}, kShared, "default", profile));
    look();
  }
  STRATA_ASSERT_OK_AND_ASSIGN(const JobInfo job, db(0).jobs().Start({}, kShared, "rebuild", {}));
  JobInfo last;
  STRATA_ASSERT_OK(db(1).jobs().Watch({}, kShared, job.id, [&](const JobInfo& now) {
    last = now;
    return absl::OkStatus();
  }));
  EXPECT_EQ(last.state, JobState::kSucceeded) << last.message;
  look();
  look();
  EXPECT_EQ(picture.wholes, 1);
}

// A path is told to be blocked when a scan puts something into its way.
TEST_F(WatchElsewhereTest, FollowsAPath) {
  PointCloud floor;
  for (int i = -160; i < 160; ++i) {
    for (int j = -60; j < 60; ++j) {
      floor.points.emplace_back(0.05F * static_cast<float>(i), 0.05F * static_cast<float>(j), 0.0F);
    }
  }
  PointCloud wall;
  for (int j = -60; j < 60; ++j) {
    for (int k = 0; k < 16; ++k) {
      wall.points.emplace_back(2.0F, 0.05F * static_cast<float>(j), 0.1F * static_cast<float>(k));
    }
  }
  const auto put = [&](std::uint64_t sequence, const PointCloud& cloud) {
    ScanHeader header;
    header.id = {"path", sequence};
    header.alignment = Alignment::kOff;
    header.point_count = cloud.size();
    STRATA_ASSERT_OK_AND_ASSIGN(const auto upload, db(0).scans().Upload({}, kShared, header));
    STRATA_ASSERT_OK(upload->Write(cloud));
    STRATA_ASSERT_OK(upload->Finish());
  };
  put(1, floor);
  STRATA_ASSERT_OK(AtRest(db(0), kShared));
  PlanQuery query;
  query.from = {-4.0, 0.0};
  query.to = {6.0, 0.0};
  STRATA_ASSERT_OK_AND_ASSIGN(const PlanResult plan, db(1).planning().PlanPath({}, kShared, query));
  ASSERT_TRUE(plan.found()) << plan.message;
  const api::Call call;
  std::vector<bool> told;
  const absl::Status ended = db(1).planning().WatchPath(
      call, kShared, {plan.waypoints, query.profile}, [&](const PathCheck& check) {
        told.push_back(check.valid);
        if (told.size() == 1) put(2, wall);
        if (told.size() == 2) call.stop.Request();
        return absl::OkStatus();
      });
  EXPECT_TRUE(absl::IsCancelled(ended)) << ended;
  EXPECT_THAT(told, ::testing::ElementsAre(true, false));
}

// So many watchers there are, the store is asked for all of them at once.
TEST_F(WatchElsewhereTest, IdleWatchersAskTheStoreTogether) {
  constexpr std::size_t kWatchers = 60;
  PutAll(1, 1, 0);
  STRATA_ASSERT_OK(AtRest(db(0), kShared));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto sql, Connection::Open(store_));
  const auto transactions = [&]() -> double {
    absl::StatusOr<Rows> rows =
        sql->Query("SELECT xact_commit FROM pg_stat_database WHERE datname = current_database()");
    return rows.ok() && rows->Next() ? static_cast<double>(rows->Int(0)) : -1.0;
  };
  std::vector<std::unique_ptr<Watching>> watchers;
  for (std::size_t i = 0; i < kWatchers; ++i) {
    watchers.push_back(std::make_unique<Watching>(*servers_[1], api::WatchOptions()));
  }
  for (const auto& watcher : watchers) ASSERT_TRUE(watcher->Await(1));
  absl::SleepFor(absl::Seconds(12));  // so long a server's counts of before may come late
  const double before = transactions();
  const absl::Time begun = absl::Now();
  absl::SleepFor(absl::Seconds(3));
  const double a_second = (transactions() - before) / absl::ToDoubleSeconds(absl::Now() - begun);
  std::printf("%.0f transactions a second for %zu watchers\n", a_second, kWatchers);
  EXPECT_LT(a_second, static_cast<double>(kWatchers));
}

}  // namespace
}  // namespace strata::testing
