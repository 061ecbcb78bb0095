#include "core/mls/update.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

namespace strata {
namespace {

std::uint64_t KeyOf(CellIndex cell) {
  return (std::uint64_t{static_cast<std::uint32_t>(cell.x)} << 32) |
         static_cast<std::uint32_t>(cell.y);
}
CellIndex IndexOfKey(std::uint64_t key) {
  return {static_cast<std::int32_t>(key >> 32), static_cast<std::int32_t>(key & 0xFFFFFFFF)};
}

double GateM(const Patch& patch, double sigma_m, double gap_m) {
  const double patch_sigma_m = patch.sigma_m();
  const double gate = 3.0 * std::sqrt(patch_sigma_m * patch_sigma_m + sigma_m * sigma_m);
  return std::min(std::max(gate, MlsUpdater::kMinGateM), gap_m);
}

bool InsideVertical(const Patch& patch, std::int32_t z_ticks) {
  return patch.vertical() && patch.z_min <= z_ticks && z_ticks < patch.z_max;
}

}  // namespace

MlsUpdater::MlsUpdater(const MlsParameters& parameters) : parameters_(parameters) {}

MlsUpdater::MlsUpdater(const MlsMap& map) : parameters_(map.parameters) {
  for (const MlsTile& tile : map.tiles) {
    for (const Patch& patch : tile.patches) {
      Insert(CellOf(tile.key, static_cast<std::uint16_t>(patch.cell)), patch);
    }
  }
}

void MlsUpdater::Insert(CellIndex cell, const Patch& patch) {
  const auto node = static_cast<std::uint32_t>(nodes_.size());
  const auto [head, inserted] = first_.try_emplace(KeyOf(cell), node);
  nodes_.push_back({patch, inserted ? kNone : head->second});
  head->second = node;
}

MlsUpdater::Outcome MlsUpdater::Update(const Eigen::Vector3d& p_map, double sigma_m) {
  const double x = std::floor(p_map.x() / parameters_.cell_size_m);
  const double y = std::floor(p_map.y() / parameters_.cell_size_m);
  const double z = std::floor(p_map.z() * kTicksPerMetre + 0.5);
  const auto in_map = [](double c) { return c >= -kMaxCellIndex && c < kMaxCellIndex; };
  if (!in_map(x) || !in_map(y) || !(std::abs(z) <= kMaxZTicks)) return Outcome::kOutsideMap;
  return Update({static_cast<std::int32_t>(x), static_cast<std::int32_t>(y)},
                static_cast<std::int32_t>(z),
                SigmaCode(sigma_m));
}

MlsUpdater::Outcome MlsUpdater::Update(CellIndex cell,
                                       std::int32_t z_ticks,
                                       std::uint8_t sigma_code) {
  const Patch measurement = PatchOfMeasurement(CellInTile(cell), z_ticks, sigma_code);
  const double z_m = measurement.mean_m();
  Patch* nearest = nullptr;
  double nearest_distance_m = std::numeric_limits<double>::infinity();
  bool inside_vertical = false;
  const auto head = first_.find(KeyOf(cell));
  for (std::uint32_t i = head == first_.end() ? kNone : head->second; i != kNone;
       i = nodes_[i].next) {
    Patch& patch = nodes_[i].patch;
    const double distance_m = std::abs(patch.mean_m() - z_m);
    inside_vertical = inside_vertical || InsideVertical(patch, z_ticks);
    // The lower of two patches equally near, so that the order of the chain decides nothing.
    if (distance_m < nearest_distance_m ||
        (distance_m == nearest_distance_m && patch.z_min < nearest->z_min)) {
      nearest_distance_m = distance_m;
      nearest = &patch;
    }
  }
  const double sigma_m = SigmaOfCode(sigma_code);
  if (nearest != nullptr && Touching(*nearest, measurement, parameters_) &&
      nearest_distance_m <= GateM(*nearest, sigma_m, parameters_.gap_size_m)) {
    JoinInto(*nearest, measurement, parameters_);
    return Outcome::kFused;
  }
  if (inside_vertical) return Outcome::kDisregarded;
  Insert(cell, measurement);
  return Outcome::kNewPatch;
}

std::vector<Patch> MlsUpdater::Cell(CellIndex cell) const {
  std::vector<Patch> patches;
  const auto head = first_.find(KeyOf(cell));
  for (std::uint32_t i = head == first_.end() ? kNone : head->second; i != kNone;
       i = nodes_[i].next) {
    patches.push_back(nodes_[i].patch);
  }
  return patches;
}

MlsMap MlsUpdater::Map() const {
  std::vector<std::pair<TileKey, Patch>> placed;
  placed.reserve(nodes_.size());
  for (const auto& [key, head] : first_) {
    const TileKey tile = TileOfCell(IndexOfKey(key));
    for (std::uint32_t i = head; i != kNone; i = nodes_[i].next) {
      placed.emplace_back(tile, nodes_[i].patch);
    }
  }
  // Patches equal in all three join to the same bytes in either order.
  std::sort(placed.begin(), placed.end(), [](const auto& a, const auto& b) {
    if (a.first != b.first) return a.first < b.first;
    if (a.second.cell != b.second.cell) return a.second.cell < b.second.cell;
    return a.second.z_min < b.second.z_min;
  });
  MlsMap map;
  map.parameters = parameters_;
  for (const auto& [key, patch] : placed) {
    if (map.tiles.empty() || map.tiles.back().key != key) map.tiles.emplace_back().key = key;
    std::vector<Patch>& patches = map.tiles.back().patches;
    if (!patches.empty() && patches.back().cell == patch.cell &&
        Touching(patches.back(), patch, parameters_)) {
      JoinInto(patches.back(), patch, parameters_);
    } else {
      patches.push_back(patch);
    }
  }
  for (MlsTile& tile : map.tiles) {
    tile.patches.shrink_to_fit();
    tile.IndexRows();
  }
  return map;
}

}  // namespace strata
