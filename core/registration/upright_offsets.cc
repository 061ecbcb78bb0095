#include "core/registration/upright_offsets.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>

#include <Eigen/Core>

#include "core/mls/mls_map.h"
#include "core/mls/mls_parameters.h"
#include "core/mls/patch.h"
#include "core/mls/tile_key.h"

namespace strata {
namespace {

constexpr std::uint32_t kLeastPoints = 3;
// Standard deviation across a face, of a sensor's noise; that of a cell full of points is twice as
// much at 0.1 m.
constexpr float kMaxFaceSigmaM = 0.015F;

// std::floor is a call without SSE 4.1.
std::int32_t FloorOf(double x) {
  const auto toward_zero = static_cast<std::int32_t>(x);
  return toward_zero - (x < toward_zero ? 1 : 0);
}

}  // namespace

int SamplesOf(const Patch& patch, double samples_per_metre) {
  return std::max(1, static_cast<int>(std::lround(patch.depth_m() * samples_per_metre)));
}

UprightOffsets::UprightOffsets(const MlsMap& local_map, double samples_per_metre)
    : map_(local_map) {
  std::uint32_t samples = 0;
  first_.reserve(local_map.patch_count() + 1);
  for (const MlsTile& tile : local_map.tiles) {
    tile_first_.push_back(first_.size());
    for (const Patch& patch : tile.patches) {
      first_.push_back(samples);
      if (patch.vertical()) {
        samples += static_cast<std::uint32_t>(SamplesOf(patch, samples_per_metre));
      }
    }
  }
  first_.push_back(samples);
  samples_.resize(samples);
}

void UprightOffsets::AddTo(const Patch& patch,
                           std::size_t place,
                           std::int32_t z_ticks,
                           const Eigen::Vector2f& d) {
  const auto count = static_cast<std::int64_t>(first_[place + 1] - first_[place]);
  const std::int64_t along = (z_ticks - patch.z_min) * count / std::max(1, patch.height_ticks());
  Moments& moments = samples_[first_[place] + std::min(along, count - 1)];
  moments.sum += d;
  moments.xx += d.x() * d.x();
  moments.xy += d.x() * d.y();
  moments.yy += d.y() * d.y();
  ++moments.n;
}

std::span<const Patch> UprightOffsets::UprightIn(CellIndex cell, const MlsTile*& tile) const {
  const TileKey key = TileOfCell(cell);
  if (tile == nullptr || tile->key != key) tile = map_.Find(key);
  if (tile == nullptr) return {};
  const std::span<const Patch> patches = tile->Cell(CellInTile(cell));
  return std::ranges::any_of(patches, &Patch::vertical) ? patches : std::span<const Patch>();
}

void UprightOffsets::Add(std::span<const Eigen::Vector3f> points) {
  const double cell_size = map_.parameters.cell_size_m;
  const double cells_per_metre = 1.0 / cell_size;
  const MlsTile* tile = nullptr;  // the next point lies most often in the same, even in this cell
  CellIndex last{-kMaxCellIndex - 1, 0};
  std::span<const Patch> patches;
  for (const Eigen::Vector3f& p : points) {
    const double x = p.x() * cells_per_metre;
    const double y = p.y() * cells_per_metre;
    if (!(std::abs(x) < kMaxCellIndex && std::abs(y) < kMaxCellIndex)) continue;
    const CellIndex cell{FloorOf(x), FloorOf(y)};
    if (cell != last) patches = UprightIn(last = cell, tile);
    if (patches.empty() || !(std::abs(p.z()) * kTicksPerMetre < kMaxZTicks)) continue;
    const std::int32_t z_ticks = FloorOf(p.z() * double{kTicksPerMetre} + 0.5);
    const auto patch = std::ranges::find_if(
        patches, [z_ticks](const Patch& at) { return at.z_min <= z_ticks && z_ticks <= at.z_max; });
    if (patch == patches.end() || !patch->vertical()) continue;
    const std::size_t place = tile_first_[static_cast<std::size_t>(tile - map_.tiles.data())] +
                              static_cast<std::size_t>(&*patch - tile->patches.data());
    AddTo(*patch,
          place,
          z_ticks,
          Eigen::Vector2f(static_cast<float>((x - cell.x - 0.5) * cell_size),
                          static_cast<float>((y - cell.y - 0.5) * cell_size)));
  }
}

Eigen::Vector2f UprightOffsets::Of(std::size_t place, int i) const {
  const Moments& moments = samples_[first_[place] + static_cast<std::uint32_t>(i)];
  if (moments.n < kLeastPoints) return Eigen::Vector2f::Zero();
  const auto n = static_cast<float>(moments.n);
  const Eigen::Vector2f mean = moments.sum / n;
  const float xx = moments.xx / n - mean.x() * mean.x();
  const float xy = moments.xy / n - mean.x() * mean.y();
  const float yy = moments.yy / n - mean.y() * mean.y();
  const float across = 0.5F * (xx + yy) - std::hypot(0.5F * (xx - yy), xy);  // smaller eigenvalue
  if (across > kMaxFaceSigmaM * kMaxFaceSigmaM) return Eigen::Vector2f::Zero();
  return mean;
}

}  // namespace strata
