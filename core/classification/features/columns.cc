#include "core/classification/features/columns.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "core/common/hash_map.h"

namespace strata {
namespace {

constexpr float kLevelM = 0.25F;

float LevelOf(float z) { return std::floor(z / kLevelM); }

// Orders like z.
std::uint32_t BitsOf(float z) {
  constexpr std::uint32_t kSign = 1U << 31;
  const auto bits = std::bit_cast<std::uint32_t>(z);
  return (bits & kSign) != 0 ? ~bits : bits | kSign;
}

// Columns in the order in which they are met.
class Columns {
 public:
  Columns(std::span<const Eigen::Vector3f> points, double edge_m) : begins_(1, 0) {
    const std::vector<std::uint32_t> columns = ColumnsOf(points, edge_m);
    for (std::size_t k = 1; k < begins_.size(); ++k) begins_[k] += begins_[k - 1];
    std::vector<std::uint32_t> next(begins_.begin(), begins_.end() - 1);
    by_height_.resize(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      by_height_[next[columns[i]]++] = std::uint64_t{BitsOf(points[i].z())} << 32 | i;
    }
    for (std::size_t k = 0; k < size(); ++k) std::ranges::sort(Keys(k));
  }

  std::size_t size() const { return begins_.size() - 1; }
  std::size_t points(std::size_t column) const { return begins_[column + 1] - begins_[column]; }
  // The n-th from below.
  std::uint32_t Point(std::size_t column, std::size_t n) const {
    return static_cast<std::uint32_t>(by_height_[begins_[column] + n]);
  }

 private:
  // Also counts the points of column k in begins_[k + 1].
  std::vector<std::uint32_t> ColumnsOf(std::span<const Eigen::Vector3f> points, double edge_m) {
    const auto cell = [edge_m](float x) {
      return static_cast<std::int32_t>(std::floor(static_cast<double>(x) / edge_m));
    };
    HashMap<std::pair<std::int32_t, std::int32_t>, std::uint32_t> known;
    std::vector<std::uint32_t> columns(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto fresh = static_cast<std::uint32_t>(known.size());
      const auto [it, added] = known.try_emplace({cell(points[i].x()), cell(points[i].y())}, fresh);
      columns[i] = it->second;
      if (added) begins_.push_back(0);
      ++begins_[columns[i] + 1];
    }
    return columns;
  }

  std::span<std::uint64_t> Keys(std::size_t column) {
    return {by_height_.data() + begins_[column], points(column)};
  }

  std::vector<std::uint32_t> begins_;     // of every column in by_height_, and the end
  std::vector<std::uint64_t> by_height_;  // BitsOf(z), then the point
};

}  // namespace

std::vector<ColumnPlace> ColumnPlaces(std::span<const Eigen::Vector3f> points,
                                      std::span<const float> ground_m,
                                      double edge_m) {
  std::vector<ColumnPlace> places(points.size());
  const Columns columns(points, edge_m);
  for (std::size_t c = 0; c < columns.size(); ++c) {
    const float lowest = points[columns.Point(c, 0)].z();
    const float highest = points[columns.Point(c, columns.points(c) - 1)].z();
    float taken = 0.0F;  // levels with points, so far
    float last = 0.0F;
    for (std::size_t n = 0; n < columns.points(c); ++n) {
      const std::uint32_t point = columns.Point(c, n);
      const float z = points[point].z();
      const float level = LevelOf(z);
      taken += n == 0 || level != last ? 1.0F : 0.0F;
      last = level;
      const float all = level - LevelOf(ground_m[point]) + 1.0F;
      places[point] = {highest - z, z - lowest, std::min(1.0F, taken / std::max(1.0F, all))};
    }
  }
  return places;
}

}  // namespace strata
