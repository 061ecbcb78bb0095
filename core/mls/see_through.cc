#include "core/mls/see_through.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"

namespace strata {
namespace {

constexpr float kSliceM = 0.2F;
// Points lie this far inside of a slice for a ray to be inside of it, too: noise of both.
constexpr float kMarginM = 0.03F;
// A point is in its patch but for the rounding of heights.
constexpr float kRoundingM = 0.001F;

constexpr std::uint16_t kMaxScans = std::numeric_limits<std::uint16_t>::max();

}  // namespace

absl::Status SeeThroughOptions::Validate() const {
  std::vector<std::string> faults;
  if (scans < 1 || scans > 1000) faults.push_back(absl::StrCat("scans = ", scans));
  if (rays < 1 || rays > 100'000) faults.push_back(absl::StrCat("rays = ", rays));
  if (!(clearance_m >= 0.05 && clearance_m <= 10.0)) {
    faults.push_back(absl::StrCat("clearance_m = ", clearance_m));
  }
  if (faults.empty()) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("see-through: out of range: ", absl::StrJoin(faults, ", ")));
}

SeeThrough::SeeThrough(const MlsMap& map, const SeeThroughOptions& options)
    : options_(options),
      cell_size_m_(map.parameters.cell_size_m),
      thickness_m_(static_cast<float>(map.parameters.thickness_m)) {
  for (const MlsTile& tile : map.tiles) AddTile(tile);
}

void SeeThrough::AddTile(const MlsTile& tile) {
  const CellIndex corner = CellOf(tile.key, 0);
  window_.low = {std::min(window_.low.x, corner.x), std::min(window_.low.y, corner.y)};
  window_.high = {std::max(window_.high.x, corner.x + kTileCells),
                  std::max(window_.high.y, corner.y + kTileCells)};
  std::vector<std::uint32_t>& begin = tiles_[tile.key].begin;
  begin.reserve(std::size_t{kTileCells} * kTileCells + 1);
  for (const Patch& patch : tile.patches) {
    while (begin.size() <= patch.cell) begin.push_back(static_cast<std::uint32_t>(columns_.size()));
    Column column;
    column.bottom = static_cast<float>(patch.bottom_m());
    column.top = static_cast<float>(patch.top_m());
    column.surface =
        patch.vertical() ? column.bottom + thickness_m_ / 2 : static_cast<float>(patch.mean_m());
    const float above = column.top - column.bottom - thickness_m_;
    column.first_stretch = static_cast<std::uint32_t>(stretches_.size());
    column.stretches = 1 + static_cast<std::uint32_t>(std::ceil(std::max(above, 0.0F) / kSliceM));
    stretches_.resize(stretches_.size() + column.stretches);
    columns_.push_back(column);
  }
  begin.resize(std::size_t{kTileCells} * kTileCells + 1,
               static_cast<std::uint32_t>(columns_.size()));
}

std::span<const SeeThrough::Column> SeeThrough::ColumnsOf(CellIndex cell) const {
  const auto tile = tiles_.find(TileOfCell(cell));
  if (tile == tiles_.end()) return {};
  const std::uint32_t* const begin = tile->second.begin.data() + CellInTile(cell);
  return std::span(columns_).subspan(begin[0], begin[1] - begin[0]);
}

float SeeThrough::LowOf(const Column& column, std::uint32_t slice) const {
  if (slice == 0) return column.bottom;
  return column.bottom + thickness_m_ + static_cast<float>(slice - 1) * kSliceM;
}

float SeeThrough::HighOf(const Column& column, std::uint32_t slice) const {
  return std::min(column.top, LowOf(column, slice + 1));
}

CellIndex SeeThrough::CellAt(const Eigen::Vector3d& point) const {
  return {static_cast<std::int32_t>(std::floor(point.x() / cell_size_m_)),
          static_cast<std::int32_t>(std::floor(point.y() / cell_size_m_))};
}

SeeThrough::Stretch* SeeThrough::StretchAt(const Eigen::Vector3d& point) {
  const auto z = static_cast<float>(point.z());
  for (const Column& column : ColumnsOf(CellAt(point))) {
    if (z < column.bottom - kRoundingM || z > column.top + kRoundingM) continue;
    const float above = z - column.bottom - thickness_m_;
    const auto slice = above <= 0.0F ? 0U : 1U + static_cast<std::uint32_t>(above / kSliceM);
    return &stretches_[column.first_stretch + std::min(slice, column.stretches - 1)];
  }
  return nullptr;
}

bool SeeThrough::Gone(const Stretch& stretch) const {
  return !stretch.stays && stretch.scans >= options_.scans &&
         stretch.rays >= static_cast<std::uint32_t>(options_.rays);
}

void SeeThrough::BeginScan(const Eigen::Vector3d& sensor) {
  sensor_ = sensor;
  ++scan_;
  looked_through_.clear();
}

std::vector<std::uint16_t> SeeThrough::TakePoints(std::span<const Eigen::Vector3d> points) {
  std::vector<std::uint16_t> gone(points.size(), 0);
  for (std::size_t i = 0; i < points.size(); ++i) {
    Stretch* const stretch = StretchAt(points[i]);
    if (stretch == nullptr) continue;
    stretch->hit_by = scan_;
    if (Gone(*stretch)) {
      gone[i] = stretch->scans;
    } else {
      stretch->stays = true;
    }
  }
  return gone;
}

void SeeThrough::Look(CellIndex cell, const Column& column, std::uint32_t slice) {
  const std::uint32_t index = column.first_stretch + slice;
  Stretch& stretch = stretches_[index];
  if (stretch.stays) return;
  if (stretch.seen_by != scan_) {
    stretch.seen_by = scan_;
    stretch.rays_now = 0;
    looked_through_.push_back({cell, index, LowOf(column, slice), HighOf(column, slice)});
  }
  ++stretch.rays_now;
}

void SeeThrough::LookInto(CellIndex cell, double z_in, double z_out, double rest_m, double z_end) {
  const auto low = static_cast<float>(std::min(z_in, z_out));
  const auto high = static_cast<float>(std::max(z_in, z_out));
  for (const Column& column : ColumnsOf(cell)) {
    if (high < column.bottom || low > column.top + kMarginM) continue;
    if (low <= column.surface && column.surface <= high &&
        std::abs(z_end - column.surface) >= options_.clearance_m) {
      Look(cell, column, 0);
    }
    if (rest_m < options_.clearance_m) continue;
    for (std::uint32_t slice = 1; slice < column.stretches; ++slice) {
      if (high >= LowOf(column, slice) + kMarginM && low <= HighOf(column, slice) - kMarginM) {
        Look(cell, column, slice);
      }
    }
  }
}

std::pair<double, double> SeeThrough::OverWindow(const Eigen::Vector3d& ray) const {
  double in = 0.0;
  double out = 1.0;
  const auto clip = [&](double from, double along, std::int32_t low, std::int32_t high) {
    const double low_m = low * cell_size_m_ - from;
    const double high_m = high * cell_size_m_ - from;
    if (along == 0.0) {
      if (low_m > 0.0 || high_m <= 0.0) out = -1.0;
      return;
    }
    in = std::max(in, std::min(low_m / along, high_m / along));
    out = std::min(out, std::max(low_m / along, high_m / along));
  };
  clip(sensor_.x(), ray.x(), window_.low.x, window_.high.x);
  clip(sensor_.y(), ray.y(), window_.low.y, window_.high.y);
  return {in, out};
}

// From cell to cell along the ray (Amanatides and Woo, "A Fast Voxel Traversal Algorithm for Ray
// Tracing", 1987), in the plane.
void SeeThrough::LookAlong(const Eigen::Vector3d& end) {
  const Eigen::Vector3d ray = end - sensor_;
  const double length = ray.norm();
  if (!(length > options_.clearance_m)) return;
  const auto [begin, finish] = OverWindow(ray);
  if (begin > finish) return;
  CellIndex cell = CellAt(sensor_ + begin * ray);
  const CellIndex last = CellAt(end);
  const auto axis = [&](double from, double along, std::int32_t at) {
    Axis a;
    a.step = along > 0.0 ? 1 : -1;
    const double edge = (at + (along > 0.0 ? 1 : 0)) * cell_size_m_;
    a.next = along == 0.0 ? std::numeric_limits<double>::infinity() : (edge - from) / along;
    a.every = along == 0.0 ? a.next : cell_size_m_ / std::abs(along);
    return a;
  };
  Axis x = axis(sensor_.x(), ray.x(), cell.x);
  Axis y = axis(sensor_.y(), ray.y(), cell.y);
  double in = begin;
  while (cell != last && in < finish) {
    const double out = std::min({x.next, y.next, 1.0});
    LookInto(cell,
             sensor_.z() + in * ray.z(),
             sensor_.z() + out * ray.z(),
             (1.0 - out) * length,
             end.z());
    Axis& nearer = x.next <= y.next ? x : y;
    (x.next <= y.next ? cell.x : cell.y) += nearer.step;
    nearer.next += nearer.every;
    in = out;
  }
}

void SeeThrough::LookAlong(std::span<const Eigen::Vector3d> points) {
  for (const Eigen::Vector3d& point : points) LookAlong(point);
}

bool SeeThrough::HitAround(const Place& place) const {
  for (std::int32_t dy = -1; dy <= 1; ++dy) {
    for (std::int32_t dx = -1; dx <= 1; ++dx) {
      for (const Column& column : ColumnsOf({place.cell.x + dx, place.cell.y + dy})) {
        for (std::uint32_t slice = 0; slice < column.stretches; ++slice) {
          if (LowOf(column, slice) > place.high || HighOf(column, slice) < place.low) continue;
          if (stretches_[column.first_stretch + slice].hit_by == scan_) return true;
        }
      }
    }
  }
  return false;
}

void SeeThrough::EndScan() {
  for (const Place& place : looked_through_) {
    Stretch& stretch = stretches_[place.stretch];
    if (stretch.stays || HitAround(place)) continue;
    stretch.scans = static_cast<std::uint16_t>(std::min<int>(stretch.scans + 1, kMaxScans));
    stretch.rays += stretch.rays_now;
  }
}

}  // namespace strata
