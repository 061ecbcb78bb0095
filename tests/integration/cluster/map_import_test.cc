// Maps between files and a database: stratad import, beside servers and killed in the middle.
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/sdk/client.h"
#include "core/common/map_owner.h"
#include "core/common/status.h"
#include "core/engine/map/idle_map.h"
#include "core/engine/map/quarantine_file.h"
#include "core/storage/postgresql/connection.h"
#include "core/storage/postgresql/store_check.h"
#include "tests/integration/numbered_scans.h"
#include "tests/integration/stratad_process.h"
#include "tests/support/patience.h"
#include "tests/support/postgres_cluster.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr char kMap[] = "moved";
constexpr std::size_t kScans = 40;
constexpr std::size_t kPoints = 3000;

// A server and its client.
struct Served {
  explicit Served(const std::vector<std::string>& place) {
    std::vector<std::string> arguments = {"--listen", "127.0.0.1:0", "--optimize-every", "0"};
    arguments.insert(arguments.end(), place.begin(), place.end());
    process = std::make_unique<StratadProcess>(arguments);
    ClientOptions options;
    options.target = process->Address();
    auto connected = Connect(options);
    STRATA_EXPECT_OK(connected);
    if (connected.ok()) db = *std::move(connected);
  }
  void End() {
    db.reset();
    process->Signal(SIGTERM);
    EXPECT_EQ(process->Wait(), 0);
  }

  std::unique_ptr<StratadProcess> process;
  std::unique_ptr<api::Database> db;
};

absl::Status PutNumbered(api::Database& db, std::uint64_t sequence) {
  const PointCloud cloud = NumberedCloud(sequence, kPoints);
  STRATA_ASSIGN_OR_RETURN(const auto upload,
                          db.scans().Upload({}, kMap, NumberedHeader(sequence, cloud)));
  if (upload->points_held() < cloud.size()) STRATA_RETURN_IF_ERROR(upload->Write(cloud));
  return upload->Finish().status();
}

absl::StatusOr<MapStats> AfterAll(api::Database& db) {
  const absl::Time end = absl::Now() + kPatience;
  while (true) {
    STRATA_ASSIGN_OR_RETURN(MapStats stats, db.maps().Stats({}, kMap));
    if (stats.scans_pending == 0) return stats;
    if (absl::Now() > end) return absl::DeadlineExceededError("scans pend for too long");
    absl::SleepFor(absl::Milliseconds(20));
  }
}

absl::Status BackUpTo(api::Database& db, const fs::path& file) {
  std::ofstream out(file, std::ios::binary);
  return db.maps().Backup({}, kMap, [&](const api::BackupPiece& piece) {
    out.write(piece.bytes.data(), static_cast<std::streamsize>(piece.bytes.size()));
    return out ? absl::OkStatus() : absl::UnavailableError("cannot write");
  });
}

int Import(const fs::path& file, const std::vector<std::string>& place) {
  std::vector<std::string> arguments = {"import", kMap, file.string()};
  arguments.insert(arguments.end(), place.begin(), place.end());
  return StratadProcess(arguments).Wait();
}

class MapImportTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto cluster = SharedPostgresCluster();
    if (absl::IsFailedPrecondition(cluster.status())) GTEST_SKIP() << cluster.status().message();
    STRATA_ASSERT_OK(cluster);
    store_ =
        (*cluster)->AddressOfOwn(::testing::UnitTest::GetInstance()->current_test_info()->name());
    MakeBackup();
  }
  // Of a map of files.
  void MakeBackup() {
    Served files({"--data", Folder("files")});
    STRATA_ASSERT_OK(files.db->maps().Create({}, kMap, MapParameters()));
    for (std::uint64_t sequence = 1; sequence <= kScans; ++sequence) {
      STRATA_ASSERT_OK(PutNumbered(*files.db, sequence));
    }
    STRATA_ASSERT_OK_AND_ASSIGN(stats_, AfterAll(*files.db));
    STRATA_ASSERT_OK(BackUpTo(*files.db, backup_));
    files.End();
  }
  std::string Folder(const char* name) const { return (directory_.path() / name).string(); }
  void ExpectSame(const absl::StatusOr<MapStats>& stats) const {
    STRATA_ASSERT_OK(stats);
    EXPECT_EQ(stats->content_digest, stats_.content_digest);
    EXPECT_EQ(stats->scans, stats_.scans);
    EXPECT_EQ(stats->points, stats_.points);
  }
  // In all tables of the database.
  absl::StatusOr<std::int64_t> RowsOfMaps() const {
    STRATA_ASSIGN_OR_RETURN(const auto connection, Connection::Open(store_));
    std::int64_t sum = 0;
    for (const char* sql : {"SELECT count(*) FROM map_place",
                            "SELECT count(*) FROM truth_map",
                            "SELECT count(*) FROM truth_scan",
                            "SELECT count(*) FROM truth_chunk",
                            "SELECT count(*) FROM derived_mls_tile"}) {
      STRATA_ASSIGN_OR_RETURN(Rows row, connection->Query(sql));
      if (row.Next()) sum += row.Int(0);
    }
    return sum;
  }

  const TempDir directory_;
  const fs::path backup_ = directory_.path() / "backup.strata";
  std::string store_;
  MapStats stats_;
};

TEST_F(MapImportTest, FromFilesToADatabaseAndBackItIsTheSameMap) {
  Served server({"--data", Folder("beside"), "--store", store_});
  STRATA_ASSERT_OK(server.db->maps().List({}));
  ASSERT_EQ(Import(backup_, {"--store", store_}), 0);
  EXPECT_EQ(Import(backup_, {"--store", store_}), 1) << "it is there";
  ExpectSame(AfterAll(*server.db));
  // It goes on as the map that it was.
  STRATA_ASSERT_OK(PutNumbered(*server.db, 1)) << "which it has";
  STRATA_ASSERT_OK(PutNumbered(*server.db, kScans + 1));
  STRATA_ASSERT_OK_AND_ASSIGN(stats_, AfterAll(*server.db));
  EXPECT_EQ(stats_.scans, kScans + 1);
  STRATA_ASSERT_OK(BackUpTo(*server.db, directory_.path() / "back.strata"));
  const auto checks = CheckDatabaseMaps(store_);
  STRATA_ASSERT_OK(checks);
  ASSERT_EQ(checks->size(), 1U);
  STRATA_EXPECT_OK(checks->front().status);
  EXPECT_GT(checks->front().bytes, kScans * kPoints);
  server.End();
  EXPECT_EQ(Import(directory_.path() / "back.strata", {"--data", Folder("files")}), 1)
      << "it is there";
  ASSERT_EQ(Import(directory_.path() / "back.strata", {"--data", Folder("others")}), 0);
  Served files({"--data", Folder("others")});
  ExpectSame(AfterAll(*files.db));
  EXPECT_EQ(Import(backup_, {"--data", Folder("others")}), 1) << "a server has the directory";
  STRATA_ASSERT_OK_AND_ASSIGN(const JobInfo job, files.db->jobs().Start({}, kMap, "verify", {}));
  JobInfo last;
  STRATA_ASSERT_OK(files.db->jobs().Watch({}, kMap, job.id, [&last](const JobInfo& now) {
    last = now;
    return absl::OkStatus();
  }));
  EXPECT_EQ(last.state, JobState::kSucceeded) << last.message;
}

TEST_F(MapImportTest, KilledInTheMiddleItLeavesNothing) {
  const std::uint32_t seed = std::random_device()();
  std::printf("seed %u\n", seed);
  std::mt19937 random(seed);
  // Kills are spread over as long as one takes.
  const auto cluster = SharedPostgresCluster();
  const absl::Time begun = absl::Now();
  ASSERT_EQ(Import(backup_, {"--store", (*cluster)->AddressOfOwn("timed import")}), 0);
  const absl::Duration takes = absl::Now() - begun;
  Served({"--data", Folder("beside"), "--store", store_}).End();  // makes the tables
  constexpr int kKills = 15;
  int killed = 0;
  std::int64_t rows = 0;
  for (int i = 0; i < kKills && rows == 0; ++i) {
    StratadProcess import({"import", kMap, backup_.string(), "--store", store_});
    absl::SleepFor(takes * i / kKills + absl::Milliseconds(static_cast<int>(random() % 10)));
    import.Signal(SIGKILL);
    import.Wait();
    STRATA_ASSERT_OK_AND_ASSIGN(rows, RowsOfMaps());
    if (rows == 0) ++killed;  // or else it had committed
  }
  std::printf("killed %d times before its end\n", killed);
  EXPECT_GT(killed, 0);
  if (rows == 0) {
    ASSERT_EQ(Import(backup_, {"--store", store_}), 0);
  }
  Served server({"--data", Folder("beside"), "--store", store_});
  ExpectSame(AfterAll(*server.db));
  server.End();
  for (int i = 0; i < 5; ++i) {
    StratadProcess import({"import", kMap, backup_.string(), "--data", Folder("killed")});
    absl::SleepFor(absl::Milliseconds(static_cast<int>(random() % 30)));
    import.Signal(SIGKILL);
    import.Wait();
  }
  Served files({"--data", Folder("killed")});  // which clears what is half-made
  const auto maps = files.db->maps().List({});
  STRATA_ASSERT_OK(maps);
  for (const fs::directory_entry& entry : fs::directory_iterator(Folder("killed"))) {
    EXPECT_THAT(entry.path().filename().string(), ::testing::Not(HasSubstr(".making")));
  }
  if (!maps->empty()) ExpectSame(AfterAll(*files.db));
}

// Work that a server died of is told and put aside there, too, while no server has the map.
TEST_F(MapImportTest, QuarantineOfADatabaseIsForMapsThatNobodyHas) {
  ASSERT_EQ(Import(backup_, {"--store", store_}), 0);
  const MapPlace place{.directory = {}, .store = store_};
  const auto names = [&] {
    std::vector<std::string> list;
    const auto entries = ListQuarantine(place, kMap);
    STRATA_EXPECT_OK(entries);
    if (!entries.ok()) return list;
    for (const QuarantineEntry& entry : *entries) list.push_back(entry.name);
    return list;
  };
  EXPECT_THAT(names(), IsEmpty());
  STRATA_ASSERT_OK_AND_ASSIGN(const auto connection, Connection::Open(store_));
  STRATA_ASSERT_OK(connection->Change("UPDATE truth_scan SET state = $1 WHERE sequence = 1",
                                      static_cast<int>(ScanState::kPending)));
  STRATA_ASSERT_OK(AddToQuarantine(place, kMap, "scan run/1"));
  EXPECT_THAT(names(), ElementsAre("scan run/1"));
  {
    Served server({"--data", Folder("beside"), "--store", store_, "--server-name", "one"});
    const auto stats = AfterAll(*server.db);
    STRATA_ASSERT_OK(stats);
    EXPECT_EQ(stats->scans_failed, 1U);
    STRATA_ASSERT_OK(PutNumbered(*server.db, kScans + 1));  // so that it has the map
    const absl::Status refused = ReleaseFromQuarantine(place, kMap, "scan run/1");
    EXPECT_THAT(refused, StatusIs(absl::StatusCode::kUnavailable, ::testing::_));
    EXPECT_EQ(MapOwnerOf(refused), "one");
    server.End();
  }
  STRATA_ASSERT_OK(ReleaseFromQuarantine(place, kMap, "scan run/1"));
  EXPECT_THAT(names(), IsEmpty());
  Served server({"--data", Folder("beside"), "--store", store_});
  const auto stats = AfterAll(*server.db);
  STRATA_ASSERT_OK(stats);
  EXPECT_EQ(stats->scans_failed, 0U);
}

}  // namespace
}  // namespace strata::testing
