// Scan → local MLS map, and scan → global tiles, beside OctoMap 1.9.7 (Debian's default build) on
// the same recorded scans, in one process, one thread, processor time, medians over rounds.
//
//   mls_benchmark [ROUNDS=5] [RAY_CAST_SCANS=3]
//
// OctoMap "end points" is one lazy updateNode() a point into a fresh tree a scan, without the final
// pass over inner nodes; "ray casting" is insertPointCloud(). Both keep occupancy only.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include <malloc.h>
#include <octomap/octomap.h>
#include <time.h>

#include "core/cloud/point_cloud.h"
#include "core/geometry/pose.h"
#include "core/mls/build.h"
#include "core/mls/join.h"
#include "core/mls/mls_map.h"
#include "tests/support/data_dir.h"

namespace strata {
namespace {

constexpr double kCellSizeM = 0.1;

struct Scans {
  std::string name;
  std::vector<PointCloud> clouds;
  std::vector<octomap::Pointcloud> octomap_clouds;
  std::vector<Pose> T_map_scan;
  std::size_t points = 0;
};

// Processor time of this thread: a busy machine disturbs it least.
double Now() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double Median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values.empty() ? 0.0 : values[values.size() / 2];
}

// Binary PCD whose first three fields are float x y z and whose fields are all 4 bytes.
PointCloud ReadBinaryPcd(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::size_t fields = 0;
  std::size_t points = 0;
  for (std::string line; std::getline(file, line) && line.rfind("DATA", 0) != 0;) {
    std::istringstream words(line);
    std::string word;
    words >> word;
    if (word == "FIELDS") {
      while (words >> word) ++fields;
    } else if (word == "POINTS") {
      words >> points;
    }
  }
  std::vector<float> values(fields * points);
  file.read(reinterpret_cast<char*>(values.data()),
            static_cast<std::streamsize>(values.size() * sizeof(float)));
  PointCloud cloud;
  if (!file) return cloud;
  for (std::size_t i = 0; i < points; ++i) {
    const float* p = &values[i * fields];
    cloud.points.emplace_back(p[0], p[1], p[2]);
  }
  return cloud;
}

// "index time x y z qx qy qz qw"
std::map<int, Pose> ReadPoses(const std::filesystem::path& path) {
  std::map<int, Pose> poses;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    int index = 0;
    double time = 0;
    Eigen::Vector3d t;
    Eigen::Quaterniond q;
    std::istringstream words(line);
    if (words >> index >> time >> t.x() >> t.y() >> t.z() >> q.x() >> q.y() >> q.z() >> q.w()) {
      poses[index] = MakePose(q, t);
    }
  }
  return poses;
}

std::optional<Scans> Load(const std::string& folder, const std::string& pose_file) {
  const auto path = testing::FindData(folder);
  if (!path.has_value()) return std::nullopt;
  const std::map<int, Pose> poses = ReadPoses(*path / pose_file);
  std::map<int, std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(*path / "scans")) {
    const std::string stem = entry.path().stem().string();
    files[std::atoi(stem.c_str() + stem.find_first_of("0123456789"))] = entry.path();
  }
  Scans scans;
  scans.name = folder;
  for (const auto& [index, file] : files) {
    const auto pose = poses.find(index);
    if (pose == poses.end()) continue;
    PointCloud cloud = ReadBinaryPcd(file);
    octomap::Pointcloud octomap_cloud;
    for (const auto& p : cloud.points) octomap_cloud.push_back(p.x(), p.y(), p.z());
    scans.points += cloud.size();
    scans.clouds.push_back(std::move(cloud));
    scans.octomap_clouds.push_back(std::move(octomap_cloud));
    scans.T_map_scan.push_back(pose->second);
  }
  return scans;
}

struct LocalRun {
  double seconds = 0;
  std::size_t patches = 0, bytes = 0;
};

LocalRun BuildLocalMaps(const Scans& scans, MlsScratch& scratch) {
  LocalRun run;
  for (const PointCloud& cloud : scans.clouds) {
    const double start = Now();
    const auto result =
        BuildMlsMap(cloud, Pose::Identity(), {}, {.cell_size_m = kCellSizeM}, scratch);
    run.seconds += Now() - start;
    run.patches += result->map.patch_count();
    run.bytes += result->map.memory_bytes();
  }
  return run;
}

double BuildGlobalMap(const Scans& scans, MlsScratch& scratch, MlsMap& map) {
  map = MlsMap{.parameters = {.cell_size_m = kCellSizeM}, .tiles = {}};
  const double start = Now();
  for (std::size_t i = 0; i < scans.clouds.size(); ++i) {
    JoinInto(map,
             BuildMlsMap(scans.clouds[i], scans.T_map_scan[i], {}, map.parameters, scratch)->map);
  }
  return Now() - start;
}

double OctomapEndPoints(const Scans& scans) {
  double seconds = 0;
  for (const octomap::Pointcloud& cloud : scans.octomap_clouds) {
    octomap::OcTree tree(kCellSizeM);
    const double start = Now();
    for (const octomap::point3d& p : cloud) tree.updateNode(p, true, /*lazy_eval=*/true);
    seconds += Now() - start;
  }
  return seconds;
}

double OctomapRayCastPointsPerSecond(const Scans& scans, std::size_t count) {
  std::vector<double> rates;
  for (std::size_t i = 0; i < count && i < scans.clouds.size(); ++i) {
    const octomap::Pointcloud& cloud = scans.octomap_clouds[i * scans.clouds.size() / count];
    octomap::OcTree tree(kCellSizeM);
    const double start = Now();
    tree.insertPointCloud(cloud, octomap::point3d(0, 0, 0), -1, /*lazy_eval=*/true);
    rates.push_back(static_cast<double>(cloud.size()) / (Now() - start));
  }
  return Median(rates);
}

void Report(const Scans& scans, int rounds, std::size_t ray_cast_scans) {
  MlsScratch scratch;
  std::vector<double> local, global, end_points, local_ratio, global_ratio;
  LocalRun run;
  MlsMap map;
  const double points = static_cast<double>(scans.points);
  for (int round = 0; round < rounds; ++round) {
    // Puts together what a peer's trees were made of; otherwise whoever allocates next pays for it.
    malloc_trim(0);
    run = BuildLocalMaps(scans, scratch);
    const double global_seconds = BuildGlobalMap(scans, scratch, map);
    malloc_trim(0);
    const double octomap_seconds = OctomapEndPoints(scans);
    local.push_back(points / run.seconds * 1e-6);
    global.push_back(points / global_seconds * 1e-6);
    end_points.push_back(points / octomap_seconds * 1e-6);
    local_ratio.push_back(octomap_seconds / run.seconds);
    global_ratio.push_back(octomap_seconds / global_seconds);
  }
  const double ray_casting = OctomapRayCastPointsPerSecond(scans, ray_cast_scans) * 1e-6;
  std::printf("%s: %zu scans, %zu points, cells of %.2f m, median of %d rounds\n",
              scans.name.c_str(),
              scans.clouds.size(),
              scans.points,
              kCellSizeM,
              rounds);
  std::printf("  scan → local map            %8.2f Mpts/s\n", Median(local));
  std::printf("  OctoMap end points          %8.2f Mpts/s   ratio %.1f (target 10)\n",
              Median(end_points),
              Median(local_ratio));
  if (ray_casting > 0) {
    std::printf("  OctoMap ray casting         %8.4f Mpts/s   ratio %.0f (target 1500)\n",
                ray_casting,
                Median(local) / ray_casting);
  }
  std::printf("  scan → global tiles         %8.2f Mpts/s   ratio %.2f (target 1.5)\n",
              Median(global),
              Median(global_ratio));
  std::printf(
      "  local maps: %zu patches, %.2f bytes a patch with index and statistics (bound 36)\n",
      run.patches,
      static_cast<double>(run.bytes) / static_cast<double>(run.patches));
  std::printf("  global map: %zu patches, %zu tiles, %.2f bytes a patch\n\n",
              map.patch_count(),
              map.tiles.size(),
              static_cast<double>(map.memory_bytes()) / static_cast<double>(map.patch_count()));
}

}  // namespace
}  // namespace strata

int main(int argc, char** argv) {
  const int rounds = argc > 1 ? std::atoi(argv[1]) : 5;
  const int ray_cast_scans = argc > 2 ? std::atoi(argv[2]) : 3;
  int found = 0;
  for (const auto& [folder, poses] : {std::pair("nclt_campus_loop", "poses_reference.txt"),
                                      std::pair("kitti_city_drive", "poses_reference_icp.txt")}) {
    const auto scans = strata::Load(folder, poses);
    if (!scans.has_value() || scans->points == 0) continue;
    strata::Report(
        *scans, std::max(rounds, 1), static_cast<std::size_t>(std::max(ray_cast_scans, 0)));
    ++found;
  }
  if (found == 0) std::printf("no recorded data: set STRATA_DATA\n");
  return 0;
}
