// The two ways ICP finds the partner of a point.
// Internal to core/registration, not installed.
#ifndef STRATA_CORE_REGISTRATION_POINT_INDEX_H_
#define STRATA_CORE_REGISTRATION_POINT_INDEX_H_

#include <cstddef>
#include <memory>
#include <vector>

#include <Eigen/Core>

namespace strata {

// Immutable; concurrent queries are safe.
class PointIndex {
 public:
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);

  PointIndex() = default;
  PointIndex(const PointIndex&) = delete;
  PointIndex& operator=(const PointIndex&) = delete;
  virtual ~PointIndex() = default;

  // Index of the partner of `p` closer than `max_distance_m`, or kNone.
  virtual std::size_t Find(const Eigen::Vector3d& p, double max_distance_m) const = 0;
};

// The closest point. Keeps a reference to `points`.
std::unique_ptr<PointIndex> MakeClosestPointIndex(const std::vector<Eigen::Vector3d>& points);

// The closest of the points seen from `sensor` in the same cell of a spherical image as `p`, or of
// the eight cells around it if that one is empty. Where points share a cell the nearest to the
// sensor represents it. Keeps a reference to `points`.
std::unique_ptr<PointIndex> MakeProjectionIndex(const std::vector<Eigen::Vector3d>& points,
                                                const Eigen::Vector3d& sensor,
                                                double cell_rad);

// Unit normals of the planes through the `neighbours` nearest points of each point, zero where they
// do not span a plane.
std::vector<Eigen::Vector3d> EstimateNormals(const std::vector<Eigen::Vector3d>& points,
                                             int neighbours);

}  // namespace strata

#endif  // STRATA_CORE_REGISTRATION_POINT_INDEX_H_
