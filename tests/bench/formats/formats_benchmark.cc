// Reading files of points beside PCL's readers, which fill a cloud of pcl::PointXYZ: processor
// time, in turns, medians of the ratios of one run. Files are in the system's cache. Ours read all
// columns, PCL's points have none but x, y and z.
//
//   formats_benchmark [--points 1000000] [--seed 1] [--rounds 12] [--data]
//
// Files are written by PCL from a drawn scan, or, with --data, those recorded. Ends with 1 where
// the two see different points.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <functional>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include <CLI/CLI.hpp>
#include <malloc.h>

#include "client/formats/scan_reader.h"
#include "tests/bench/formats/formats_peers.h"
#include "tests/support/data_dir.h"
#include "tests/support/temp_dir.h"

namespace strata::bench {
namespace {

namespace fs = std::filesystem;

// Of the whole process: others on the machine do not count.
double ProcessorMilliseconds() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) * 1e3 + static_cast<double>(t.tv_nsec) * 1e-6;
}

double Quantile(std::vector<double> values, double q) {
  std::sort(values.begin(), values.end());
  return values[std::min(values.size() - 1, static_cast<std::size_t>(q * values.size()))];
}

// ---- what is read ----

// 64 rings of a sensor in a hilly place, row by row, ranges noisy by 1 cm.
PointCloud DrawScan(std::size_t points, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<float> noise_m(0.0F, 0.01F);
  PointCloud cloud;
  for (std::size_t i = 0; i < points; ++i) {
    const float ring = static_cast<float>(i * 64 / points);
    const float turn = std::fmod(64.0F * static_cast<float>(i) / static_cast<float>(points), 1.0F);
    const float azimuth = 2.0F * std::numbers::pi_v<float> * turn;
    const float elevation = -0.4F + 0.01F * ring;
    const float range = 20.0F + 8.0F * std::sin(5.0F * azimuth) + 0.2F * ring + noise_m(random);
    cloud.points.emplace_back(range * std::cos(azimuth) * std::cos(elevation),
                              range * std::sin(azimuth) * std::cos(elevation),
                              range * std::sin(elevation));
  }
  return cloud;
}

PointCloud WithIntensity(PointCloud cloud) {
  for (const Eigen::Vector3f& p : cloud.points) cloud.intensity.push_back(std::round(p.norm()));
  return cloud;
}

PointCloud WithColour(PointCloud cloud) {
  for (const Eigen::Vector3f& p : cloud.points) {
    const auto shade = static_cast<std::uint8_t>(std::clamp(4.0F * p.norm(), 0.0F, 255.0F));
    cloud.colour.push_back({shade, static_cast<std::uint8_t>(shade / 2), 255});
  }
  return cloud;
}

struct Row {
  std::string name;
  std::vector<fs::path> files;
};

std::vector<Row> DrawnFiles(std::size_t points, std::uint64_t seed, const fs::path& folder) {
  struct NamedKind {
    const char* name;
    FileKind kind;
    const char* ending;
  };
  constexpr NamedKind kKinds[] = {{"binary PCD", FileKind::kBinaryPcd, ".pcd"},
                                  {"compressed PCD", FileKind::kCompressedPcd, ".pcd"},
                                  {"ASCII PCD", FileKind::kAsciiPcd, ".pcd"},
                                  {"binary PLY", FileKind::kBinaryPly, ".ply"}};
  const PointCloud plain = DrawScan(points, seed);
  const std::pair<std::string, PointCloud> clouds[] = {{"x y z", plain},
                                                       {"x y z intensity", WithIntensity(plain)},
                                                       {"x y z rgb", WithColour(plain)}};
  std::vector<Row> rows;
  for (const auto& [name, kind, ending] : kKinds) {
    for (const auto& [fields, cloud] : clouds) {
      const fs::path path = folder / (std::to_string(rows.size()) + ending);
      if (!WriteWithPcl(cloud, kind, path)) {
        std::fprintf(stderr, "%s: PCL does not write it\n", path.c_str());
        std::exit(1);
      }
      rows.push_back({std::string(name) + ", " + fields, {path}});
    }
  }
  return rows;
}

// Sets that both can read: floats, in PCD or PLY.
std::vector<Row> RecordedFiles() {
  std::vector<Row> rows;
  for (const char* folder : {"nclt_campus_loop/scans",
                             "hall_livox_loop/scans",
                             "eth_facade_tls/scans",
                             "kitti_city_drive/scans",
                             "isprs_als_filter",
                             "nclt_keyframes",
                             "registration_pairs/small_gicp",
                             "lille_facade"}) {
    const auto path = testing::FindData(folder);
    if (!path.has_value()) continue;
    Row row{folder, {}};
    for (const auto& entry : fs::directory_iterator(*path)) {
      const fs::path ending = entry.path().extension();
      if (ending == ".pcd" || ending == ".ply") row.files.push_back(entry.path());
    }
    std::sort(row.files.begin(), row.files.end());
    row.files.resize(std::min<std::size_t>(row.files.size(), 30));
    if (!row.files.empty()) rows.push_back(std::move(row));
  }
  return rows;
}

// ---- reading ----

struct Reading {
  double ours_ms = 0.0, peer_ms = 0.0;
  std::size_t points = 0;
  double difference_m = 0.0;  // largest; infinite if the numbers of points differ
};

double LargestDifference(const PointCloud& ours, const std::vector<Eigen::Vector3f>& peer) {
  std::size_t k = 0;
  double largest_m = 0.0;
  for (const Eigen::Vector3f& point : ours.points) {
    if (!point.allFinite()) continue;
    if (k == peer.size()) return std::numeric_limits<double>::infinity();
    const Eigen::Vector3d in_file = ours.origin + point.cast<double>();
    largest_m = std::max(largest_m, (in_file - peer[k++].cast<double>()).norm());
  }
  return k == peer.size() ? largest_m : std::numeric_limits<double>::infinity();
}

// Processor time; memory that another reading has given back is the system's again, and no gift.
double MillisecondsOf(const std::function<void()>& read) {
  malloc_trim(0);
  const double start_ms = ProcessorMilliseconds();
  read();
  return ProcessorMilliseconds() - start_ms;
}

// One after the other, PCL's first if asked for.
Reading ReadBoth(const fs::path& file, bool peer_first, bool compare) {
  Reading reading;
  PclCloud peer;
  bool peer_read = false;
  absl::StatusOr<PointCloud> cloud;
  const auto read_peer = [&] {
    reading.peer_ms = MillisecondsOf([&] { peer_read = peer.Read(file); });
  };
  if (peer_first) read_peer();
  reading.ours_ms = MillisecondsOf([&] { cloud = ReadScan(file); });
  if (!peer_first) read_peer();
  if (!cloud.ok() || !peer_read) {
    std::fprintf(stderr, "%s: %s\n", file.c_str(), cloud.status().ToString().c_str());
    std::exit(1);
  }
  reading.points = cloud->size();
  if (compare) reading.difference_m = LargestDifference(*cloud, peer.FinitePoints());
  return reading;
}

// False where the two see different points.
bool Measure(const Row& row, int rounds) {
  std::vector<double> ours_ms, peer_ms, ratios;
  std::size_t points = 0;
  double difference_m = 0.0;
  for (int round = 0; round < rounds; ++round) {
    for (const fs::path& file : row.files) {
      const Reading reading = ReadBoth(file, round % 2 == 1, round == 0);
      ours_ms.push_back(reading.ours_ms);
      peer_ms.push_back(reading.peer_ms);
      ratios.push_back(reading.ours_ms / reading.peer_ms);
      difference_m = std::max(difference_m, reading.difference_m);
      if (round == 0) points += reading.points;
    }
  }
  std::printf("%-32s %9zu %9.2f %9.2f %7.2f %5.2f–%.2f  %g\n",
              row.name.c_str(),
              points / row.files.size(),
              Quantile(ours_ms, 0.5),
              Quantile(peer_ms, 0.5),
              Quantile(ratios, 0.5),
              Quantile(ratios, 0.25),
              Quantile(ratios, 0.75),
              difference_m);
  std::fflush(stdout);
  return difference_m < 1e-4;
}

int Main(int argc, char** argv) {
  CLI::App app("reading files of points beside PCL");
  std::size_t points = 1'000'000;
  std::uint64_t seed = 1;
  int rounds = 12;
  bool data = false;
  app.add_option("--points", points, "of the drawn scan")->check(CLI::PositiveNumber);
  app.add_option("--seed", seed, "of the drawn scan");
  app.add_option("--rounds", rounds, "of each file")->check(CLI::PositiveNumber);
  app.add_flag("--data", data, "recorded files in place of drawn ones");
  CLI11_PARSE(app, argc, argv);

  const testing::TempDir folder;
  const std::vector<Row> rows = data ? RecordedFiles() : DrawnFiles(points, seed, folder.path());
  if (!data) std::printf("seed %llu\n", static_cast<unsigned long long>(seed));
  std::printf("%-32s %9s %9s %9s %7s %10s  %s\n",
              "",
              "points",
              "ours ms",
              "PCL ms",
              "ratio",
              "quartiles",
              "differ by m");
  bool alike = true;
  for (const Row& row : rows) alike = Measure(row, rounds) && alike;
  return alike ? 0 : 1;
}

}  // namespace
}  // namespace strata::bench

int main(int argc, char** argv) { return strata::bench::Main(argc, argv); }
