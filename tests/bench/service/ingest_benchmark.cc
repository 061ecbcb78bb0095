// How fast the scans of one map are integrated, with one thread and with more.
//
//   ingest_benchmark [--scans 226] [--robots 1,8] [--threads 1,2] [--repeats 3]
//
// A recorded drive is uploaded to an engine in this process, by one robot or by several that each
// drive a stretch of it, as fast as it takes them; the clock runs until the last scan is in the
// map. Runs of different numbers of threads follow each other in turn. Prints scans a second, the
// processors that were busy, and the digests of tiles and poses, which may not depend on threads:
// exits 1 where they do. Nothing else should run on the machine.
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include <CLI/CLI.hpp>
#include <glog/logging.h>
#include <sys/resource.h>

#include "core/common/checksum.h"
#include "core/engine/engine.h"
#include "tests/support/data_dir.h"
#include "tests/support/pcd.h"
#include "tests/support/temp_dir.h"

namespace strata {
namespace {

constexpr char kMap[] = "world";
constexpr char kDrive[] = "nclt_campus_loop";
using Clock = std::chrono::steady_clock;

void Require(bool good, const std::string& what) {
  if (good) return;
  std::fprintf(stderr, "ingest_benchmark: %s\n", what.c_str());
  std::exit(1);
}

struct DrivenScan {
  PointCloud cloud;
  Pose T_map_scan = Pose::Identity();
};

std::vector<DrivenScan> RecordedDrive(std::size_t most) {
  const auto folder = testing::FindData(kDrive);
  Require(folder.has_value(), "no recorded data: set STRATA_DATA");
  const auto poses = testing::ReadIndexedPoses(*folder / "poses_initial.txt");
  Require(poses.ok(), poses.status().ToString());
  std::vector<DrivenScan> drive;
  for (const auto& [index, path] : testing::ListScans(*folder / "scans")) {
    if (drive.size() == most) break;
    auto cloud = testing::ReadBinaryPcd(path);
    Require(cloud.ok(), cloud.status().ToString());
    drive.push_back({*std::move(cloud), poses->at(index).T_world_scan});
  }
  return drive;
}

void Upload(api::Database& db, const DrivenScan& scan, int robot, std::size_t sequence) {
  ScanHeader header;
  header.id = {absl::StrCat("robot", robot), sequence};
  header.T_map_scan = scan.T_map_scan;
  header.point_count = scan.cloud.size();
  header.has_colour = !scan.cloud.colour.empty();
  const auto upload = db.scans().Upload({}, kMap, header);
  Require(upload.ok(), upload.status().ToString());
  const absl::Status written = (*upload)->Write(scan.cloud);
  Require(written.ok() && (*upload)->Finish().ok(), "upload");
}

// In the order in which the robots are on their way at once: scans are integrated in that of their
// acknowledgements, and the digest depends on it.
void UploadAll(api::Database& db, const std::vector<DrivenScan>& drive, int robots) {
  const std::size_t stretch = (drive.size() + robots - 1) / robots;
  for (std::size_t i = 0; i < stretch; ++i) {
    for (int robot = 0; robot < robots; ++robot) {
      const std::size_t at = robot * stretch + i;
      if (at < drive.size()) Upload(db, drive[at], robot, i);
    }
  }
}

std::string AwaitIntegration(api::Database& db) {
  while (true) {
    const auto stats = db.maps().Stats({}, kMap);
    Require(stats.ok() && stats->scans_failed == 0, "a scan is not integrated");
    if (stats->scans_pending == 0) return stats->content_digest;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

std::string DigestOfPoses(api::Database& db) {
  const auto graph = db.posegraph().Get({}, kMap);
  Require(graph.ok(), graph.status().ToString());
  ContentHasher hasher;
  const auto add = [&hasher](const auto& matrix) {
    hasher.Add({reinterpret_cast<const char*>(matrix.data()), sizeof(matrix)});
  };
  for (const PoseNode& node : graph->nodes) add(node.T_map_scan.matrix());
  return hasher.HexDigest();
}

double ProcessorSeconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) { return t.tv_sec + 1e-6 * t.tv_usec; };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

struct Run {
  double seconds = 0.0;
  double processor_s = 0.0;
  std::string digest;
};

Run Ingest(const std::vector<DrivenScan>& drive, int robots, int threads) {
  const testing::TempDir folder;
  EngineOptions options;
  options.directory = folder.path();
  options.worker_threads = threads;
  const auto db = OpenEngine(options);
  Require(db.ok(), db.status().ToString());
  MapParameters parameters;
  parameters.mls.cell_size_m = 0.1;
  Require((*db)->maps().Create({}, kMap, parameters).ok(), "no map");
  Run run;
  const double processor_s = ProcessorSeconds();
  const Clock::time_point begun = Clock::now();
  UploadAll(**db, drive, robots);
  run.digest = AwaitIntegration(**db);
  run.seconds = std::chrono::duration<double>(Clock::now() - begun).count();
  run.processor_s = ProcessorSeconds() - processor_s;
  run.digest = absl::StrCat(run.digest, " ", DigestOfPoses(**db));
  return run;
}

double Median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

// Whether all runs of as many robots gave the same map.
bool Measure(const std::vector<DrivenScan>& drive,
             int robots,
             const std::vector<int>& threads,
             int repeats) {
  std::map<int, std::vector<Run>> runs;
  for (int i = 0; i < repeats; ++i) {
    for (const int n : threads) runs[n].push_back(Ingest(drive, robots, n));
  }
  const std::string& digest = runs.begin()->second.front().digest;
  bool same = true;
  for (const auto& [n, of_threads] : runs) {
    std::vector<double> rates, busy, processor_ms;
    for (const Run& run : of_threads) {
      rates.push_back(static_cast<double>(drive.size()) / run.seconds);
      busy.push_back(run.processor_s / run.seconds);
      processor_ms.push_back(1e3 * run.processor_s / static_cast<double>(drive.size()));
      same = same && run.digest == digest;
    }
    std::printf("%6d %7d %9.1f %6.2f %12.1f   %s\n",
                robots,
                n,
                Median(rates),
                Median(busy),
                Median(processor_ms),
                of_threads.front().digest.c_str());
    std::fflush(stdout);
  }
  if (!same) std::printf("FAILS: the map depends on the number of threads\n");
  return same;
}

int Main(int argc, char** argv) {
  CLI::App app("scans integrated a second");
  std::size_t scans = 226;
  std::vector<int> robots = {1, 8};
  std::vector<int> threads = {1, 2};
  int repeats = 3;
  app.add_option("--scans", scans, "of the drive, at most");
  app.add_option("--robots", robots, "that drive it")->delimiter(',');
  app.add_option("--threads", threads, "of the engine")->delimiter(',');
  app.add_option("--repeats", repeats, "runs, of which the median counts")
      ->check(CLI::Range(1, 99));
  CLI11_PARSE(app, argc, argv);
  FLAGS_minloglevel = google::GLOG_WARNING;
  google::InitGoogleLogging(argv[0]);
  const std::vector<DrivenScan> drive = RecordedDrive(scans);
  std::printf("%zu scans, medians of %d runs\n", drive.size(), repeats);
  std::printf(
      "robots threads   scans/s   busy   processor ms a scan   digests of tiles and poses\n");
  bool same = true;
  for (const int n : robots) same = Measure(drive, n, threads, repeats) && same;
  return same ? 0 : 1;
}

}  // namespace
}  // namespace strata

int main(int argc, char** argv) { return strata::Main(argc, argv); }
