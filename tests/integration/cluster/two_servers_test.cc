// Two real servers on one database: one has a map, the other says which; where it dies or freezes
// the other takes over, and nothing that was acknowledged by either is lost or there twice.
#include <array>
#include <atomic>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/sdk/client.h"
#include "core/codec/local_map_codec.h"
#include "core/common/map_owner.h"
#include "core/common/retry_delay.h"
#include "core/common/status.h"
#include "core/common/steady_time.h"
#include "core/mls/build.h"
#include "tests/integration/cluster/sharing_servers.h"
#include "tests/integration/numbered_scans.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::HasSubstr;

constexpr const char* kMap = kShared;
constexpr std::size_t kPoints = kNumberedPoints;

class TwoServersTest : public SharingServersTest {
 protected:
  // Sends a scan to one server after the other until one acknowledges it.
  void PutSomewhere(std::uint64_t sequence, std::size_t first) {
    std::size_t server = first;
    STRATA_EXPECT_OK(Insist([&] {
      const auto ack = PutNumbered(*servers_[server++ % 2]->db(), kMap, sequence);
      if (ack.ok()) Note(sequence, ack->commit_sequence);
      return ack.status();
    }));
  }
  void Note(std::uint64_t sequence, std::uint64_t number) {
    absl::MutexLock lock(&mutex_);
    numbers_[sequence] = number;
  }
  std::size_t acknowledged() {
    absl::MutexLock lock(&mutex_);
    return numbers_.size();
  }
  // All that was acknowledged is there once, joined, and as if one server had taken it in.
  void CheckAll(std::size_t server);

  absl::Mutex mutex_;
  std::map<std::uint64_t, std::uint64_t> numbers_;  // of acknowledged scans
};

absl::Status RunJobOf(api::Database& db, const char* map, const char* kind) {
  STRATA_ASSIGN_OR_RETURN(const JobInfo job, db.jobs().Start({}, map, kind, {}));
  JobInfo last;
  STRATA_RETURN_IF_ERROR(db.jobs().Watch({}, map, job.id, [&last](const JobInfo& now) {
    last = now;
    return absl::OkStatus();
  }));
  if (last.state == JobState::kSucceeded) return absl::OkStatus();
  return absl::InternalError(absl::StrCat(kind, ": ", last.message));
}

absl::Status Verify(api::Database& db, const char* map) { return RunJobOf(db, map, "verify"); }

void TwoServersTest::CheckAll(std::size_t server) {
  api::Database& found = db(server);
  MapStats stats;
  STRATA_ASSERT_OK(Insist([&]() -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(stats, AtRest(found, kMap));
    return absl::OkStatus();
  }));
  EXPECT_EQ(stats.scans, numbers_.size());
  for (const auto& [sequence, number] : numbers_) {
    const auto info = found.scans().Get({}, kMap, {"run", sequence});
    STRATA_ASSERT_OK(info);
    EXPECT_EQ(info->commit_sequence, number) << sequence;
    EXPECT_EQ(info->state, ScanState::kIntegrated) << sequence;
  }
  // Which of them has the map is for chance to say.
  std::size_t next = server;
  STRATA_EXPECT_OK(Insist([&] { return Verify(*servers_[next++ % 2]->db(), kMap); }));
  STRATA_ASSERT_OK(found.maps().Create({}, "alone", MapParameters()));
  for (const auto& [sequence, number] : numbers_)
    STRATA_ASSERT_OK(PutNumbered(found, "alone", sequence));
  STRATA_ASSERT_OK_AND_ASSIGN(const MapStats alone, AtRest(found, "alone"));
  EXPECT_EQ(stats.content_digest, alone.content_digest);
}

TEST_F(TwoServersTest, TheOneWithoutTheMapSaysWhoHasIt) {
  STRATA_ASSERT_OK(PutNumbered(db(0), kMap, 1));
  const absl::Status refused = AskTheOwner(db(1), kMap);
  EXPECT_THAT(refused, StatusIs(absl::StatusCode::kUnavailable, HasSubstr("server a")));
  EXPECT_EQ(MapOwnerOf(refused), "a");
  EXPECT_TRUE(RetryDelayOf(refused).has_value());
  const auto names = db(1).maps().List({});
  STRATA_ASSERT_OK(names);
  ASSERT_EQ(names->size(), 1U);
  EXPECT_EQ(names->front().name, kMap);
  // Other maps are other matters, and what one server removes the other has no more.
  STRATA_ASSERT_OK(db(1).maps().Create({}, "other", MapParameters()));
  EXPECT_EQ(MapOwnerOf(AskTheOwner(db(0), "other")), "b");
  STRATA_EXPECT_OK(db(1).maps().Delete({}, "other"));
  STRATA_EXPECT_OK(Insist([&] {
    const absl::Status gone = db(0).maps().Get({}, "other").status();
    return absl::IsNotFound(gone) ? absl::OkStatus() : gone;
  }));
  // A server that ends gives its maps up at once.
  servers_[0]->Signal(SIGTERM);
  const absl::Time ended = absl::Now();
  STRATA_EXPECT_OK(Insist([&] { return AskTheOwner(db(1), kMap); }));
  std::printf("taken over after %s\n", absl::FormatDuration(absl::Now() - ended).c_str());
}

// Acknowledged by whichever is asked, integrated by the one that has the map, and the same map.
TEST_F(TwoServersTest, ScansAreTakenInByServersThatHaveNotGotTheMap) {
  STRATA_ASSERT_OK(PutNumbered(db(0), kMap, 1));
  Note(1, PutNumbered(db(0), kMap, 1)->commit_sequence);
  std::vector<std::thread> robots;
  for (std::uint64_t robot = 0; robot < 4; ++robot) {
    robots.emplace_back([&, robot] {
      for (std::uint64_t i = 0; i < 8; ++i) {
        const std::uint64_t sequence = 2 + robot + 4 * i;
        const auto ack = PutNumbered(*servers_[(robot + i) % 2]->db(), kMap, sequence);
        STRATA_ASSERT_OK(ack);  // none is refused
        EXPECT_FALSE(ack->already_present);
        Note(sequence, ack->commit_sequence);
        const auto again = PutNumbered(*servers_[(robot + i + 1) % 2]->db(), kMap, sequence);
        STRATA_ASSERT_OK(again);
        EXPECT_TRUE(again->already_present);
        EXPECT_EQ(again->commit_sequence, ack->commit_sequence);
      }
    });
  }
  for (std::thread& robot : robots) robot.join();
  // In pieces, and others' under the same id.
  constexpr std::uint64_t kLarge = 100;
  constexpr std::size_t kLargePoints = 400'000;
  const auto put = [&](api::Database& there, std::uint64_t content) -> absl::StatusOr<ScanAck> {
    const PointCloud cloud = NumberedCloud(content, kLargePoints);
    ScanHeader header = NumberedHeader(kLarge, cloud);
    header.content_hash.clear();
    STRATA_ASSIGN_OR_RETURN(const auto upload, there.scans().Upload({}, kMap, header));
    for (std::size_t begin = 0; begin < cloud.size(); begin += 40'000) {
      PointCloud piece;
      const auto first = cloud.points.begin() + static_cast<std::ptrdiff_t>(begin);
      piece.points.assign(first, first + 40'000);
      STRATA_RETURN_IF_ERROR(upload->Write(piece));
    }
    return upload->Finish();
  };
  STRATA_ASSERT_OK_AND_ASSIGN(const ScanAck ack, put(db(1), kLarge));
  EXPECT_FALSE(ack.already_present);
  // On a busy machine a server may stand still in a commit for longer than its successor waits.
  const auto refusal = [&](api::Database& there) {
    absl::Status status = absl::UnavailableError("");
    for (int k = 0; k < 5 && absl::IsUnavailable(status); ++k) {
      status = put(there, kLarge + 1).status();
    }
    return status;
  };
  EXPECT_TRUE(absl::IsAlreadyExists(refusal(db(1))));
  EXPECT_TRUE(absl::IsAlreadyExists(refusal(db(0))));
  EXPECT_TRUE(put(db(0), kLarge)->already_present);
  std::size_t points = 0;
  STRATA_EXPECT_OK(db(0).scans().GetPoints({}, kMap, {"run", kLarge}, [&](const PointCloud& piece) {
    points += piece.size();
    return absl::OkStatus();
  }));
  EXPECT_EQ(points, kLargePoints);
  // Ready local maps.
  const MapParameters parameters;
  STRATA_ASSERT_OK_AND_ASSIGN(
      const auto built,
      BuildMlsMap(NumberedCloud(1, kPoints), Pose::Identity(), parameters.sensor, parameters.mls));
  STRATA_ASSERT_OK_AND_ASSIGN(const std::string local_map, EncodeLocalMap(built.map));
  ScanHeader ready;
  ready.id = {"run", kLarge + 1};
  ready.alignment = Alignment::kOff;
  for (const std::size_t server : {1U, 0U}) {
    STRATA_ASSERT_OK_AND_ASSIGN(
        const ScanAck taken,
        db(server).scans().UploadLocalMap({}, kMap, ready, parameters.mls, local_map));
    EXPECT_EQ(taken.already_present, server == 0);
  }
  STRATA_EXPECT_OK(AtRest(db(0), kMap));
  EXPECT_EQ(db(0).scans().Get({}, kMap, ready.id)->state, ScanState::kIntegrated);
  STRATA_EXPECT_OK(db(0).scans().Delete({}, kMap, ready.id));
  STRATA_EXPECT_OK(db(0).scans().Delete({}, kMap, {"run", kLarge}));  // CheckAll() has others
  EXPECT_EQ(MapOwnerOf(AskTheOwner(db(1), kMap)), "a");
  CheckAll(0);
}

// While the dead one's lease lasts, too.
TEST_F(TwoServersTest, ScansAreTakenInWhileNobodyCanIntegrateThem) {
  STRATA_ASSERT_OK(PutNumbered(db(0), kMap, 1));
  Note(1, PutNumbered(db(0), kMap, 1)->commit_sequence);
  STRATA_ASSERT_OK(PutNumbered(db(1), kMap, 2));
  Note(2, PutNumbered(db(1), kMap, 2)->commit_sequence);
  servers_[0]->Kill();
  PutSomewhere(3, 1);
  CheckAll(1);
}

// All that calls say of the map which the store itself can answer.
struct Told {
  std::string digest;
  std::uint64_t scans = 0;
  std::map<TileKey, std::pair<std::uint64_t, std::string>> tiles;  // version and bytes
  std::vector<std::string> fetched;
  std::vector<std::uint64_t> listed;  // numbers of scans
  std::size_t points = 0;
  std::size_t nodes = 0;
  std::size_t epochs = 0;
  std::size_t jobs = 0;
  std::vector<std::string> found;  // by jobs, or by people
  std::string backup;              // hash
  friend bool operator==(const Told&, const Told&) = default;
};

// Models, objects and classifiers.
absl::Status AskWhatWasFound(api::Database& db, std::vector<std::string>& found) {
  STRATA_ASSIGN_OR_RETURN(const PlaneModelInfo model,
                          db.models().GetPlaneModel({}, kMap, [&found](const ModelPlane& plane) {
                            found.push_back(absl::StrCat(plane.area_m2));
                            return absl::OkStatus();
                          }));
  found.push_back(absl::StrCat(model.job, " ", model.epoch, " ", model.scans, " ", model.points));
  STRATA_ASSIGN_OR_RETURN(const std::vector<KindInfo> kinds, db.objects().ListKinds({}, kMap));
  for (const KindInfo& kind : kinds) {
    STRATA_ASSIGN_OR_RETURN(const ThingKind read, db.objects().GetKind({}, kMap, kind.name));
    found.push_back(read.info.name);
  }
  const auto none = [](const auto&) { return absl::OkStatus(); };
  for (const absl::Status& listed : {db.objects().ListEntities({}, kMap, {}, none).status(),
                                     db.objects().ListInferred({}, kMap, {}, none).status(),
                                     db.classifiers().Get({}, kMap, "nobody").status()}) {
    found.push_back(listed.ToString(absl::StatusToStringMode::kWithNoExtraData));
  }
  STRATA_ASSIGN_OR_RETURN(const auto classifiers, db.classifiers().List({}, kMap));
  found.push_back(absl::StrCat(classifiers.size()));
  return absl::OkStatus();
}

absl::StatusOr<Told> Ask(api::Database& db) {
  Told told;
  STRATA_ASSIGN_OR_RETURN(const MapStats stats, db.maps().Stats({}, kMap));
  told.digest = stats.content_digest;
  told.scans = stats.scans;
  STRATA_RETURN_IF_ERROR(db.maps().Get({}, kMap).status());
  STRATA_ASSIGN_OR_RETURN(const auto epochs, db.maps().History({}, kMap));
  told.epochs = epochs.size();
  STRATA_ASSIGN_OR_RETURN(const auto tiles, db.tiles().List({}, kMap, api::TileArea()));
  for (const api::TileInfo& info : tiles) {
    STRATA_ASSIGN_OR_RETURN(const api::EncodedTile tile, db.tiles().Get({}, kMap, info.key));
    told.tiles[info.key] = {tile.version, tile.bytes};
  }
  const std::vector<api::HeldTile> held = {{TileKey{0, 999, 999}, 1}};  // which is gone
  STRATA_RETURN_IF_ERROR(
      db.tiles().Fetch({}, kMap, api::TileArea(), held, [&](const api::TileUpdate& update) {
        told.fetched.push_back(absl::StrCat(static_cast<int>(update.kind),
                                            update.tile.key.ToString(),
                                            " ",
                                            update.tile.version,
                                            update.tile.bytes));
        return absl::OkStatus();
      }));
  STRATA_RETURN_IF_ERROR(db.scans().List({}, kMap, {}, [&](const ScanInfo& info) {
    told.listed.push_back(info.commit_sequence);
    return absl::OkStatus();
  }));
  STRATA_RETURN_IF_ERROR(db.scans().GetPoints({}, kMap, {"run", 1}, [&](const PointCloud& piece) {
    told.points += piece.size();
    return absl::OkStatus();
  }));
  STRATA_ASSIGN_OR_RETURN(const auto graph, db.posegraph().Get({}, kMap));
  told.nodes = graph.nodes.size();
  STRATA_RETURN_IF_ERROR(db.posegraph().LookupPose({}, kMap, {"run", 1}).status());
  STRATA_ASSIGN_OR_RETURN(const auto jobs, db.jobs().List({}, kMap));
  told.jobs = jobs.size();
  STRATA_RETURN_IF_ERROR(AskWhatWasFound(db, told.found));
  STRATA_RETURN_IF_ERROR(db.maps().Backup({}, kMap, [&told](const api::BackupPiece& piece) {
    told.backup = absl::StrCat(piece.total_bytes, piece.content_hash);
    return absl::OkStatus();
  }));
  return told;
}

TEST_F(TwoServersTest, EveryServerAnswersReadsAlsoAfterTheOwnerDied) {
  for (std::uint64_t sequence = 1; sequence <= 5; ++sequence) {
    STRATA_ASSERT_OK(PutNumbered(db(0), kMap, sequence));
  }
  STRATA_ASSERT_OK(AtRest(db(0), kMap));
  STRATA_ASSERT_OK(Verify(db(0), kMap));
  STRATA_ASSERT_OK(RunJobOf(db(0), kMap, "planes"));
  STRATA_ASSERT_OK_AND_ASSIGN(const Told owner, Ask(db(0)));
  EXPECT_EQ(owner.scans, 5U);
  EXPECT_GT(owner.tiles.size(), 0U);
  EXPECT_EQ(owner.fetched.size(), owner.tiles.size() + 1);
  EXPECT_EQ(owner.points, kPoints);
  STRATA_ASSERT_OK_AND_ASSIGN(const Told other, Ask(db(1)));
  EXPECT_EQ(owner, other);
  EXPECT_EQ(MapOwnerOf(AskTheOwner(db(1), kMap)), "a");
  servers_[0]->Kill();
  STRATA_ASSERT_OK_AND_ASSIGN(const Told alone, Ask(db(1)));
  EXPECT_EQ(owner, alone);
}

// Queued by whichever is asked, run once by the one that has the map, known to all at once.
TEST_F(TwoServersTest, JobsAreStartedAtServersThatHaveNotGotTheMap) {
  STRATA_ASSERT_OK(PutNumbered(db(0), kMap, 1));
  std::set<std::uint64_t> ids;
  std::vector<std::thread> people;
  for (std::size_t person = 0; person < 4; ++person) {
    people.emplace_back([&, person] {
      for (std::size_t i = 0; i < 5; ++i) {
        const auto job =
            servers_[(person + i) % 2]->db()->jobs().Start({}, kMap, "verify", {{"threads", "1"}});
        STRATA_ASSERT_OK(job);
        for (const auto& server : servers_) {
          const auto known = server->db()->jobs().Get({}, kMap, job->id);
          STRATA_ASSERT_OK(known);
          EXPECT_EQ(known->parameters, job->parameters);
        }
        absl::MutexLock lock(&mutex_);
        EXPECT_TRUE(ids.insert(job->id).second) << job->id;
      }
    });
  }
  for (std::thread& person : people) person.join();
  EXPECT_EQ(MapOwnerOf(AskTheOwner(db(1), kMap)), "a");
  for (const std::uint64_t id : ids) {
    JobInfo last;
    STRATA_EXPECT_OK(db(id % 2).jobs().Watch({}, kMap, id, [&last](const JobInfo& now) {
      last = now;
      return absl::OkStatus();
    }));
    EXPECT_EQ(last.state, JobState::kSucceeded) << id << ": " << last.message;
  }
  EXPECT_EQ(db(0).jobs().List({}, kMap)->size(), ids.size());
  EXPECT_EQ(db(1).jobs().List({}, kMap)->size(), ids.size());
  // What it needs is asked for at once.
  EXPECT_TRUE(
      absl::IsNotFound(db(1).jobs().Start({}, kMap, "classify", {{"model", "nobody"}}).status()));
  EXPECT_TRUE(absl::IsInvalidArgument(db(1).jobs().Start({}, kMap, "dance", {}).status()));
  // Nobody has it for a while.
  servers_[0]->Kill();
  STRATA_EXPECT_OK(Insist([&] { return Verify(db(1), kMap); }));
}

// Told at whichever server, true at both at once: a job that is told to be cancelled is no more,
// and one that was running ends, or had ended.
TEST_F(TwoServersTest, JobsAreCancelledAtServersThatHaveNotGotTheMap) {
  for (std::uint64_t i = 1; i <= 8; ++i) STRATA_ASSERT_OK(PutNumbered(db(i % 2), kMap, i));
  std::atomic<int> waited = 0;
  std::atomic<int> ran = 0;
  std::vector<std::thread> people;
  for (std::size_t person = 0; person < 4; ++person) {
    people.emplace_back([&, person] {
      for (std::size_t i = 0; i < 8; ++i) {
        api::Database& mine = *servers_[(person + i) % 2]->db();
        api::Database& other = *servers_[(person + i + 1) % 2]->db();
        const auto job = mine.jobs().Start({}, kMap, "rebuild", {{"threads", "1"}});
        STRATA_ASSERT_OK(job);
        absl::SleepFor(absl::Milliseconds(40 * ((person + 3 * i) % 5)));
        const auto told = other.jobs().Cancel({}, kMap, job->id);
        STRATA_ASSERT_OK(told);
        EXPECT_NE(told->state, JobState::kQueued);
        EXPECT_NE(told->state, JobState::kFailed) << told->message;
        for (const auto& server : servers_) {
          const auto known = server->db()->jobs().Get({}, kMap, job->id);
          STRATA_ASSERT_OK(known);
          EXPECT_TRUE(known->state == told->state || !IsFinal(told->state)) << job->id;
        }
        ++(told->state == JobState::kCancelled ? waited : ran);
        STRATA_EXPECT_OK(Insist([&] {
          const auto now = mine.jobs().Get({}, kMap, job->id);
          if (!now.ok() || IsFinal(now->state)) return now.status();
          return absl::UnavailableError(absl::StrCat("job ", job->id, " has not ended"));
        }));
      }
    });
  }
  for (std::thread& person : people) person.join();
  std::printf("%d cancelled before they began, %d later\n", waited.load(), ran.load());
  EXPECT_GT(waited, 0);
  EXPECT_EQ(MapOwnerOf(AskTheOwner(db(1), kMap)), "a");
  // What nobody cancelled runs.
  STRATA_EXPECT_OK(Verify(db(1), kMap));
  STRATA_EXPECT_OK(Verify(db(0), kMap));
}

// Whoever asks one server and then the other, in whatever order, never goes back.
TEST_F(TwoServersTest, NobodySeesOlderTilesThanHeHasSeen) {
  std::atomic<bool> stop = false;
  std::thread robot([&] {
    for (std::uint64_t sequence = 1; sequence <= 25; ++sequence) {
      PutSomewhere(sequence, 0);
      STRATA_EXPECT_OK(AtRest(*servers_[1]->db(), kMap));
    }
    stop = true;
  });
  std::atomic<int> changes = 0;
  std::vector<std::thread> readers;
  for (std::size_t reader = 0; reader < 2; ++reader) {
    readers.emplace_back([&, reader] {
      std::uint64_t seen = 0;
      std::uint64_t scans = 0;
      for (std::size_t i = reader; !stop; ++i) {
        const auto tile = servers_[i % 2]->db()->tiles().Get({}, kMap, TileKey{0, 0, 0});
        if (absl::IsNotFound(tile.status()) && seen == 0) continue;
        STRATA_ASSERT_OK(tile);
        ASSERT_GE(tile->version, seen) << "server " << i % 2;
        if (tile->version > seen) ++changes;
        seen = tile->version;
        const auto stats = servers_[i % 2]->db()->maps().Stats({}, kMap);
        STRATA_ASSERT_OK(stats);
        ASSERT_GE(stats->scans - stats->scans_pending, scans);
        scans = stats->scans - stats->scans_pending;
      }
    });
  }
  robot.join();
  for (std::thread& reader : readers) reader.join();
  std::printf("%d changes seen\n", changes.load());
  EXPECT_GT(changes, 5);
}

TEST_F(TwoServersTest, AClientWithBothAddressesFindsTheServerThatHasTheMap) {
  ClientOptions options;
  options.target = absl::StrCat(servers_[0]->address(), ",", servers_[1]->address());
  STRATA_ASSERT_OK_AND_ASSIGN(const std::unique_ptr<api::Database> both, Connect(options));
  STRATA_ASSERT_OK(both->maps().Create({}, "other", MapParameters()));
  for (std::uint64_t sequence = 1; sequence <= 6; ++sequence) {
    STRATA_ASSERT_OK(PutNumbered(*both, kMap, sequence));
    STRATA_ASSERT_OK(PutNumbered(*both, "other", sequence));
  }
  STRATA_EXPECT_OK(Verify(*both, kMap));
  servers_[0]->Kill();
  for (std::uint64_t sequence = 7; sequence <= 9; ++sequence) {
    STRATA_ASSERT_OK(PutNumbered(*both, kMap, sequence));
    STRATA_ASSERT_OK(PutNumbered(*both, "other", sequence));
  }
  STRATA_ASSERT_OK_AND_ASSIGN(const MapStats stats, AtRest(*both, kMap));
  EXPECT_EQ(stats.scans, 9U);
}

// Servers whose names are their addresses: whoever knows one of them is sent to the other.
TEST_F(TwoServersTest, AClientOfOneServerUploadsAndWatchesWhereverTheMapIs) {
  for (const auto& server : servers_) {
    server->NameByAddress();
    server->Signal(SIGTERM);
    server->Await();
    server->Start();
  }
  STRATA_ASSERT_OK(Insist([&] { return PutNumbered(db(0), kMap, 1).status(); }));
  ClientOptions options;
  options.target = servers_[1]->address();
  STRATA_ASSERT_OK_AND_ASSIGN(const std::unique_ptr<api::Database> one, Connect(options));
  const api::Call watching;
  std::set<std::uint64_t> seen;
  std::uint64_t last = 0;
  absl::Mutex mutex;
  std::thread watcher([&] {
    const absl::Status ended =
        one->maps().Watch(watching, kMap, {}, [&](const api::MapUpdate& update) {
          absl::MutexLock lock(&mutex);
          EXPECT_GE(update.commit_sequence, last);
          last = update.commit_sequence;
          for (const api::ScanChange& scan : update.scans) {
            if (scan.state == ScanState::kIntegrated) seen.insert(scan.id.sequence);
          }
          return absl::OkStatus();
        });
    EXPECT_TRUE(absl::IsCancelled(ended)) << ended;
  });
  const auto all = [&](std::size_t scans) {
    const auto there = [&] { return seen.size() == scans; };
    absl::MutexLock lock(&mutex);
    return mutex.AwaitWithTimeout(absl::Condition(&there), kPatience);
  };
  for (std::uint64_t sequence = 2; sequence <= 5; ++sequence) {
    STRATA_EXPECT_OK(PutNumbered(*one, kMap, sequence));
  }
  STRATA_EXPECT_OK(Verify(*one, kMap));
  EXPECT_TRUE(all(5)) << seen.size();
  // The one that was named is gone: home again.
  servers_[0]->Kill();
  STRATA_EXPECT_OK(Insist([&] { return PutNumbered(*one, kMap, 6).status(); }));
  EXPECT_TRUE(all(6)) << seen.size();
  watching.stop.Request();
  watcher.join();
}

// A machine that lost its power, or its network, answers nothing and closes nothing.
TEST_F(TwoServersTest, AServerThatSaysNothingAnyMoreHoldsUpNobodyForLong) {
  ClientOptions options;
  options.target = absl::StrCat(servers_[0]->address(), ",", servers_[1]->address());
  options.keepalive = absl::Seconds(10);
  STRATA_ASSERT_OK_AND_ASSIGN(const std::unique_ptr<api::Database> both, Connect(options));
  STRATA_ASSERT_OK(PutNumbered(*both, kMap, 1));
  servers_[0]->Signal(SIGSTOP);
  for (int asked = 0; asked < 2; ++asked) {  // one of them is for the silent one
    STRATA_ASSERT_OK_AND_ASSIGN(const MapStats stats, both->maps().Stats({}, kMap));
    EXPECT_EQ(stats.scans, 1U);
  }
  servers_[0]->Signal(SIGCONT);
}

TEST_F(TwoServersTest, WhenTheOwnerIsKilledTheOtherTakesOverAndNothingIsLost) {
  constexpr std::uint64_t kRobots = 3;
  constexpr std::size_t kKills = 2;
  std::atomic<bool> stop = false;
  std::vector<std::thread> robots;
  for (std::uint64_t robot = 0; robot < kRobots; ++robot) {
    robots.emplace_back([&, robot] {
      for (std::uint64_t i = 0; !stop; ++i) PutSomewhere(1 + robot + kRobots * i, robot + i);
    });
  }
  for (std::size_t kill = 0; kill < kKills; ++kill) {
    const std::size_t before = acknowledged();
    const absl::Time end = absl::Now() + kPatience;
    while (acknowledged() < before + 10 && absl::Now() < end) absl::SleepFor(absl::Milliseconds(5));
    EXPECT_GE(acknowledged(), before + 10) << "nobody took over";
    servers_[kill % 2]->Kill();
    absl::SleepFor(absl::Milliseconds(1500));
    servers_[kill % 2]->Start();
  }
  stop = true;
  for (std::thread& robot : robots) robot.join();
  std::printf("%zu acknowledged\n", acknowledged());
  CheckAll(kKills % 2);
}

TEST_F(TwoServersTest, AFrozenOwnerThatWakesUpWritesNothingMore) {
  PutSomewhere(1, 0);
  std::uint64_t sequence = 2;
  for (std::size_t round = 0; round < 3; ++round) {
    const std::size_t owner = round % 2;
    const std::size_t other = 1 - owner;
    // Uploads are on their way at the moment it freezes, and go on where it stopped.
    std::vector<std::thread> robots;
    for (int robot = 0; robot < 4; ++robot) {
      const std::uint64_t mine = sequence++;
      robots.emplace_back([&, mine] {
        const auto ack = PutNumbered(*servers_[owner]->db(), kMap, mine);
        if (ack.ok()) Note(mine, ack->commit_sequence);
      });
    }
    absl::SleepFor(absl::Milliseconds(3));
    servers_[owner]->Signal(SIGSTOP);
    PutSomewhere(sequence++, other);
    STRATA_EXPECT_OK(PutNumbered(db(other), kMap, sequence).status());
    Note(sequence, PutNumbered(db(other), kMap, sequence)->commit_sequence);
    ++sequence;
    servers_[owner]->Signal(SIGCONT);
    for (std::thread& robot : robots) robot.join();
    // Awake, it does not answer from what it remembers.
    const std::size_t known = acknowledged();
    STRATA_EXPECT_OK(Insist([&]() -> absl::Status {
      STRATA_ASSIGN_OR_RETURN(const MapStats stats, db(owner).maps().Stats({}, kMap));
      EXPECT_GE(stats.scans, known);
      return absl::OkStatus();
    }));
  }
  // Whatever was not acknowledged then is sent again.
  for (std::uint64_t again = 1; again < sequence; ++again) PutSomewhere(again, 0);
  EXPECT_EQ(acknowledged(), sequence - 1);
  CheckAll(1);
}

}  // namespace
}  // namespace strata::testing
