// Nearest neighbours among the features of one class.
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
// sort, about 30 ns a point (tests/bench/registration_benchmark.cc). Immutable; concurrent queries
// are safe.
class ColumnGrid {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFF;

  ColumnGrid() = default;
  // REQUIRES: finite points, `column_size_m` > 0. Columns become wider where the points' extent
  // would need more than 2²² of them.
  ColumnGrid(std::span<const Eigen::Vector3f> points, float column_size_m);

  // In the grid's own order; indices below are into this.
  const std::vector<Eigen::Vector3f>& points() const { return points_; }

  // Index of the point nearest to `p` and closer than `max_distance_m`, or kNone; of equally near
  // ones, one that depends only on the points and their order.
  std::uint32_t Nearest(const Eigen::Vector3f& p, float max_distance_m) const;

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
    int x, y;           // column, clamped to the grid
    float inside_m;     // distance to the nearest edge of that column, ≤ 0 outside of it
  };
  Place PlaceOf(const Eigen::Vector3f& p) const;
  // Calls visit(begin, end) for the runs of points in the ring of columns `ring` around `place`.
  template <typename Visit>
  void VisitRing(const Place& place, int ring, const Visit& visit) const;
  void SortColumns();

  float column_size_m_ = 1.0F;
  Eigen::Vector2f origin_ = Eigen::Vector2f::Zero();
  int columns_x_ = 0;
  int columns_y_ = 0;
  std::vector<std::uint32_t> begin_;  // of each column, and the end
  std::vector<Eigen::Vector3f> points_;
};

}  // namespace strata

#endif  // STRATA_CORE_REGISTRATION_COLUMN_GRID_H_
