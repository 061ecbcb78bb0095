#include "tests/core/codec/tile_samples.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <random>
#include <sstream>
#include <string>
#include <tuple>
#include <vector>

#include "absl/strings/str_format.h"
#include <Eigen/Geometry>

#include "core/cloud/sensor_model.h"
#include "core/geometry/pose.h"
#include "core/mls/patch.h"

namespace strata::testing {
namespace {

struct Measurement {
  TileKey key;
  std::uint16_t cell;
  std::int32_t z_ticks;
  std::uint8_t sigma_code;
  auto order() const { return std::tie(key, cell, z_ticks, sigma_code); }
};

MlsMap JoinAll(std::vector<Measurement> measurements, const MlsParameters& parameters) {
  std::sort(measurements.begin(), measurements.end(), [](const auto& a, const auto& b) {
    return a.order() < b.order();
  });
  MlsMap map{.parameters = parameters, .tiles = {}};
  for (const Measurement& m : measurements) {
    if (map.tiles.empty() || map.tiles.back().key != m.key) map.tiles.emplace_back().key = m.key;
    std::vector<Patch>& patches = map.tiles.back().patches;
    const Patch patch = PatchOfMeasurement(m.cell, m.z_ticks, m.sigma_code);
    if (!patches.empty() && patches.back().cell == m.cell &&
        Touching(patches.back(), patch, parameters)) {
      patches.back() = Join(patches.back(), patch, parameters);
    } else {
      patches.push_back(patch);
    }
  }
  for (MlsTile& tile : map.tiles) tile.IndexRows();
  return map;
}

std::map<int, Pose> ReadPoses(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::map<int, Pose> poses;
  for (std::string line; std::getline(in, line);) {
    std::istringstream fields(line);
    int index = 0;
    double t = 0, x = 0, y = 0, z = 0, qx = 0, qy = 0, qz = 0, qw = 1;
    if (fields >> index >> t >> x >> y >> z >> qx >> qy >> qz >> qw) {
      poses[index] = MakePose(Eigen::Quaterniond(qw, qx, qy, qz).normalized(), {x, y, z});
    }
  }
  return poses;
}

}  // namespace

MlsTile RandomTile(std::uint64_t seed, int patches, bool with_layers) {
  std::mt19937_64 random(seed);
  const auto below = [&random](std::uint64_t n) { return random() % n; };
  const MlsParameters parameters;
  std::vector<Measurement> measurements;
  for (int i = 0; i < patches; ++i) {
    const auto cell = static_cast<std::uint16_t>(below(65536));
    const auto z = static_cast<std::int32_t>(below(20'000)) - 10'000;
    const int count = static_cast<int>(1 + below(1 + below(12)));
    const std::uint64_t thickness = below(4) == 0 ? 3000 : 300;
    for (int k = 0; k < count; ++k) {
      const auto height = z + static_cast<std::int32_t>(below(thickness));
      measurements.push_back({{}, cell, height, static_cast<std::uint8_t>(below(256))});
    }
  }
  MlsMap map = JoinAll(measurements, parameters);
  MlsTile tile = map.tiles.empty() ? MlsTile() : map.tiles[0];
  const std::uint64_t full = MaxWeightSum(parameters.thickness_ticks());
  for (Patch& patch : tile.patches) {
    if (seed % 2 == 0) patch.sides = below(4);
    if (below(20) != 0 || patch.vertical()) continue;
    patch.sum_w = full;  // as after very many measurements
    patch.sum_wz = 0;
    patch.sum_wzz = 0;
    patch.count = Patch::kMaxCount;
  }
  if (!with_layers) return tile;
  for (std::uint32_t i = 0; i < tile.patches.size(); ++i) {
    const std::uint64_t count = tile.patches[i].count;
    tile.colour.push_back({below(255 * count), below(255 * count), random(), below(count + 1)});
    for (std::uint16_t c = 1; c < 60000 && below(3) == 0; c = c * 3 + below(5)) {
      tile.votes.push_back({i, c, static_cast<std::uint32_t>(1 + below(count))});
    }
  }
  return tile;
}

std::vector<Eigen::Vector3f> ReadPlainPcd(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  const std::size_t data = bytes.find('\n', bytes.find("DATA binary")) + 1;
  std::vector<Eigen::Vector3f> points((bytes.size() - data) / sizeof(Eigen::Vector3f));
  for (std::size_t i = 0; i < points.size(); ++i) {
    std::memcpy(points[i].data(), bytes.data() + data + i * 12, 12);
  }
  return points;
}

namespace {

// Calls visit(p_map, range) for every point of the scans whose index is a multiple of `stride`.
template <typename Visit>
void ForEachNcltPoint(const std::filesystem::path& folder, int stride, Visit visit) {
  for (const auto& [index, T_map_scan] : ReadPoses(folder / "poses_reference.txt")) {
    const std::filesystem::path file = folder / "scans" / absl::StrFormat("s%03d.pcd", index);
    if (index % stride != 0 || !std::filesystem::exists(file)) continue;
    for (const Eigen::Vector3f& p_scan : ReadPlainPcd(file)) {
      visit(T_map_scan * p_scan.cast<double>(), p_scan.norm());
    }
  }
}

}  // namespace

MlsMap NcltMap(const std::filesystem::path& folder, int stride) {
  const MlsParameters parameters;
  const SensorModel sensor;
  std::vector<Measurement> measurements;
  ForEachNcltPoint(folder, stride, [&](const Eigen::Vector3d& p, float range_m) {
    const CellIndex cell{static_cast<std::int32_t>(std::floor(p.x() / parameters.cell_size_m)),
                         static_cast<std::int32_t>(std::floor(p.y() / parameters.cell_size_m))};
    measurements.push_back({TileOfCell(cell),
                            CellInTile(cell),
                            static_cast<std::int32_t>(std::lround(p.z() * kTicksPerMetre)),
                            SigmaCode(sensor.SigmaAt(range_m))});
  });
  return JoinAll(std::move(measurements), parameters);
}

std::vector<Eigen::Vector3d> NcltPointsInMap(const std::filesystem::path& folder) {
  std::vector<Eigen::Vector3d> points;
  ForEachNcltPoint(
      folder, 1, [&](const Eigen::Vector3d& p, float /*range_m*/) { points.push_back(p); });
  return points;
}

}  // namespace strata::testing
