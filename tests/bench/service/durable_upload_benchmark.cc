// How fast scans become durable through a server, beside a bare program that writes the same bytes.
//
//   durable_upload_benchmark [SCANS [REPEATS [smoke]]]
//
// Robots (threads with the SDK) send recorded scans over loopback to a server in this process, each
// the next when the one before is acknowledged. Every commit is noted down as SQLite runs it; the
// bare program then writes the same encoded pieces into an empty file of the same settings, in the
// same commits, with nothing else to do, and the rates are compared. Acknowledged scans are also
// integrated, behind it, by a thread that competes for the processors: "held" gives that thread
// only what nobody else wants (SCHED_IDLE), "at work" is as it comes. Exits 1 below the bound,
// which holds for "held". Nothing else may run on the machine. "encoded" is the bare program when
// it must make the pieces from the points first, as the server does: what one thread can reach that
// gets the points for nothing.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include <glog/logging.h>
#include <sched.h>
#include <sqlite3.h>

#include "client/sdk/client.h"
#include "core/codec/point_codec.h"
#include "core/engine/engine.h"
#include "core/world/scan_hash.h"
#include "server/server.h"
#include "tests/core/codec/tile_samples.h"
#include "tests/support/data_dir.h"
#include "tests/support/temp_dir.h"

namespace strata {
namespace {

constexpr double kBound = 0.8;
constexpr char kMap[] = "world";
using Clock = std::chrono::steady_clock;

double SecondsSince(Clock::time_point begun) {
  return std::chrono::duration<double>(Clock::now() - begun).count();
}

void Require(bool good, const std::string& what) {
  if (good) return;
  std::fprintf(stderr, "durable_upload_benchmark: %s\n", what.c_str());
  std::exit(1);
}

// One commit with pieces of points in it.
struct Batch {
  bool full = true;  // synchronous = FULL
  int pieces = 0;
};

// Notes down the commits of every connection that this process opens.
class CommitLog {
 public:
  static CommitLog& Instance() {
    static CommitLog log;
    return log;
  }
  std::vector<Batch> Take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(batches_, {});
  }

 private:
  CommitLog() { sqlite3_auto_extension(reinterpret_cast<void (*)()>(&OnOpen)); }

  static int OnOpen(sqlite3* database,
                    const char** /*error*/,
                    const sqlite3_api_routines* /*api*/) {
    return sqlite3_trace_v2(database, SQLITE_TRACE_STMT, &OnStatement, nullptr);
  }
  static int OnStatement(unsigned /*event*/, void* /*context*/, void* statement, void* text) {
    const char* const sql = static_cast<const char*>(text);
    Instance().Note(sqlite3_db_handle(static_cast<sqlite3_stmt*>(statement)), sql);
    return 0;
  }
  void Note(const sqlite3* database, absl::string_view sql) {
    const std::lock_guard lock(mutex_);
    Batch& open = open_[database];
    if (absl::StartsWith(sql, "PRAGMA synchronous")) {
      open.full = absl::StrContains(sql, "FULL");
    } else if (absl::StartsWith(sql, "INSERT INTO truth_chunk")) {
      ++open.pieces;
    } else if (sql == "COMMIT") {
      if (open.pieces > 0) batches_.push_back(open);
      open.pieces = 0;
    }
  }

  std::mutex mutex_;
  std::map<const sqlite3*, Batch> open_;
  std::vector<Batch> batches_;
};

struct Run {
  double seconds = 0.0;
  std::vector<double> ack_s;  // from a scan's last point to its acknowledgement
  std::vector<Batch> batches;
  std::vector<std::string> pieces;
  std::uint64_t bytes = 0;  // of the pieces
};

std::vector<PointCloud> RecordedScans(std::size_t most) {
  const auto folder = testing::FindData("nclt_campus_loop");
  Require(folder.has_value(), "no recorded data: set STRATA_DATA");
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(*folder / "scans")) {
    files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  files.resize(std::min(files.size(), most));
  std::vector<PointCloud> scans;
  for (const auto& file : files) scans.emplace_back().points = testing::ReadPlainPcd(file);
  return scans;
}

// The thread that integrates scans gets only what nobody else wants. How many such there are.
int HoldThreadsThatIntegrate() {
  int held = 0;
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task")) {
    std::string name;
    std::getline(std::ifstream(task.path() / "comm"), name);
    if (name != "worker") continue;
    const sched_param none{};
    held += sched_setscheduler(std::stoi(task.path().filename()), SCHED_IDLE, &none) == 0 ? 1 : 0;
  }
  return held;
}

// It gets its name when it first runs.
void HoldIntegration() {
  constexpr double kPatienceSeconds = 60.0;
  const Clock::time_point begun = Clock::now();
  int held = HoldThreadsThatIntegrate();
  while (held == 0 && SecondsSince(begun) < kPatienceSeconds) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    held = HoldThreadsThatIntegrate();
  }
  Require(held == 1, "the thread that integrates was not found");
}

// Sends scans robot, robot + robots … of `count`; the time from last point to acknowledgement of
// each.
std::vector<double> Drive(const std::string& address,
                          const std::vector<PointCloud>& scans,
                          int robot,
                          int robots,
                          int count) {
  ClientOptions options;
  options.target = address;
  const auto db = Connect(options);
  Require(db.ok(), db.status().ToString());
  std::vector<double> ack_s;
  for (int i = robot; i < count; i += robots) {
    const PointCloud& cloud = scans[static_cast<std::size_t>(i) % scans.size()];
    ScanHeader header;
    header.id = {absl::StrCat("robot", robot), static_cast<std::uint64_t>(i)};
    header.T_map_scan.translation() << 5.0 * i, 0.0, 0.0;
    header.alignment = Alignment::kOff;
    header.point_count = cloud.size();
    const auto upload = (*db)->scans().Upload({}, kMap, header);
    Require(upload.ok(), upload.status().ToString());
    const absl::Status written = (*upload)->Write(cloud);
    Require(written.ok(), written.ToString());
    const Clock::time_point begun = Clock::now();
    const auto ack = (*upload)->Finish();
    Require(ack.ok() && !ack->already_present, ack.status().ToString());
    ack_s.push_back(SecondsSince(begun));
  }
  return ack_s;
}

void ReadPieces(const std::filesystem::path& file, Run& run) {
  sqlite3* database = nullptr;
  Require(sqlite3_open(file.c_str(), &database) == SQLITE_OK, "map file does not open");
  sqlite3_stmt* select = nullptr;
  sqlite3_prepare_v2(
      database, "SELECT bytes FROM truth_chunk ORDER BY rowid", -1, &select, nullptr);
  while (sqlite3_step(select) == SQLITE_ROW) {
    run.pieces.emplace_back(static_cast<const char*>(sqlite3_column_blob(select, 0)),
                            static_cast<std::size_t>(sqlite3_column_bytes(select, 0)));
    run.bytes += run.pieces.back().size();
  }
  sqlite3_finalize(select);
  sqlite3_close(database);
}

Run ThroughServer(const std::filesystem::path& folder,
                  const std::vector<PointCloud>& scans,
                  int robots,
                  int count,
                  bool held) {
  Run run;
  {
    EngineOptions options;
    options.directory = folder;
    const auto db = OpenEngine(options);
    Require(db.ok(), db.status().ToString());
    const auto made = (*db)->maps().Create({}, kMap, {});
    Require(made.ok(), made.status().ToString());
    server::ServerOptions server_options;
    server_options.listen = "127.0.0.1:0";
    const auto server = server::Server::Start(**db, server_options);
    Require(server.ok(), server.status().ToString());
    if (held) HoldIntegration();
    CommitLog::Instance().Take();
    std::vector<std::vector<double>> acks(static_cast<std::size_t>(robots));
    std::vector<std::thread> threads;
    const Clock::time_point begun = Clock::now();
    for (int robot = 0; robot < robots; ++robot) {
      threads.emplace_back([&, robot] {
        acks[static_cast<std::size_t>(robot)] =
            Drive((*server)->address(), scans, robot, robots, count);
      });
    }
    for (std::thread& thread : threads) thread.join();
    run.seconds = SecondsSince(begun);
    run.batches = CommitLog::Instance().Take();
    for (const auto& of_robot : acks) {
      run.ack_s.insert(run.ack_s.end(), of_robot.begin(), of_robot.end());
    }
  }
  ReadPieces(folder / absl::StrCat(kMap, ".strata"), run);
  std::sort(run.ack_s.begin(), run.ack_s.end());
  return run;
}

// Seconds that a program needs that only writes the pieces, in the same commits; with `scans` it
// makes them of these, and their hashes.
double Bare(const std::filesystem::path& file,
            const Run& run,
            const std::vector<PointCloud>* scans = nullptr) {
  sqlite3* database = nullptr;
  Require(sqlite3_open(file.c_str(), &database) == SQLITE_OK, "bare file does not open");
  const auto execute = [database](const char* sql) {
    Require(sqlite3_exec(database, sql, nullptr, nullptr, nullptr) == SQLITE_OK, sql);
  };
  execute("PRAGMA page_size = 8192");
  execute("PRAGMA journal_mode = WAL");
  execute("PRAGMA wal_autocheckpoint = 2000");
  execute("CREATE TABLE piece (id INTEGER PRIMARY KEY, bytes BLOB NOT NULL)");
  sqlite3_stmt* insert = nullptr;
  sqlite3_prepare_v2(database, "INSERT INTO piece (bytes) VALUES (?1)", -1, &insert, nullptr);
  std::size_t next = 0;
  const Clock::time_point begun = Clock::now();
  for (const Batch& batch : run.batches) {
    execute(batch.full ? "PRAGMA synchronous = FULL" : "PRAGMA synchronous = NORMAL");
    execute("BEGIN IMMEDIATE");
    for (int i = 0; i < batch.pieces; ++i, ++next) {
      std::string made;
      if (scans != nullptr) {
        const PointCloud& cloud = (*scans)[next % scans->size()];
        made = EncodePoints(cloud).value();
        Require(ContentHashOf({}, cloud).size() == 32, "hash");
      }
      const std::string& piece = scans == nullptr ? run.pieces[next] : made;
      sqlite3_bind_blob(insert, 1, piece.data(), static_cast<int>(piece.size()), SQLITE_STATIC);
      Require(sqlite3_step(insert) == SQLITE_DONE, "bare insert");
      sqlite3_reset(insert);
    }
    execute("COMMIT");
  }
  const double seconds = SecondsSince(begun);
  Require(next == run.pieces.size(), "the commits that were noted have other pieces");
  sqlite3_finalize(insert);
  sqlite3_close(database);
  return seconds;
}

double Quantile(const std::vector<double>& sorted, double q) {
  return sorted[static_cast<std::size_t>(q * static_cast<double>(sorted.size() - 1))];
}

double Median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

// One row of the table; the ratio.
double Measure(
    const std::vector<PointCloud>& scans, int robots, int count, int repeats, bool held) {
  std::vector<double> rates, bare_rates, encoded_rates, ratios, p50, p95, p99, scans_a_commit;
  for (int i = 0; i < repeats; ++i) {
    const testing::TempDir folder;
    const Run run = ThroughServer(folder.path() / "maps", scans, robots, count, held);
    const double bare_s = Bare(folder.path() / "bare.sqlite", run);
    const double encoded_s = Bare(folder.path() / "encoded.sqlite", run, &scans);
    const double megabytes = static_cast<double>(run.bytes) / 1e6;
    rates.push_back(megabytes / run.seconds);
    bare_rates.push_back(megabytes / bare_s);
    encoded_rates.push_back(megabytes / encoded_s);
    ratios.push_back(bare_s / run.seconds);
    p50.push_back(1e3 * Quantile(run.ack_s, 0.5));
    p95.push_back(1e3 * Quantile(run.ack_s, 0.95));
    p99.push_back(1e3 * Quantile(run.ack_s, 0.99));
    scans_a_commit.push_back(count / static_cast<double>(run.batches.size()));
  }
  const double ratio = Median(ratios);
  std::printf("%6d  %-8s %7.1f %7.1f %9.1f   %5.2f   %6.1f %6.1f %6.1f   %5.1f\n",
              robots,
              held ? "held" : "at work",
              Median(rates),
              Median(bare_rates),
              Median(encoded_rates),
              ratio,
              Median(p50),
              Median(p95),
              Median(p99),
              Median(scans_a_commit));
  std::fflush(stdout);
  return ratio;
}

int Main(int argc, char** argv) {
  const int count = argc > 1 ? std::atoi(argv[1]) : 450;
  const int repeats = argc > 2 ? std::atoi(argv[2]) : 3;
  const bool smoke = argc > 3;  // time is held against nothing
  FLAGS_minloglevel = google::GLOG_WARNING;
  google::InitGoogleLogging(argv[0]);
  CommitLog::Instance();
  const std::vector<PointCloud> scans = RecordedScans(static_cast<std::size_t>(count));
  std::printf("%d scans, medians of %d runs; MB are of encoded pieces\n", count, repeats);
  std::printf(
      "robots  integr.     MB/s    bare   encoded   ratio   ack p50    p95    p99 ms   scans a "
      "commit\n");
  bool reached = true;
  for (const int robots : {1, 8, 32}) {
    reached = Measure(scans, robots, count, repeats, true) >= kBound && reached;
    Measure(scans, robots, count, repeats, false);
  }
  return reached || smoke ? 0 : 1;
}

}  // namespace
}  // namespace strata

int main(int argc, char** argv) { return strata::Main(argc, argv); }
