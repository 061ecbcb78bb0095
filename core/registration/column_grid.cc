#include "core/registration/column_grid.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>

namespace strata {
namespace {

constexpr float kMaxColumns = 4194304.0F;
// Runs shorter than this are scanned whole; longer ones are cut to the height that matters.
constexpr std::uint32_t kLongRun = 24;

// A number that is less where `z` is, and the same for both zeros: with a point's place behind it,
// sorting numbers sorts points and leaves equal ones in their order, in a third of the time.
std::uint32_t Ascending(float z) {
  const auto bits = std::bit_cast<std::uint32_t>(z + 0.0F);
  return (bits & 0x80000000U) != 0 ? ~bits : bits | 0x80000000U;
}

struct Candidate {
  float squared_m2;
  std::uint32_t index;
};

}  // namespace

ColumnGrid::ColumnGrid(std::span<const Eigen::Vector3f> points,
                       float column_size_m,
                       std::vector<std::uint32_t>* order)
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
  if (order != nullptr) order->resize(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::uint32_t place = next[column[i]]++;
    points_[place] = points[i];
    if (order != nullptr) (*order)[place] = static_cast<std::uint32_t>(i);
  }
  SortColumns(order);
}

void ColumnGrid::SortColumns(std::vector<std::uint32_t>* order) {
  std::vector<std::uint64_t> ranks;
  std::vector<Eigen::Vector3f> column;
  std::vector<std::uint32_t> places;
  for (std::size_t c = 0; c + 1 < begin_.size(); ++c) {
    const std::uint32_t size = begin_[c + 1] - begin_[c];
    if (size < kLongRun) continue;
    const auto first = points_.begin() + begin_[c];
    column.assign(first, first + size);
    ranks.resize(size);
    for (std::uint32_t i = 0; i < size; ++i) {
      ranks[i] = std::uint64_t{Ascending(column[i].z())} << 32 | i;
    }
    std::sort(ranks.begin(), ranks.end());
    std::transform(ranks.begin(), ranks.end(), first, [&column](std::uint64_t rank) {
      return column[static_cast<std::uint32_t>(rank)];
    });
    if (order == nullptr) continue;
    const auto first_place = order->begin() + begin_[c];
    places.assign(first_place, first_place + size);
    std::transform(ranks.begin(), ranks.end(), first_place, [&places](std::uint64_t rank) {
      return places[static_cast<std::uint32_t>(rank)];
    });
  }
}

ColumnGrid::Place ColumnGrid::PlaceOf(const Eigen::Vector3f& p) const {
  Place place;
  place.x_m = p.x() - origin_.x();
  place.y_m = p.y() - origin_.y();
  const float x = place.x_m / column_size_m_;
  const float y = place.y_m / column_size_m_;
  place.x = static_cast<int>(std::clamp(x, 0.0F, static_cast<float>(columns_x_ - 1)));
  place.y = static_cast<int>(std::clamp(y, 0.0F, static_cast<float>(columns_y_ - 1)));
  const float inside_x = std::min(x - place.x, place.x + 1 - x);
  const float inside_y = std::min(y - place.y, place.y + 1 - y);
  place.inside_m = std::min(inside_x, inside_y) * column_size_m_;
  return place;
}

float ColumnGrid::GapM(int column, float at_m) const {
  const float low_m = static_cast<float>(column) * column_size_m_;
  return std::max({0.0F, low_m - at_m, at_m - (low_m + column_size_m_)});
}

template <typename Offer>
void ColumnGrid::VisitRun(std::uint32_t begin,
                          std::uint32_t end,
                          const Eigen::Vector3f& p,
                          const float& bound_m2,
                          const Offer& offer) const {
  float highest_z = std::numeric_limits<float>::infinity();
  if (end - begin >= kLongRun) {
    const float reach = std::sqrt(bound_m2);
    const auto below = [](const Eigen::Vector3f& a, float z) { return a.z() < z; };
    const auto first =
        std::lower_bound(points_.begin() + begin, points_.begin() + end, p.z() - reach, below);
    begin = static_cast<std::uint32_t>(first - points_.begin());
    highest_z = p.z() + reach;
  }
  for (; begin < end && points_[begin].z() <= highest_z; ++begin) {
    const float d = (points_[begin] - p).squaredNorm();
    if (d < bound_m2) offer(begin, d);
  }
}

template <typename Offer>
void ColumnGrid::VisitNear(const Eigen::Vector3f& p,
                           const float& bound_m2,
                           const Offer& offer) const {
  if (points_.empty()) return;
  const Place place = PlaceOf(p);
  if (place.inside_m < 0.0F && place.inside_m * place.inside_m >= bound_m2) return;
  const int rings = std::max(columns_x_, columns_y_);
  for (int ring = 0; ring <= rings; ++ring) {
    // Everything in this ring is at least so far away.
    const float ring_m = static_cast<float>(ring - 1) * column_size_m_ + place.inside_m;
    if (ring_m > 0.0F && ring_m * ring_m >= bound_m2) break;
    const int x0 = std::max(place.x - ring, 0);
    const int x1 = std::min(place.x + ring, columns_x_ - 1);
    const int y1 = std::min(place.y + ring, columns_y_ - 1);
    for (int y = std::max(place.y - ring, 0); y <= y1; ++y) {
      const float gap_y = GapM(y, place.y_m);
      if (gap_y * gap_y >= bound_m2) continue;
      const std::uint32_t* row = begin_.data() + static_cast<std::size_t>(y) * columns_x_;
      const bool whole_row = std::abs(y - place.y) == ring;
      for (int x = x0; x <= x1; ++x) {
        if (!whole_row && std::abs(x - place.x) != ring) {
          if (place.x + ring > x1) break;
          x = place.x + ring;  // jump over the inside
        }
        if (row[x] == row[x + 1]) continue;
        const float gap_x = GapM(x, place.x_m);
        if (gap_x * gap_x + gap_y * gap_y < bound_m2)
          VisitRun(row[x], row[x + 1], p, bound_m2, offer);
      }
    }
  }
}

std::uint32_t ColumnGrid::Nearest(const Eigen::Vector3f& p,
                                  float max_distance_m,
                                  std::uint32_t hint) const {
  float best_m2 = max_distance_m * max_distance_m;
  std::uint32_t best = kNone;
  if (hint != kNone) {
    // The hint itself is found again, or what is visited before it and as near: as without.
    const float just_beyond_m2 =
        std::nextafter((points_[hint] - p).squaredNorm(), std::numeric_limits<float>::infinity());
    best_m2 = std::min(best_m2, just_beyond_m2);
  }
  VisitNear(p, best_m2, [&](std::uint32_t index, float squared_m2) {
    best_m2 = squared_m2;
    best = index;
  });
  return best;
}

ColumnGrid::SlackMatch ColumnGrid::NearestWithSlack(const Eigen::Vector3f& p,
                                                    float max_distance_m,
                                                    float max_slack_m,
                                                    std::uint32_t hint) const {
  // Everything within the nearest distance and twice the slack is looked at.
  const float margin_m = 2.0F * max_slack_m;
  float best_m2 = (max_distance_m + max_slack_m) * (max_distance_m + max_slack_m);
  float bound_m2 = best_m2;
  float second_m2 = best_m2;
  SlackMatch match;
  const auto offer = [&](std::uint32_t index, float squared_m2) {
    if (squared_m2 >= best_m2) {
      if (index != match.index) second_m2 = std::min(second_m2, squared_m2);
      return;
    }
    if (match.index != kNone) second_m2 = best_m2;
    best_m2 = squared_m2;
    match.index = index;
    const float reach_m = std::sqrt(best_m2) + margin_m;
    bound_m2 = std::min(bound_m2, reach_m * reach_m);
  };
  if (hint != kNone) {
    const float d = (points_[hint] - p).squaredNorm();
    if (d < best_m2) offer(hint, d);
  }
  VisitNear(p, bound_m2, offer);
  if (match.index == kNone) {
    match.slack_m = max_slack_m;
    return match;
  }
  second_m2 = std::min(second_m2, bound_m2);
  match.slack_m = 0.5F * (std::sqrt(second_m2) - std::sqrt(best_m2));
  return match;
}

int ColumnGrid::Nearest(const Eigen::Vector3f& p,
                        int count,
                        float max_distance_m,
                        std::uint32_t* indices) const {
  std::array<Candidate, kMaxNeighbours> nearest;  // sorted
  int found = 0;
  float bound_m2 = max_distance_m * max_distance_m;
  VisitNear(p, bound_m2, [&](std::uint32_t index, float squared_m2) {
    int at = found < count ? found++ : count - 1;
    for (; at > 0 && squared_m2 < nearest[at - 1].squared_m2; --at) nearest[at] = nearest[at - 1];
    nearest[at] = {squared_m2, index};
    if (found == count) bound_m2 = nearest[count - 1].squared_m2;
  });
  for (int i = 0; i < found; ++i) indices[i] = nearest[i].index;
  return found;
}

std::size_t ColumnGrid::memory_bytes() const {
  return sizeof(*this) + begin_.capacity() * sizeof(std::uint32_t) +
         points_.capacity() * sizeof(Eigen::Vector3f);
}

}  // namespace strata
