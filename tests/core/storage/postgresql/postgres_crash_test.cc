// A server that dies at any moment of its commits.
#include <atomic>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/common/status.h"
#include "core/storage/outcome.h"
#include "core/storage/postgresql/connection.h"
#include "core/storage/postgresql/postgres_maps.h"
#include "core/storage/storage.h"
#include "tests/support/patience.h"
#include "tests/support/postgres_cluster.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

// One robot: scans that its store has acknowledged, refused, or left in the dark.
struct Ledger {
  std::vector<std::uint64_t> acknowledged;
  std::vector<std::uint64_t> numbers;  // of the acknowledged ones
  std::uint64_t unknown = 0;
};

absl::Status PutScan(StorageWriter& writer,
                     std::uint64_t robot,
                     std::uint64_t sequence,
                     const std::string& bytes,
                     std::uint64_t& number) {
  return writer.Commit(Durability::kFull, [&]() -> absl::Status {
    ScanRecord scan;
    scan.header.id = {absl::StrCat("robot ", robot), sequence};
    scan.upload = robot * 1'000'000 + sequence;
    scan.chunks = 1;
    STRATA_ASSIGN_OR_RETURN(scan.number, writer.NextCommitSequence());
    number = scan.number;
    STRATA_RETURN_IF_ERROR(writer.PutChunk(scan.upload, 0, bytes));
    return writer.PutScan(scan);
  });
}

void Drive(StorageWriter& writer,
           std::uint64_t robot,
           const std::atomic<bool>& stop,
           std::atomic<std::uint64_t>& acknowledged,
           Ledger& ledger) {
  const std::string bytes(20'000, static_cast<char>('a' + robot));
  for (std::uint64_t sequence = 1; !stop; ++sequence) {
    std::uint64_t number = 0;
    const absl::Status put = PutScan(writer, robot, sequence, bytes, number);
    if (put.ok()) {
      ledger.acknowledged.push_back(sequence);
      ledger.numbers.push_back(number);
      ++acknowledged;
      continue;
    }
    EXPECT_THAT(put, StatusIs(absl::StatusCode::kUnavailable, ::testing::_));
    if (IsOutcomeUnknown(put)) ++ledger.unknown;
    absl::SleepFor(absl::Milliseconds(5));
  }
}

// However slow the disk is.
void AwaitMore(const std::atomic<std::uint64_t>& acknowledged, std::uint64_t more) {
  const std::uint64_t enough = acknowledged + more;
  for (const absl::Time end = absl::Now() + kPatience; absl::Now() < end;) {
    if (acknowledged >= enough) return;
    absl::SleepFor(absl::Milliseconds(5));
  }
}

// Everything acknowledged is there with its bytes, and nothing is there that was refused.
void Check(StorageReader& reader, std::uint64_t robot, const Ledger& ledger) {
  const std::string bytes(20'000, static_cast<char>('a' + robot));
  for (std::size_t i = 0; i < ledger.acknowledged.size(); ++i) {
    const std::uint64_t sequence = ledger.acknowledged[i];
    STRATA_ASSERT_OK_AND_ASSIGN(const std::optional<PosedScan> found,
                                reader.FindScan({absl::StrCat("robot ", robot), sequence}, 1));
    ASSERT_TRUE(found.has_value()) << "robot " << robot << " scan " << sequence << " is lost";
    EXPECT_EQ(found->scan.number, ledger.numbers[i]);
    EXPECT_THAT(reader.GetChunk(robot * 1'000'000 + sequence, 0), IsOkAndHolds(bytes));
  }
}

struct Case {
  const char* name;
  bool alone;  // a map a robot, open once; otherwise all write one
};

class PostgresCrashTest : public ::testing::TestWithParam<Case> {
 protected:
  absl::StatusOr<std::unique_ptr<MapStorage>> Open(const PostgresMaps& maps,
                                                   std::uint64_t robot) const {
    const bool alone = GetParam().alone;
    const std::string name = absl::StrCat("map ", alone ? robot : 0);
    const absl::Status made = maps.Create(name, MapParameters(), absl::Now());
    if (!made.ok() && !absl::IsAlreadyExists(made)) return made;
    return alone ? maps.OpenAlone(name) : maps.Open(name);
  }
};

TEST_P(PostgresCrashTest, NothingAcknowledgedIsLostWhenTheServerDies) {
  auto started = PostgresCluster::Start(PostgresCluster::Disk::kSynced);
  if (absl::IsFailedPrecondition(started.status())) GTEST_SKIP() << started.status().message();
  STRATA_ASSERT_OK(started);
  PostgresCluster& cluster = **started;
  PostgresOptions options;
  options.where = cluster.Address();
  STRATA_ASSERT_OK_AND_ASSIGN(const PostgresMaps maps, PostgresMaps::Connect(options));

  constexpr std::uint64_t kRobots = 4;
  constexpr int kCrashes = 3;
  const std::uint32_t seed = std::random_device{}();
  std::printf("seed %u\n", seed);
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> pause_ms(100, 500);
  std::vector<std::unique_ptr<MapStorage>> storages;
  for (std::uint64_t robot = 0; robot < kRobots; ++robot) {
    STRATA_ASSERT_OK_AND_ASSIGN(std::unique_ptr<MapStorage> storage, Open(maps, robot));
    storages.push_back(std::move(storage));
  }
  std::atomic<bool> stop = false;
  std::atomic<std::uint64_t> acknowledged = 0;
  std::vector<Ledger> ledgers(kRobots);
  std::vector<std::thread> robots;
  for (std::uint64_t robot = 0; robot < kRobots; ++robot) {
    robots.emplace_back([&, robot] {
      Drive(storages[robot]->writer(), robot, stop, acknowledged, ledgers[robot]);
    });
  }
  absl::Status restarted;
  for (int crash = 0; crash < kCrashes && restarted.ok(); ++crash) {
    AwaitMore(acknowledged, 8);
    absl::SleepFor(absl::Milliseconds(pause_ms(random)));
    cluster.Crash();
    restarted = cluster.Restart();
  }
  AwaitMore(acknowledged, 8);
  stop = true;
  for (std::thread& robot : robots) robot.join();
  STRATA_ASSERT_OK(restarted);

  std::uint64_t known = 0;
  std::uint64_t unknown = 0;
  std::uint64_t there = 0;
  for (std::uint64_t robot = 0; robot < kRobots; ++robot) {
    STRATA_ASSERT_OK_AND_ASSIGN(const auto reader, storages[robot]->NewReader());
    Check(*reader, robot, ledgers[robot]);
    known += ledgers[robot].acknowledged.size();
    unknown += ledgers[robot].unknown;
    if (robot == 0 || GetParam().alone) there += reader->GetScanTotals()->scans;
  }
  std::printf("%d acknowledged, %d unknown, %d of those there\n",
              static_cast<int>(known),
              static_cast<int>(unknown),
              static_cast<int>(there - known));
  EXPECT_GT(known, 20U);
  EXPECT_GE(there, known);
  EXPECT_LE(there, known + unknown);
  if (GetParam().alone) {
    EXPECT_EQ(unknown, 0U);
  }
}

// What a commit that was not waited for has written may go with the server: nothing is built on it.
TEST(PostgresLostCommitTest, AfterALostRelaxedCommitNothingIsWrittenByWhoeverMadeIt) {
  auto started = PostgresCluster::Start(PostgresCluster::Disk::kSynced);
  if (absl::IsFailedPrecondition(started.status())) GTEST_SKIP() << started.status().message();
  STRATA_ASSERT_OK(started);
  PostgresCluster& cluster = **started;
  {  // nobody writes the log but whoever waits for it
    STRATA_ASSERT_OK_AND_ASSIGN(const auto connection, Connection::Open(cluster.Address()));
    STRATA_ASSERT_OK(connection->Execute("ALTER SYSTEM SET wal_writer_delay = 10000"));
    STRATA_ASSERT_OK(connection->Execute("ALTER SYSTEM SET wal_writer_flush_after = 100000"));
    STRATA_ASSERT_OK(connection->Execute("SELECT pg_reload_conf()"));
    absl::SleepFor(absl::Milliseconds(500));
  }
  PostgresOptions options;
  options.where = cluster.Address();
  STRATA_ASSERT_OK_AND_ASSIGN(const PostgresMaps maps, PostgresMaps::Connect(options));
  STRATA_ASSERT_OK(maps.Create("map", MapParameters(), absl::Now()));
  STRATA_ASSERT_OK_AND_ASSIGN(std::unique_ptr<MapStorage> storage, maps.OpenAlone("map"));
  const auto put = [&](Durability durability, std::uint64_t upload) {
    return storage->writer().Commit(durability,
                                    [&] { return storage->writer().PutChunk(upload, 0, "bytes"); });
  };
  const auto there = [&](std::uint64_t upload) {
    const auto reader = storage->NewReader();
    return reader.ok() && (*reader)->GetChunk(upload, 0).ok();
  };
  int lost = 0;
  for (std::uint64_t upload = 1; upload <= 5; ++upload) {
    STRATA_ASSERT_OK(put(Durability::kFull, 10 * upload));
    STRATA_ASSERT_OK(put(Durability::kRelaxed, 10 * upload + 1));
    cluster.Crash();
    STRATA_ASSERT_OK(cluster.Restart());
    EXPECT_TRUE(there(10 * upload));
    const bool kept = there(10 * upload + 1);
    lost += kept ? 0 : 1;
    const absl::Status later = put(Durability::kFull, 10 * upload + 2);
    EXPECT_EQ(later.ok(), kept) << later;
    EXPECT_EQ(IsOutcomeUnknown(later), !kept) << later;
    EXPECT_EQ(there(10 * upload + 2), kept);
    if (!kept) {
      EXPECT_TRUE(IsOutcomeUnknown(put(Durability::kRelaxed, 10 * upload + 3)));
      storage.reset();
      STRATA_ASSERT_OK_AND_ASSIGN(storage, maps.OpenAlone("map"));
      STRATA_EXPECT_OK(put(Durability::kFull, 10 * upload + 4));
    }
  }
  std::printf("%d of 5 were lost\n", lost);
  EXPECT_GT(lost, 0);
}

INSTANTIATE_TEST_SUITE_P(Writers,
                         PostgresCrashTest,
                         ::testing::Values(Case{"Shared", false}, Case{"Alone", true}),
                         [](const auto& tested) { return std::string(tested.param.name); });

}  // namespace
}  // namespace strata::testing
