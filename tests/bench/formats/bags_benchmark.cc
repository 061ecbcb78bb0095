// Reading the clouds of recordings beside reading the same clouds as binary PCD files, which is
// what formats_benchmark sets beside PCL: processor time of one thread, medians of the ratios of
// one run, in turns. Files are in the system's cache. Of a recording all is read twice, as an
// import does: once for topics, stamps and poses, once for the points.
//
//   bags_benchmark [--clouds 20] [--points 130000] [--seed 1] [--rounds 12]
//
// Ends with 1 where a recording gives other points than the files.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include <CLI/CLI.hpp>

#include "client/formats/bags/bag_scans.h"
#include "client/formats/file_bytes.h"
#include "client/formats/scan_list.h"
#include "client/formats/scan_reader.h"
#include "tests/support/bag_writer.h"
#include "tests/support/temp_dir.h"

namespace strata::bench {
namespace {

namespace fs = std::filesystem;
using testing::BagEntry;
using testing::Layout;

double ThreadMilliseconds() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) * 1e3 + static_cast<double>(t.tv_nsec) * 1e-6;
}

double Median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

std::vector<Eigen::Vector4f> DrawPoints(std::size_t points, std::mt19937_64& random) {
  std::uniform_real_distribution<float> metres(-50.0F, 50.0F);
  std::vector<Eigen::Vector4f> drawn(points);
  for (Eigen::Vector4f& p : drawn) {
    for (float& value : p) value = metres(random);
  }
  return drawn;
}

std::string PcdOf(const std::vector<Eigen::Vector4f>& points) {
  std::string file =
      absl::StrCat("VERSION 0.7\nFIELDS x y z intensity\nSIZE 4 4 4 4\nTYPE F F F F\n",
                   "WIDTH ",
                   points.size(),
                   "\nHEIGHT 1\nDATA binary\n");
  const std::size_t head = file.size();
  file.resize(head + 16 * points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    std::memcpy(file.data() + head + 16 * i, points[i].data(), 16);
  }
  return file;
}

struct Written {
  std::vector<fs::path> pcds;
  std::vector<std::pair<std::string, fs::path>> bags;  // with what they are
};

void Write(const fs::path& path, const std::string& bytes) {
  const absl::Status written = WriteFileBytes(path, bytes);
  if (written.ok()) return;
  std::fprintf(stderr, "%s\n", std::string(written.message()).c_str());
  std::exit(1);
}

Written WriteAll(std::size_t clouds, std::size_t points, std::uint64_t seed, const fs::path& dir) {
  std::mt19937_64 random(seed);
  Written written;
  std::vector<BagEntry> ros2;
  std::vector<BagEntry> ros1;
  for (std::size_t i = 0; i < clouds; ++i) {
    const std::vector<Eigen::Vector4f> drawn = DrawPoints(points, random);
    written.pcds.push_back(dir / absl::StrFormat("%04d.pcd", i));
    Write(written.pcds.back(), PcdOf(drawn));
    const auto t = static_cast<std::int64_t>(i) * 100'000'000;
    ros2.push_back({"/odom",
                    "nav_msgs/msg/Odometry",
                    t,
                    testing::OdometryMessage(Layout::kCdr, t, "odom", "lidar", Pose::Identity())});
    ros1.push_back({"/odom",
                    "nav_msgs/Odometry",
                    t,
                    testing::OdometryMessage(Layout::kRos1, t, "odom", "lidar", Pose::Identity())});
    ros2.push_back({"/points",
                    "sensor_msgs/msg/PointCloud2",
                    t,
                    testing::CloudMessage(Layout::kCdr, t, "lidar", drawn)});
    ros1.push_back({"/points",
                    "sensor_msgs/PointCloud2",
                    t,
                    testing::CloudMessage(Layout::kRos1, t, "lidar", drawn)});
  }
  const auto add = [&](const std::string& name, const std::string& file, const std::string& bytes) {
    Write(dir / file, bytes);
    written.bags.emplace_back(name, dir / file);
  };
  add("MCAP", "a.mcap", testing::McapBytes(ros2));
  add("MCAP, no chunks", "b.mcap", testing::McapBytes(ros2, {.chunks = false}));
  add("MCAP, lz4", "c.mcap", testing::McapBytes(ros2, {.compression = "lz4"}));
  add("MCAP, zstd", "d.mcap", testing::McapBytes(ros2, {.compression = "zstd"}));
  add("ROS 1", "e.bag", testing::Ros1BagBytes(ros1));
  add("ROS 1, lz4", "f.bag", testing::Ros1BagBytes(ros1, "lz4"));
  add("ROS 1, bz2", "g.bag", testing::Ros1BagBytes(ros1, "bz2"));
  if (!testing::WriteDb3(dir / "h.db3", ros2)) std::exit(1);
  written.bags.emplace_back("SQLite", dir / "h.db3");
  return written;
}

std::vector<PointCloud> ReadFiles(const std::vector<fs::path>& files) {
  std::vector<PointCloud> clouds;
  for (const fs::path& file : files) {
    absl::StatusOr<PointCloud> cloud = ReadScan(file);
    if (cloud.ok()) clouds.push_back(*std::move(cloud));
  }
  return clouds;
}

std::vector<PointCloud> ReadBag(const fs::path& file) {
  BagScanOptions options;
  options.every.distance_m = 0.0;
  const auto scans = ListBagScans({file}, options);
  std::vector<PointCloud> clouds;
  if (!scans.ok()) std::fprintf(stderr, "%s\n", std::string(scans.status().message()).c_str());
  if (!scans.ok()) return clouds;
  for (const ScanFile& scan : *scans) {
    absl::StatusOr<PointCloud> cloud = ReadScanFile(scan);
    if (cloud.ok()) clouds.push_back(*std::move(cloud));
  }
  return clouds;
}

bool AreSame(const std::vector<PointCloud>& a, const std::vector<PointCloud>& b) {
  return std::equal(
      a.begin(), a.end(), b.begin(), b.end(), [](const PointCloud& one, const PointCloud& other) {
        return one.points == other.points && one.intensity == other.intensity;
      });
}

// False where the bag gives other points.
bool Measure(const std::string& name, const fs::path& bag, const Written& written, int rounds) {
  std::vector<double> bag_ms, files_ms, ratios;
  std::size_t points = 0;
  bool same = true;
  for (int round = 0; round < rounds; ++round) {
    const double start_ms = ThreadMilliseconds();
    const std::vector<PointCloud> of_files = ReadFiles(written.pcds);
    const double middle_ms = ThreadMilliseconds();
    const std::vector<PointCloud> of_bag = ReadBag(bag);
    const double end_ms = ThreadMilliseconds();
    files_ms.push_back(middle_ms - start_ms);
    bag_ms.push_back(end_ms - middle_ms);
    ratios.push_back(bag_ms.back() / files_ms.back());
    same = same && AreSame(of_files, of_bag) && of_bag.size() == written.pcds.size();
    points = 0;
    for (const PointCloud& cloud : of_bag) points += cloud.size();
  }
  std::printf("%-16s %9zu %9.2f %9.2f %7.2f %12.1f  %s\n",
              name.c_str(),
              points,
              Median(bag_ms),
              Median(files_ms),
              Median(ratios),
              static_cast<double>(points) / Median(bag_ms) * 1e-3,
              same ? "same points" : "OTHER POINTS");
  std::fflush(stdout);
  return same;
}

int Main(int argc, char** argv) {
  CLI::App app("reading the clouds of recordings beside PCD files");
  std::size_t clouds = 20;
  std::size_t points = 130'000;
  std::uint64_t seed = 1;
  int rounds = 12;
  app.add_option("--clouds", clouds, "of the recording")->check(CLI::PositiveNumber);
  app.add_option("--points", points, "of a cloud")->check(CLI::PositiveNumber);
  app.add_option("--seed", seed, "of the points");
  app.add_option("--rounds", rounds, "of each form")->check(CLI::PositiveNumber);
  CLI11_PARSE(app, argc, argv);

  const testing::TempDir folder;
  const Written written = WriteAll(clouds, points, seed, folder.path());
  std::printf("seed %llu\n", static_cast<unsigned long long>(seed));
  std::printf(
      "%-16s %9s %9s %9s %7s %12s\n", "", "points", "bag ms", "PCD ms", "ratio", "M points/s");
  bool same = true;
  for (const auto& [name, bag] : written.bags) same = Measure(name, bag, written, rounds) && same;
  return same ? 0 : 1;
}

}  // namespace
}  // namespace strata::bench

int main(int argc, char** argv) { return strata::bench::Main(argc, argv); }
