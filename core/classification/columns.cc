#include "core/classification/columns.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace strata {
namespace {

constexpr float kLevelM = 0.25F;

struct InColumn {
  std::int32_t x = 0, y = 0;
  float z = 0.0F;
  std::uint32_t point = 0;

  bool SameColumn(const InColumn& other) const { return x == other.x && y == other.y; }
};

bool Before(const InColumn& a, const InColumn& b) {
  if (a.x != b.x) return a.x < b.x;
  if (a.y != b.y) return a.y < b.y;
  return a.z != b.z ? a.z < b.z : a.point < b.point;
}

float LevelOf(float z) { return std::floor(z / kLevelM); }

std::vector<InColumn> ByColumn(std::span<const Eigen::Vector3f> points, double edge_m) {
  const auto cell = [edge_m](float x) {
    return static_cast<std::int32_t>(std::floor(static_cast<double>(x) / edge_m));
  };
  std::vector<InColumn> order(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3f& p = points[i];
    order[i] = {cell(p.x()), cell(p.y()), p.z(), static_cast<std::uint32_t>(i)};
  }
  std::sort(order.begin(), order.end(), Before);
  return order;
}

}  // namespace

std::vector<ColumnPlace> ColumnPlaces(std::span<const Eigen::Vector3f> points,
                                      std::span<const float> ground_m,
                                      double edge_m) {
  std::vector<ColumnPlace> places(points.size());
  const std::vector<InColumn> order = ByColumn(points, edge_m);
  for (std::size_t begin = 0; begin < order.size();) {
    std::size_t end = begin;
    while (end < order.size() && order[end].SameColumn(order[begin])) ++end;
    float taken = 0.0F;  // levels with points, so far
    for (std::size_t k = begin; k < end; ++k) {
      const float level = LevelOf(order[k].z);
      taken += k == begin || level != LevelOf(order[k - 1].z) ? 1.0F : 0.0F;
      const std::uint32_t point = order[k].point;
      const float all = level - LevelOf(ground_m[point]) + 1.0F;
      places[point] = {order[end - 1].z - order[k].z,
                       order[k].z - order[begin].z,
                       std::min(1.0F, taken / std::max(1.0F, all))};
    }
    begin = end;
  }
  return places;
}

}  // namespace strata
