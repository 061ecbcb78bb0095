#include "core/registration/upright_offsets.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include <Eigen/Core>

#include "core/mls/mls_map.h"
#include "core/mls/mls_parameters.h"
#include "core/mls/patch.h"
#include "core/mls/tile_key.h"

namespace strata {
namespace {

constexpr std::uint32_t kLeastPoints = 3;
constexpr std::array<std::array<int, 2>, 4> kBeside = {{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};
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

UprightOffsets::UprightOffsets(const MlsMap& local_map,
                               double samples_per_metre,
                               const Eigen::Matrix3d& R_map_scan)
    : map_(local_map), R_map_scan_(R_map_scan.cast<float>()) {
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

void UprightOffsets::Moments::Add(const Eigen::Vector2f& p) {
  sum += p;
  xx += p.x() * p.x();
  xy += p.x() * p.y();
  yy += p.y() * p.y();
  ++n;
}

void UprightOffsets::Moments::Add(const Moments& others, const Eigen::Vector2f& moved) {
  const auto count = static_cast<float>(others.n);
  xx += others.xx + moved.x() * (2.0F * others.sum.x() + count * moved.x());
  xy += others.xy + moved.x() * others.sum.y() + moved.y() * (others.sum.x() + count * moved.x());
  yy += others.yy + moved.y() * (2.0F * others.sum.y() + count * moved.y());
  sum += others.sum + count * moved;
  n += others.n;
}

std::span<const Patch> UprightOffsets::UprightIn(CellIndex cell, const MlsTile*& tile) const {
  const TileKey key = TileOfCell(cell);
  if (tile == nullptr || tile->key != key) tile = map_.Find(key);
  if (tile == nullptr) return {};
  const std::span<const Patch> patches = tile->Cell(CellInTile(cell));
  return std::ranges::any_of(patches, &Patch::vertical) ? patches : std::span<const Patch>();
}

std::uint32_t UprightOffsets::SampleAt(CellIndex cell,
                                       std::int32_t z_ticks,
                                       const MlsTile*& tile) const {
  const std::span<const Patch> patches = UprightIn(cell, tile);
  const auto patch = std::ranges::find_if(
      patches, [z_ticks](const Patch& at) { return at.z_min <= z_ticks && z_ticks <= at.z_max; });
  if (patch == patches.end() || !patch->vertical()) return kNone;
  const std::size_t place = tile_first_[static_cast<std::size_t>(tile - map_.tiles.data())] +
                            static_cast<std::size_t>(&*patch - tile->patches.data());
  const auto count = static_cast<std::int64_t>(first_[place + 1] - first_[place]);
  const std::int64_t along = (z_ticks - patch->z_min) * count / std::max(1, patch->height_ticks());
  return first_[place] + static_cast<std::uint32_t>(std::min(along, count - 1));
}

void UprightOffsets::Add(std::span<const Eigen::Vector3f> points) {
  const double cell_size = map_.parameters.cell_size_m;
  const double cells_per_metre = 1.0 / cell_size;
  const MlsTile* tile = nullptr;  // the next point lies most often in the same
  for (const Eigen::Vector3f& p_scan : points) {
    const Eigen::Vector3f p = R_map_scan_ * p_scan;
    const double x = p.x() * cells_per_metre;
    const double y = p.y() * cells_per_metre;
    if (!(std::abs(x) < kMaxCellIndex && std::abs(y) < kMaxCellIndex) ||
        !(std::abs(p.z()) * kTicksPerMetre < kMaxZTicks)) {
      continue;
    }
    const CellIndex cell{FloorOf(x), FloorOf(y)};
    const std::int32_t z_ticks = FloorOf(p.z() * double{kTicksPerMetre} + 0.5);
    const std::uint32_t sample = SampleAt(cell, z_ticks, tile);
    if (sample == kNone) continue;
    samples_[sample].Add(Eigen::Vector2f(static_cast<float>((x - cell.x - 0.5) * cell_size),
                                         static_cast<float>((y - cell.y - 0.5) * cell_size)));
  }
}

std::optional<UprightOffsets::Face> UprightOffsets::FaceOf(const Moments& moments) {
  if (moments.n < kLeastPoints) return std::nullopt;
  const auto n = static_cast<float>(moments.n);
  const Eigen::Vector2f mean = moments.sum / n;
  const float xx = moments.xx / n - mean.x() * mean.x();
  const float xy = moments.xy / n - mean.x() * mean.y();
  const float yy = moments.yy / n - mean.y() * mean.y();
  const float across = 0.5F * (xx + yy) - std::hypot(0.5F * (xx - yy), xy);  // smaller eigenvalue
  if (across > kMaxFaceSigmaM * kMaxFaceSigmaM) return std::nullopt;
  const float turn_rad = 0.5F * std::atan2(2.0F * xy, xx - yy);  // of the other's direction
  return Face{mean, {-std::sin(turn_rad), std::cos(turn_rad)}};
}

Eigen::Vector2f UprightOffsets::Of(CellIndex cell,
                                   const Patch& patch,
                                   std::size_t place,
                                   int i) const {
  const std::uint32_t first = first_[place];
  const auto count = static_cast<std::int64_t>(first_[place + 1] - first);
  const Moments& own = samples_[first + static_cast<std::uint32_t>(i)];
  const auto cell_size = static_cast<float>(map_.parameters.cell_size_m);
  const auto z_ticks =
      static_cast<std::int32_t>(patch.z_min + (2 * i + 1) * patch.height_ticks() / (2 * count));
  Moments around = own;
  const MlsTile* tile = nullptr;
  for (const auto& [dx, dy] : kBeside) {
    const std::uint32_t sample = SampleAt({cell.x + dx, cell.y + dy}, z_ticks, tile);
    if (sample != kNone) {
      around.Add(samples_[sample], cell_size * Eigen::Vector2f(dx, dy));
    }
  }
  if (const std::optional<Face> face = FaceOf(around); face.has_value()) {
    Eigen::Vector2f mean = Eigen::Vector2f::Zero();
    if (own.n > 0) mean = own.sum / static_cast<float>(own.n);
    return mean + face->normal.dot(face->mean - mean) * face->normal;
  }
  const std::optional<Face> face = FaceOf(own);
  return face.has_value() ? face->mean : Eigen::Vector2f::Zero();
}

}  // namespace strata
