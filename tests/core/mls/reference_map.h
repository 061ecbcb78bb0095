// A plain map builder to test the fast one against: std::map of cells, sorted heights, sums in
// 128 bits. Shares no code with core/mls/build.cc and join.cc.
#ifndef STRATA_TESTS_CORE_MLS_REFERENCE_MAP_H_
#define STRATA_TESTS_CORE_MLS_REFERENCE_MAP_H_

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <random>
#include <vector>

#include "core/cloud/point_cloud.h"
#include "core/cloud/sensor_model.h"
#include "core/geometry/pose.h"
#include "core/mls/mls_map.h"
#include "core/mls/patch.h"
#include "core/mls/tile_key.h"

namespace strata::testing {

__extension__ using Wide = unsigned __int128;

struct ReferenceMeasurement {
  CellIndex cell;
  std::int64_t z = 0;  // ticks
  std::uint8_t sigma_code = 0;
  Colour colour = {};
  std::uint16_t label = 0;
};

// The patch of one interval, measurements in any order.
inline Patch ReferencePatch(const std::vector<ReferenceMeasurement>& interval,
                            const MlsParameters& parameters) {
  Patch patch;
  patch.cell = CellInTile(interval.front().cell);
  std::int64_t z_min = interval.front().z;
  std::int64_t z_max = z_min;
  for (const auto& m : interval) {
    z_min = std::min(z_min, m.z);
    z_max = std::max(z_max, m.z);
  }
  int top = 255;
  Wide w = 0, wz = 0, wzz = 0;
  for (const auto& m : interval) {
    if (m.z == z_max) top = std::min<int>(top, m.sigma_code);
    const Wide weight = std::llround(65536.0 * std::pow(2.0, -2.0 * m.sigma_code * 8.0 / 255.0));
    const Wide dz = static_cast<std::uint64_t>(m.z - z_min);
    w += weight;
    wz += weight * dz;
    wzz += weight * dz * dz;
  }
  patch.z_min = z_min;
  patch.z_max = z_max;
  patch.top_sigma_code = static_cast<std::uint64_t>(top);
  patch.count = std::min<std::uint64_t>(interval.size(), (1U << 20) - 1);
  if (z_max - z_min > static_cast<std::int64_t>(parameters.thickness_m * 4096)) return patch;
  // Bound of sum_w: wzz < w · 4^bits must fit 64 bits.
  int bits = 0;
  while ((std::int64_t{1} << bits) <= static_cast<std::int64_t>(parameters.thickness_m * 4096)) {
    ++bits;
  }
  const Wide bound = (static_cast<Wide>(1) << std::min(44, 64 - 2 * bits)) - 1;
  patch.sum_w = static_cast<std::uint64_t>(std::min(w, bound));
  if (w >= bound) return patch;
  patch.sum_wz = static_cast<std::uint64_t>(wz);
  patch.sum_wzz = static_cast<std::uint64_t>(wzz);
  return patch;
}

inline MlsMap ReferenceMap(const std::vector<ReferenceMeasurement>& measurements,
                           const MlsParameters& parameters,
                           bool with_colour = false) {
  std::map<TileKey, std::map<std::uint16_t, std::vector<ReferenceMeasurement>>> cells;
  for (const auto& m : measurements) cells[TileOfCell(m.cell)][CellInTile(m.cell)].push_back(m);
  MlsMap map;
  map.parameters = parameters;
  for (auto& [key, tile_cells] : cells) {
    MlsTile tile;
    tile.key = key;
    for (auto& [cell, in_cell] : tile_cells) {
      std::stable_sort(
          in_cell.begin(), in_cell.end(), [](const auto& a, const auto& b) { return a.z < b.z; });
      for (std::size_t begin = 0; begin < in_cell.size();) {
        std::size_t end = begin + 1;
        while (end < in_cell.size() &&
               in_cell[end].z - in_cell[end - 1].z <
                   static_cast<std::int64_t>(parameters.gap_size_m * 4096)) {
          ++end;
        }
        const std::vector<ReferenceMeasurement> interval(in_cell.begin() + begin,
                                                         in_cell.begin() + end);
        ColourSum sum;
        std::map<std::uint16_t, std::uint32_t> votes;
        for (const auto& m : interval) {
          sum.r += m.colour.r;
          sum.g += m.colour.g;
          sum.b += m.colour.b;
          ++sum.count;
          if (m.label != 0) ++votes[m.label];
        }
        for (const auto& [label, count] : votes) {
          tile.votes.push_back({static_cast<std::uint32_t>(tile.patches.size()), label, count});
        }
        if (with_colour) tile.colour.push_back(sum);
        tile.patches.push_back(ReferencePatch(interval, parameters));
        begin = end;
      }
    }
    for (int row = 0; row <= kTileCells; ++row) {
      tile.row_begin[row] = static_cast<std::uint32_t>(
          std::count_if(tile.patches.begin(), tile.patches.end(), [row](const Patch& p) {
            return static_cast<int>(p.cell) / kTileCells < row;
          }));
    }
    map.tiles.push_back(tile);
  }
  return map;
}

// The documented quantisation in its plainest form: double for base and pose, float from there on.
inline std::vector<ReferenceMeasurement> ReferenceMeasurements(const PointCloud& cloud,
                                                               const Pose& T_map_scan,
                                                               const SensorModel& sensor,
                                                               const MlsParameters& parameters) {
  const double cell = parameters.cell_size_m;
  const Eigen::Vector3d sensor_map =
      T_map_scan * (cloud.origin + cloud.sensor_origin.cast<double>());
  const Eigen::Vector3d scale(1 / cell, 1 / cell, 4096.0);
  const double x = sensor_map.x() / cell;
  const double y = sensor_map.y() / cell;
  const double z = sensor_map.z() * 4096.0;
  const double base[3] = {256 * std::floor(x / 256), 256 * std::floor(y / 256), std::floor(z)};
  const float t[3] = {static_cast<float>(x - base[0]),
                      static_cast<float>(y - base[1]),
                      static_cast<float>(z - base[2] + 0.5)};
  std::vector<ReferenceMeasurement> result;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (!cloud.points[i].allFinite()) continue;
    const Eigen::Vector3f d = cloud.points[i] - cloud.sensor_origin;
    const float r2 = d.x() * d.x() + d.y() * d.y() + d.z() * d.z();
    if (r2 == 0.0F) continue;
    if (r2 < static_cast<float>(sensor.min_range_m * sensor.min_range_m)) continue;
    if (r2 > static_cast<float>(sensor.max_range_m * sensor.max_range_m)) continue;
    std::int64_t q[3];
    for (int k = 0; k < 3; ++k) {
      float u = static_cast<float>(T_map_scan(k, 0) * scale[k]) * d.x();
      u = u + static_cast<float>(T_map_scan(k, 1) * scale[k]) * d.y();
      u = u + static_cast<float>(T_map_scan(k, 2) * scale[k]) * d.z();
      u = u + t[k];
      q[k] = static_cast<std::int64_t>(base[k]) + static_cast<std::int64_t>(std::floor(u));
    }
    const std::int64_t limit = std::int64_t{1} << 30;
    if (q[0] < -limit || q[0] >= limit || q[1] < -limit || q[1] >= limit) continue;
    if (std::abs(q[2]) > kMaxZTicks) continue;
    ReferenceMeasurement m;
    m.cell = {static_cast<std::int32_t>(q[0]), static_cast<std::int32_t>(q[1])};
    m.z = q[2];
    const double sigma = sensor.sigma_m + sensor.sigma_per_metre * std::sqrt(double{r2});
    m.sigma_code = static_cast<std::uint8_t>(
        std::clamp(std::round(std::log2(sigma / 0.002) * 255 / 8), 0.0, 255.0));
    if (!cloud.colour.empty()) m.colour = cloud.colour[i];
    if (!cloud.label.empty()) m.label = cloud.label[i];
    result.push_back(m);
  }
  return result;
}

inline MlsMap ReferenceMap(const PointCloud& cloud,
                           const Pose& T_map_scan,
                           const SensorModel& sensor,
                           const MlsParameters& parameters) {
  return ReferenceMap(ReferenceMeasurements(cloud, T_map_scan, sensor, parameters),
                      parameters,
                      !cloud.colour.empty());
}

// Uniform in [low, high), the same on every machine.
inline double Uniform(std::mt19937_64& random, double low, double high) {
  return low + (high - low) * (static_cast<double>(random() >> 11) * 0x1p-53);
}

inline Pose RandomPose(std::mt19937_64& random, double translation_m) {
  const Eigen::Quaterniond q(Uniform(random, -1, 1),
                             Uniform(random, -1, 1),
                             Uniform(random, -1, 1),
                             Uniform(random, -1, 1));
  return MakePose(q,
                  {Uniform(random, -translation_m, translation_m),
                   Uniform(random, -translation_m, translation_m),
                   Uniform(random, -20, 20)});
}

}  // namespace strata::testing

#endif  // STRATA_TESTS_CORE_MLS_REFERENCE_MAP_H_
