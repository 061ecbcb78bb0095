// Durable acknowledgements of both stores: a scan with one piece of 20 kB a commit, the robots of a
// round each on a map of its own. Rounds alternate between the stores, on the same disk.
//   store_commit_benchmark SECONDS ROUNDS
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"

#include "core/common/status.h"
#include "core/storage/postgresql/postgres_maps.h"
#include "core/storage/sqlite/sqlite_storage.h"
#include "core/storage/storage.h"
#include "tests/support/postgres_cluster.h"
#include "tests/support/temp_dir.h"

namespace strata::testing {
namespace {

using Open = std::function<absl::StatusOr<std::unique_ptr<MapStorage>>(const std::string& name)>;

void Require(const absl::Status& status) {
  if (status.ok()) return;
  std::fprintf(stderr, "%s\n", status.ToString().c_str());
  std::exit(1);
}

std::string RandomBytes(std::size_t size) {
  std::mt19937_64 random(size);
  std::string bytes(size, ' ');
  for (char& c : bytes) c = static_cast<char>(random());
  return bytes;
}

absl::Status PutScan(StorageWriter& writer, std::uint64_t sequence, const std::string& bytes) {
  return writer.Commit(Durability::kFull, [&]() -> absl::Status {
    ScanRecord scan;
    scan.header.id = {"robot", sequence};
    scan.upload = sequence;
    scan.chunks = 1;
    STRATA_ASSIGN_OR_RETURN(scan.number, writer.NextCommitSequence());
    STRATA_RETURN_IF_ERROR(writer.PutChunk(scan.upload, 0, bytes));
    return writer.PutScan(scan);
  });
}

struct Round {
  double per_second = 0.0;
  double p50_ms = 0.0;
  double p99_ms = 0.0;
};

Round Drive(const Open& open, const std::string& round, int robots, absl::Duration time) {
  const std::string bytes = RandomBytes(20'000);
  std::vector<std::unique_ptr<MapStorage>> maps;
  for (int r = 0; r < robots; ++r) {
    auto map = open(absl::StrCat(round, "-", r));
    Require(map.status());
    maps.push_back(*std::move(map));
  }
  std::vector<std::vector<double>> took_ms(maps.size());
  std::vector<std::thread> threads;
  const absl::Time begun = absl::Now();
  for (std::size_t r = 0; r < maps.size(); ++r) {
    threads.emplace_back([&, r] {
      for (std::uint64_t sequence = 1; absl::Now() - begun < time; ++sequence) {
        const absl::Time before = absl::Now();
        Require(PutScan(maps[r]->writer(), sequence, bytes));
        took_ms[r].push_back(absl::ToDoubleMilliseconds(absl::Now() - before));
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  const double seconds = absl::ToDoubleSeconds(absl::Now() - begun);
  std::vector<double> all;
  for (const auto& some : took_ms) all.insert(all.end(), some.begin(), some.end());
  std::sort(all.begin(), all.end());
  return {
      static_cast<double>(all.size()) / seconds, all[all.size() / 2], all[all.size() * 99 / 100]};
}

double Median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

void Print(const char* store, int robots, const std::vector<Round>& rounds) {
  std::vector<double> rate, p50, p99;
  for (const Round& round : rounds) {
    rate.push_back(round.per_second);
    p50.push_back(round.p50_ms);
    p99.push_back(round.p99_ms);
  }
  std::printf("%-10s %2d robots  %7.0f scans/s  p50 %6.2f ms  p99 %7.2f ms\n",
              store,
              robots,
              Median(rate),
              Median(p50),
              Median(p99));
}

int Main(int argc, char** argv) {
  if (argc != 3) return 2;
  const absl::Duration time = absl::Seconds(std::atof(argv[1]));
  const int rounds = std::atoi(argv[2]);
  const auto cluster = PostgresCluster::Start(PostgresCluster::Disk::kSynced);
  Require(cluster.status());
  PostgresOptions options;
  options.where = (*cluster)->Address();
  const auto database = PostgresMaps::Connect(options);
  Require(database.status());
  TempDir directory;
  const Open postgres = [&](const std::string& name) {
    Require(database->Create(name, MapParameters(), absl::Now()));
    return database->Open(name);
  };
  const Open sqlite = [&](const std::string& name) {
    const auto file = directory.path() / (name + ".strata");
    Require(CreateSqliteMap(file, MapParameters(), absl::Now()));
    return OpenSqliteStorage(file, {});
  };
  for (const int robots : {1, 8}) {
    std::vector<Round> by_sqlite, by_postgres;
    for (int round = 0; round < rounds; ++round) {
      const std::string name = absl::StrCat(robots, "-", round);
      by_sqlite.push_back(Drive(sqlite, name, robots, time));
      by_postgres.push_back(Drive(postgres, name, robots, time));
    }
    Print("sqlite", robots, by_sqlite);
    Print("postgresql", robots, by_postgres);
    std::vector<double> ratio;
    for (std::size_t i = 0; i < by_sqlite.size(); ++i) {
      ratio.push_back(by_postgres[i].per_second / by_sqlite[i].per_second);
    }
    std::printf("ratio %.2f\n", Median(ratio));
  }
  return 0;
}

}  // namespace
}  // namespace strata::testing

int main(int argc, char** argv) { return strata::testing::Main(argc, argv); }
