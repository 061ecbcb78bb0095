// A store that loses the answer to any one commit of a map's life: what was acknowledged is there,
// nothing is there twice, and what the engine says is what the store holds.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <map>
#include <memory>
#include <random>
#include <set>
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

#include "core/engine/engine.h"
#include "core/world/job_kinds.h"
#include "core/world/scan_hash.h"
#include "tests/core/engine/engine_fixture.h"
#include "tests/support/faults/answer_loss.h"
#include "tests/support/patience.h"
#include "tests/support/postgres_cluster.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

bool OnPostgresql() {
  const char* store = std::getenv("STRATA_STORE");
  return store != nullptr && std::string(store) == "postgresql";
}

// What clients see of a map at rest.
struct Seen {
  std::map<std::string, std::string> scans;  // state and pose by id
  std::map<std::uint64_t, std::string> jobs;
  std::vector<std::string> epochs;
  std::map<TileKey, std::string> tiles;
  std::string digest;
  std::uint64_t commit_sequence = 0;
  std::set<std::string> profiles;
  friend bool operator==(const Seen&, const Seen&) = default;
};

// Bytes of tiles by key and version.
using Versions = std::map<std::pair<TileKey, std::uint64_t>, std::string>;

class LostAnswersTest : public ::testing::Test {
 protected:
  void Open(bool losing) {
    database_.reset();
    EngineOptions options;
    options.directory = directory_->path();
    options.prepare_after = absl::InfiniteDuration();
    options.max_batch_scans = 2;
    if (OnPostgresql()) {
      STRATA_ASSERT_OK_AND_ASSIGN(PostgresCluster* const cluster, SharedPostgresCluster());
      options.store = cluster->AddressOfOwn(directory_->path().string());
    }
    STRATA_ASSERT_OK_AND_ASSIGN(
        database_,
        OpenEngine(options,
                   [&](const EngineOptions& o, const MapDirectory& directory)
                       -> absl::StatusOr<std::unique_ptr<MapStores>> {
                     auto stores = OpenMapStores(o, directory);
                     if (!stores.ok() || !losing) return stores;
                     return LoseAnswers(*std::move(stores), loss_);
                   }));
  }
  // As clients do: again while the server is not available.
  absl::Status Insist(const std::function<absl::Status()>& call) {
    const absl::Time end = absl::Now() + kPatience;
    while (true) {
      absl::Status done = call();
      if (!absl::IsUnavailable(done) || absl::Now() >= end) return done;
      absl::SleepFor(absl::Milliseconds(5));
    }
  }
  // Sends a part of an announced scan, breaks off, and sends all of it.
  void Put(std::uint64_t sequence) {
    const PointCloud cloud = MakeRoom(sequence, 600);
    ScanHeader header = HeaderOf({"run", sequence}, cloud, RoomPose(sequence));
    ScanHasher hasher;
    hasher.Add(cloud);
    header.content_hash = hasher.Digest(header);
    STRATA_EXPECT_OK(Insist([&]() -> absl::Status {
      auto upload = db().scans().Upload({}, kMapName, header);
      if (!upload.ok()) return upload.status();
      if ((*upload)->points_held() == header.point_count) return absl::OkStatus();
      PointCloud half;
      half.points.assign(cloud.points.begin() + (*upload)->points_held(), cloud.points.end());
      if (half.points.size() > 300) half.points.resize(300);
      return (*upload)->Write(half);
    }));
    STRATA_EXPECT_OK(Insist([&]() -> absl::Status {
      auto upload = db().scans().Upload({}, kMapName, header);
      if (!upload.ok()) return upload.status();
      PointCloud rest;
      rest.points.assign(cloud.points.begin() + (*upload)->points_held(), cloud.points.end());
      if (!rest.points.empty()) {
        if (const absl::Status written = (*upload)->Write(rest); !written.ok()) return written;
      }
      return (*upload)->Finish().status();
    }));
    Look();
  }
  void AwaitIntegrated() {
    bool pending = true;
    STRATA_EXPECT_OK(Insist([&]() -> absl::Status {
      const auto stats = db().maps().Stats({}, kMapName);
      if (!stats.ok()) return stats.status();
      pending = stats->scans_pending > 0;
      return pending ? absl::UnavailableError("pending") : absl::OkStatus();
    }));
    EXPECT_FALSE(pending);
    Look();
  }
  // Whoever does not know whether his job was taken looks for it, and waits for its end.
  void Run(const std::string& kind) {
    std::uint64_t id = 0;
    STRATA_EXPECT_OK(Insist([&]() -> absl::Status {
      const auto jobs = db().jobs().List({}, kMapName);
      if (!jobs.ok()) return jobs.status();
      for (const JobInfo& job : *jobs) {
        if (job.kind == kind) id = job.id;
      }
      if (id != 0) return absl::OkStatus();
      const auto started = db().jobs().Start({}, kMapName, kind, {});
      if (started.ok()) id = started->id;
      return started.status();
    }));
    JobInfo last;
    STRATA_EXPECT_OK(Insist([&] {
      return db().jobs().Watch({}, kMapName, id, [&](const JobInfo& job) {
        last = job;
        return absl::OkStatus();
      });
    }));
    EXPECT_EQ(last.state, JobState::kSucceeded) << last.message;
    Look();
  }
  // No version of a tile ever has other bytes than it had.
  void Look() {
    api::TileArea area;
    STRATA_EXPECT_OK(Insist([&] {
      return db().tiles().Fetch({}, kMapName, area, {}, [&](const api::TileUpdate& update) {
        const auto [it, fresh] =
            versions_.try_emplace({update.tile.key, update.tile.version}, update.tile.bytes);
        EXPECT_TRUE(fresh || it->second == update.tile.bytes)
            << update.tile.key.ToString() << " version " << update.tile.version;
        return absl::OkStatus();
      });
    }));
  }
  Seen SeenNow() {
    Seen seen;
    STRATA_EXPECT_OK(Insist([&]() -> absl::Status {
      seen = Seen();
      const auto stats = db().maps().Stats({}, kMapName);
      if (!stats.ok()) return stats.status();
      seen.digest = stats->content_digest;
      seen.commit_sequence = stats->commit_sequence;
      const auto jobs = db().jobs().List({}, kMapName);
      if (!jobs.ok()) return jobs.status();
      for (const JobInfo& job : *jobs) {
        seen.jobs[job.id] = absl::StrCat(job.kind, " ", ToString(job.state));
      }
      const auto epochs = db().maps().History({}, kMapName);
      if (!epochs.ok()) return epochs.status();
      for (const EpochInfo& epoch : *epochs) seen.epochs.push_back(epoch.reason);
      const auto profiles = db().planning().ListProfiles({}, kMapName);
      if (!profiles.ok()) return profiles.status();
      for (const auto& [name, profile] : *profiles) {
        seen.profiles.insert(absl::StrCat(name, " ", profile.radius_m));
      }
      return db().scans().List({}, kMapName, {}, [&](const ScanInfo& scan) {
        EXPECT_TRUE(
            seen.scans
                .emplace(scan.header.id.ToString(),
                         absl::StrCat(
                             static_cast<int>(scan.state), " ", scan.T_map_scan.translation().x()))
                .second);
        return absl::OkStatus();
      });
    }));
    seen.tiles = AllTiles(db());
    return seen;
  }
  // The life of a map.
  void Live() {
    STRATA_ASSERT_OK(Insist([&] {
      const absl::Status made = db().maps().Create({}, kMapName, SmallMap()).status();
      return absl::IsAlreadyExists(made) ? absl::OkStatus() : made;
    }));
    for (std::uint64_t i = 1; i <= 3; ++i) Put(i);
    AwaitIntegrated();
    STRATA_EXPECT_OK(Insist([&] {
      RobotProfile profile;
      profile.radius_m = 0.4;
      return db().planning().SetProfile({}, kMapName, "default", profile);
    }));
    Look();
    STRATA_EXPECT_OK(Insist([&] {
      return db().posegraph().SetPose({}, kMapName, {"run", 2}, PoseAt(3, 1));
    }));
    Look();
    Run(std::string(kVerifyJob));
    Put(4);
    STRATA_EXPECT_OK(Insist([&] {
      const absl::Status gone = db().scans().Delete({}, kMapName, {"run", 1});
      return absl::IsNotFound(gone) ? absl::OkStatus() : gone;
    }));
    Run(std::string(kRebuildJob));
    AwaitIntegrated();
  }
  void CheckLife(const std::string& what) {
    Seen seen = SeenNow();
    EXPECT_EQ(seen.scans.size(), 3U) << what;
    EXPECT_EQ(seen.scans["run/2"], "2 3") << what;  // integrated, where it was put
    EXPECT_EQ(seen.jobs.size(), 2U) << what;
    EXPECT_EQ(seen.digest, digest_) << what;
    EXPECT_TRUE(seen.profiles.contains("default 0.4")) << what;
    EXPECT_LE(seen.epochs.size(), 3U) << what;  // of one pose, set twice at most
    Open(/*losing=*/false);
    Look();
    EXPECT_TRUE(SeenNow() == seen) << what << ": the store holds something else";
  }
  api::Database& db() { return *database_; }
  void Begin() {
    database_.reset();
    directory_ = std::make_unique<TempDir>();
    versions_.clear();
    Open(/*losing=*/true);
  }

  AnswerLoss loss_;
  std::unique_ptr<TempDir> directory_;
  std::unique_ptr<api::Database> database_;
  Versions versions_;
  std::string digest_;
};

TEST_F(LostAnswersTest, AtAnyCommitOfAMapsLife) {
  if (OnPostgresql() && absl::IsFailedPrecondition(SharedPostgresCluster().status())) {
    GTEST_SKIP() << SharedPostgresCluster().status().message();
  }
  Begin();
  const int before = loss_.commits();
  Live();
  const int commits = loss_.commits() - before;
  digest_ = SeenNow().digest;
  CheckLife("without a loss");
  ASSERT_GT(commits, 20);
  int lost = 0;
  // Some of them a run; all with STRATA_LOST_ANSWERS=1.
  const int stride = std::getenv("STRATA_LOST_ANSWERS") != nullptr ? 1 : OnPostgresql() ? 24 : 9;
  const std::uint32_t seed = std::random_device{}();
  std::printf("seed %u\n", seed);
  for (int at = static_cast<int>(seed % static_cast<std::uint32_t>(stride)); at < commits;
       at += stride) {
    for (const bool takes_place : {true, false}) {
      loss_.LoseAfter(at, takes_place);
      Begin();
      Live();
      lost += loss_.lost() ? 1 : 0;
      CheckLife(absl::StrCat("commit ", at, takes_place ? " took place" : " did not"));
      if (HasFailure()) return;
    }
  }
  std::printf("%d commits, %d answers lost\n", commits, lost);
  EXPECT_GE(lost, commits / stride);
}

}  // namespace
}  // namespace strata::testing
