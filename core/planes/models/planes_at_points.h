// Which of a mixture's planes points lie on.
// Internal to core/planes, not installed.
#ifndef STRATA_CORE_PLANES_MODELS_PLANES_AT_POINTS_H_
#define STRATA_CORE_PLANES_MODELS_PLANES_AT_POINTS_H_

#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "core/common/hash_map.h"
#include "core/planes/models/plane_mixture.h"
#include "core/planes/planar_cells.h"

namespace strata {

// Points are on a plane within its band, in its voxels or beside them. Colours do not count. Frame:
// that of the mixture, which must outlive this.
class PlanesAtPoints {
 public:
  // Bands of so many times what a plane's cells spread about it.
  PlanesAtPoints(const PlaneMixture& mixture, double band_sigmas);

  // Of those that the point is on.
  std::optional<std::uint32_t> Nearest(const Eigen::Vector3d& p) const;
  bool AnyAt(const Eigen::Vector3d& p) const;
  // Whether a cell, moved by `shift`, is of a plane's surface, or of what its points are off it.
  bool IsOfOne(const PlanarCell& cell, const Eigen::Vector3d& shift) const;
  // Whether the point is on another plane with more points that goes through this one at an angle.
  bool IsOnLarger(const Eigen::Vector3d& p,
                  std::uint32_t plane,
                  const std::vector<std::uint32_t>& points) const;
  // Nothing is on the plane any more.
  void Remove(std::uint32_t plane) { removed_[plane] = true; }

 private:
  bool IsOn(const Eigen::Vector3d& p, std::uint32_t m) const;
  const std::vector<std::uint32_t>& Around(const Eigen::Vector3d& p) const;

  const PlaneMixture& mixture_;
  std::vector<double> bands_m_;
  std::vector<bool> removed_;
  HashMap<Voxel, std::vector<std::uint32_t>> at_;
};

}  // namespace strata

#endif  // STRATA_CORE_PLANES_MODELS_PLANES_AT_POINTS_H_
