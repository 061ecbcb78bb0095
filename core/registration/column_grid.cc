#include "core/registration/column_grid.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>

namespace strata {
namespace {

constexpr float kMaxColumns = 4194304.0F;
// Runs shorter than this are scanned whole; longer ones are cut to the height that matters.
constexpr std::uint32_t kLongRun = 24;

struct Candidate {
  float squared_m2;
  std::uint32_t index;
  bool operator<(const Candidate& other) const { return squared_m2 < other.squared_m2; }
};

}  // namespace

ColumnGrid::ColumnGrid(std::span<const Eigen::Vector3f> points, float column_size_m)
    : column_size_m_(column_size_m) {
  if (points.empty()) return;
  Eigen::Vector2f low = points[0].head<2>();
  Eigen::Vector2f high = low;
  for (const Eigen::Vector3f& p : points) {
    low = low.cwiseMin(p.head<2>());
    high = high.cwiseMax(p.head<2>());
  }
  origin_ = low;
  const Eigen::Vector2f extent = high - low;
  while ((extent.x() / column_size_m_ + 1) * (extent.y() / column_size_m_ + 1) > kMaxColumns) {
    column_size_m_ *= 2.0F;
  }
  columns_x_ = static_cast<int>(extent.x() / column_size_m_) + 1;
  columns_y_ = static_cast<int>(extent.y() / column_size_m_) + 1;

  std::vector<std::uint32_t> column(points.size());
  begin_.assign(static_cast<std::size_t>(columns_x_) * columns_y_ + 1, 0);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Place place = PlaceOf(points[i]);
    column[i] = static_cast<std::uint32_t>(place.y * columns_x_ + place.x);
    ++begin_[column[i]];
  }
  std::uint32_t sum = 0;
  for (std::uint32_t& count : begin_) sum += std::exchange(count, sum);
  points_.resize(points.size());
  std::vector<std::uint32_t> next(begin_.begin(), begin_.end() - 1);
  for (std::size_t i = 0; i < points.size(); ++i) points_[next[column[i]]++] = points[i];
  SortColumns();
}

void ColumnGrid::SortColumns() {
  for (std::size_t c = 0; c + 1 < begin_.size(); ++c) {
    if (begin_[c + 1] - begin_[c] < kLongRun) continue;
    std::stable_sort(points_.begin() + begin_[c],
                     points_.begin() + begin_[c + 1],
                     [](const Eigen::Vector3f& a, const Eigen::Vector3f& b) {
                       return a.z() < b.z();
                     });
  }
}

ColumnGrid::Place ColumnGrid::PlaceOf(const Eigen::Vector3f& p) const {
  const float x = (p.x() - origin_.x()) / column_size_m_;
  const float y = (p.y() - origin_.y()) / column_size_m_;
  const float cx = std::clamp(std::floor(x), 0.0F, static_cast<float>(columns_x_ - 1));
  const float cy = std::clamp(std::floor(y), 0.0F, static_cast<float>(columns_y_ - 1));
  const float inside = std::min({x - cx, cx + 1.0F - x, y - cy, cy + 1.0F - y});
  return {static_cast<int>(cx), static_cast<int>(cy), inside * column_size_m_};
}

template <typename Visit>
void ColumnGrid::VisitRing(const Place& place, int ring, const Visit& visit) const {
  const int x0 = std::max(place.x - ring, 0);
  const int x1 = std::min(place.x + ring, columns_x_ - 1);
  for (int y = std::max(place.y - ring, 0); y <= std::min(place.y + ring, columns_y_ - 1); ++y) {
    const std::uint32_t* row = begin_.data() + static_cast<std::size_t>(y) * columns_x_;
    const bool whole_row = y == place.y - ring || y == place.y + ring;
    for (int x = x0; x <= x1; ++x) {
      if (!whole_row && x != place.x - ring && x != place.x + ring) {
        if (x < place.x + ring) x = std::min(place.x + ring - 1, x1);  // jump over the inside
        continue;
      }
      if (row[x] != row[x + 1]) visit(row[x], row[x + 1]);
    }
  }
}

std::uint32_t ColumnGrid::Nearest(const Eigen::Vector3f& p, float max_distance_m) const {
  if (points_.empty()) return kNone;
  const Place place = PlaceOf(p);
  if (-place.inside_m >= max_distance_m) return kNone;
  float best_m2 = max_distance_m * max_distance_m;
  std::uint32_t best = kNone;
  const auto scan = [&](std::uint32_t begin, std::uint32_t end) {
    if (end - begin >= kLongRun) {
      const float reach = std::sqrt(best_m2);
      const auto below = [](const Eigen::Vector3f& a, float z) { return a.z() < z; };
      const auto first = std::lower_bound(
          points_.begin() + begin, points_.begin() + end, p.z() - reach, below);
      begin = static_cast<std::uint32_t>(first - points_.begin());
      for (; begin < end && points_[begin].z() <= p.z() + reach; ++begin) {
        const float d = (points_[begin] - p).squaredNorm();
        if (d < best_m2) {
          best_m2 = d;
          best = begin;
        }
      }
      return;
    }
    for (; begin < end; ++begin) {
      const float d = (points_[begin] - p).squaredNorm();
      if (d < best_m2) {
        best_m2 = d;
        best = begin;
      }
    }
  };
  for (int ring = 0;; ++ring) {
    // Everything in this ring is at least so far away.
    const float ring_m = static_cast<float>(ring - 1) * column_size_m_ + place.inside_m;
    if (ring > 0 && ring_m > 0.0F && ring_m * ring_m >= best_m2) break;
    if (ring > std::max(columns_x_, columns_y_)) break;
    VisitRing(place, ring, scan);
  }
  return best;
}

int ColumnGrid::Nearest(const Eigen::Vector3f& p,
                        int count,
                        float max_distance_m,
                        std::uint32_t* indices) const {
  if (points_.empty()) return 0;
  const Place place = PlaceOf(p);
  if (-place.inside_m >= max_distance_m) return 0;
  std::array<Candidate, kMaxNeighbours> nearest;  // sorted
  int found = 0;
  float bound_m2 = max_distance_m * max_distance_m;
  const auto offer = [&](std::uint32_t index) {
    const float d = (points_[index] - p).squaredNorm();
    if (d >= bound_m2) return;
    int at = found < count ? found++ : count - 1;
    for (; at > 0 && d < nearest[at - 1].squared_m2; --at) nearest[at] = nearest[at - 1];
    nearest[at] = {d, index};
    if (found == count) bound_m2 = nearest[count - 1].squared_m2;
  };
  for (int ring = 0;; ++ring) {
    const float ring_m = static_cast<float>(ring - 1) * column_size_m_ + place.inside_m;
    if (ring > 0 && ring_m > 0.0F && ring_m * ring_m >= bound_m2) break;
    if (ring > std::max(columns_x_, columns_y_)) break;
    VisitRing(place, ring, [&](std::uint32_t begin, std::uint32_t end) {
      if (end - begin >= kLongRun) {
        const auto below = [](const Eigen::Vector3f& a, float z) { return a.z() < z; };
        const float reach = std::sqrt(bound_m2);
        begin = static_cast<std::uint32_t>(
            std::lower_bound(
                points_.begin() + begin, points_.begin() + end, p.z() - reach, below) -
            points_.begin());
        for (; begin < end && points_[begin].z() <= p.z() + reach; ++begin) offer(begin);
        return;
      }
      for (; begin < end; ++begin) offer(begin);
    });
  }
  for (int i = 0; i < found; ++i) indices[i] = nearest[i].index;
  return found;
}

std::size_t ColumnGrid::memory_bytes() const {
  return sizeof(*this) + begin_.capacity() * sizeof(std::uint32_t) +
         points_.capacity() * sizeof(Eigen::Vector3f);
}

}  // namespace strata
