#include "core/registration/view_check.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <vector>

#include <Eigen/Core>

#include "core/mls/features.h"

namespace strata {
namespace {

constexpr int kColumns = 180;  // 2°
constexpr int kRows = 90;
constexpr float kHalfWindowRad = 0.052F;  // of a cell and those around it
constexpr float kMinRangeM = 2.0F;
constexpr float kMaxRangeM = 40.0F;
constexpr int kAllAround = 160;  // columns, of 180
constexpr float kReturnsM = 15.0F;
// What may differ between two visits: cells of the map and of the image, and the match's error.
constexpr float kMarginM = 0.5F;
constexpr float kMarginPerMetre = 0.03F;

// Cell of the image, or -1 straight above and below.
int CellOf(const Eigen::Vector3f& p, float range) {
  constexpr float kPi = std::numbers::pi_v<float>;
  const float elevation = std::asin(std::clamp(p.z() / range, -1.0F, 1.0F));
  const int row = static_cast<int>((elevation / kPi + 0.5F) * kRows);
  const int column =
      static_cast<int>((std::atan2(p.y(), p.x()) / kPi + 1.0F) * 0.5F * kColumns) % kColumns;
  return row < 1 || row >= kRows - 1 ? -1 : row * kColumns + column;
}

// Where beams in the cells around that of a point meet the level surface that it lies on, at most.
float GroundRange(float range, float height) {
  const float grazing_rad = std::asin(std::min(1.0F, std::abs(height) / range)) - kHalfWindowRad;
  return grazing_rad <= 0.0F ? std::numeric_limits<float>::infinity()
                             : std::abs(height) / std::sin(grazing_rad);
}

}  // namespace

ViewImage::ViewImage(const ScanFeatures& features, const Eigen::Vector3d& sensor_origin)
    : origin_(sensor_origin.cast<float>()), up_(features.up().cast<float>()) {
  std::vector<Cell> own(kRows * kColumns);
  const auto see = [&](const std::vector<Eigen::Vector3f>& points) {
    for (const Eigen::Vector3f& point : points) {
      const Eigen::Vector3f p = point - origin_;
      const float range = p.norm();
      if (range < 1e-3F) continue;
      const int at = CellOf(p, range);
      if (at < 0) continue;
      Cell& cell = own[static_cast<std::size_t>(at)];
      cell.nearest_m = cell.nearest_m == 0.0F ? range : std::min(cell.nearest_m, range);
      cell.farthest_m = std::max(cell.farthest_m, range);
    }
  };
  for (int c = 0; c < kFeatureClasses; ++c) see(features.points(static_cast<FeatureClass>(c)));
  see(features.doubtful());
  cells_ = own;
  rows_.assign(kRows, false);
  columns_.assign(kColumns, false);
  for (int at = 0; at < kRows * kColumns; ++at) {
    if (own[static_cast<std::size_t>(at)].nearest_m == 0.0F) continue;
    rows_[static_cast<std::size_t>(at / kColumns)] = true;
    columns_[static_cast<std::size_t>(at % kColumns)] = true;
  }
  // Only of a sensor that turns all around is it known where it looked: within its rows.
  if (std::count(columns_.begin(), columns_.end(), true) < kAllAround) rows_.assign(kRows, false);
  for (int row = 1; row + 1 < kRows; ++row) {
    for (int column = 0; column < kColumns; ++column) {
      Cell& cell = cells_[static_cast<std::size_t>(row * kColumns + column)];
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
          const int x = (column + dx + kColumns) % kColumns;
          const Cell& other = own[static_cast<std::size_t>((row + dy) * kColumns + x)];
          if (other.nearest_m == 0.0F) continue;
          cell.measured_around = true;
          if (cell.nearest_m == 0.0F) continue;
          cell.nearest_m = std::min(cell.nearest_m, other.nearest_m);
          cell.farthest_m = std::max(cell.farthest_m, other.farthest_m);
        }
      }
    }
  }
}

Sight ViewImage::At(const Eigen::Vector3f& p_scan, bool level) const {
  const Eigen::Vector3f p = p_scan - origin_;
  const float range = p.norm();
  if (cells_.empty() || !(range >= kMinRangeM && range <= kMaxRangeM)) return Sight::kUnknown;
  const int at = CellOf(p, range);
  if (at < 0) return Sight::kUnknown;
  const Cell& cell = cells_[static_cast<std::size_t>(at)];
  if (cell.nearest_m == 0.0F) {
    return !cell.measured_around && range < kReturnsM &&
                   rows_[static_cast<std::size_t>(at / kColumns)] &&
                   columns_[static_cast<std::size_t>(at % kColumns)]
               ? Sight::kNoReturn
               : Sight::kUnknown;
  }
  const float margin = kMarginM + kMarginPerMetre * range;
  if (range < cell.nearest_m - margin) {
    const bool is_beyond = !level || cell.nearest_m - margin > GroundRange(range, up_.dot(p));
    return is_beyond ? Sight::kSeenThrough : Sight::kUnknown;
  }
  return range <= cell.farthest_m + margin ? Sight::kAgreeing : Sight::kUnknown;
}

}  // namespace strata
