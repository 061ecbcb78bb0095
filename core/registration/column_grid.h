// Nearest neighbours among the features of one class.
// Internal to core/registration, not installed.
#ifndef STRATA_CORE_REGISTRATION_COLUMN_GRID_H_
#define STRATA_CORE_REGISTRATION_COLUMN_GRID_H_

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace strata {

// Points in upright square columns, row after row, each column sorted by z. Maps are flat: a dense
// array of columns finds neighbours with two loads where a tree walks, and is built by one counting
// sort. Immutable; concurrent queries are safe.
class ColumnGrid {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFF;

  ColumnGrid() = default;
  // REQUIRES: finite points, `column_size_m` > 0. Columns become wider where the points' extent
  // would need more than 2²² of them.
  // `order`, if any, becomes the place in `points` of each of points().
  ColumnGrid(std::span<const Eigen::Vector3f> points,
             float column_size_m,
             std::vector<std::uint32_t>* order = nullptr);

  // In the grid's own order; indices below are into this.
  const std::vector<Eigen::Vector3f>& points() const { return points_; }

  // Index of the point nearest to `p` and closer than `max_distance_m`, or kNone; of equally near
  // ones, one that depends only on the points and their order. `hint` is a guess at the answer that
  // makes it faster, or kNone.
  std::uint32_t Nearest(const Eigen::Vector3f& p,
                        float max_distance_m,
                        std::uint32_t hint = kNone) const;

  struct SlackMatch {
    std::uint32_t index = kNone;
    // The same answer holds for every query less than this from `p`: none within `max_distance_m`,
    // or this point the nearest.
    float slack_m = 0.0F;
  };
  // As above, with points up to `max_distance_m` + `max_slack_m` away for an answer, and how far
  // `p` may move before one has to ask again, at most `max_slack_m`. `hint` as above.
  SlackMatch NearestWithSlack(const Eigen::Vector3f& p,
                              float max_distance_m,
                              float max_slack_m,
                              std::uint32_t hint) const;

  // Up to `count` (≤ kMaxNeighbours) nearest points closer than `max_distance_m`, `p` itself
  // included when it is a point; returns how many were written to `indices`, in no order.
  static constexpr int kMaxNeighbours = 32;
  int Nearest(const Eigen::Vector3f& p,
              int count,
              float max_distance_m,
              std::uint32_t* indices) const;

  std::size_t memory_bytes() const;

 private:
  struct Place {
    float x_m, y_m;  // from the grid's corner
    int x, y;        // column, clamped to the grid
    float inside_m;  // distance to the nearest edge of that column, ≤ 0 outside of it
  };
  Place PlaceOf(const Eigen::Vector3f& p) const;
  // Distance along one axis from `at_m` to a row or column.
  float GapM(int column, float at_m) const;
  // Calls offer(index, squared distance) for the points closer than `bound_m2`, which `offer` may
  // lower, roughly from near to far.
  template <typename Offer>
  void VisitNear(const Eigen::Vector3f& p, const float& bound_m2, const Offer& offer) const;
  template <typename Offer>
  void VisitRun(std::uint32_t begin,
                std::uint32_t end,
                const Eigen::Vector3f& p,
                const float& bound_m2,
                const Offer& offer) const;
  void SortColumns(std::vector<std::uint32_t>* order);

  float column_size_m_ = 1.0F;
  Eigen::Vector2f origin_ = Eigen::Vector2f::Zero();
  int columns_x_ = 0;
  int columns_y_ = 0;
  std::vector<std::uint32_t> begin_;  // of each column, and the end
  std::vector<Eigen::Vector3f> points_;
};

}  // namespace strata

#endif  // STRATA_CORE_REGISTRATION_COLUMN_GRID_H_
