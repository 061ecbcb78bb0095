// The partner of a point by where a sensor saw it. Internal to core/registration, not installed.
#ifndef STRATA_CORE_REGISTRATION_CLOUDS_PROJECTION_IMAGE_H_
#define STRATA_CORE_REGISTRATION_CLOUDS_PROJECTION_IMAGE_H_

#include <cstddef>
#include <vector>

#include <Eigen/Core>

namespace strata {

// A spherical image of points. Immutable; concurrent queries are safe.
class ProjectionImage {
 public:
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);

  // Keeps a reference to `points`. Where points share a cell the nearest to `sensor` stands for it.
  ProjectionImage(const std::vector<Eigen::Vector3d>& points,
                  const Eigen::Vector3d& sensor,
                  double cell_rad);

  // The closest of the points in the cell of `p`, or of the eight cells around it if that one is
  // empty; kNone if it is not closer than `max_distance_m`.
  std::size_t Find(const Eigen::Vector3d& p, double max_distance_m) const;

 private:
  struct Cell {
    int row, column;
  };
  Cell CellOfDirection(const Eigen::Vector3d& p) const;
  std::size_t At(int row, int column) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(column);
  }
  double Range(const Eigen::Vector3d& p) const { return (p - sensor_).squaredNorm(); }

  const std::vector<Eigen::Vector3d>& points_;
  Eigen::Vector3d sensor_;
  int columns_;
  int rows_;
  std::vector<std::size_t> image_;
};

}  // namespace strata

#endif  // STRATA_CORE_REGISTRATION_CLOUDS_PROJECTION_IMAGE_H_
