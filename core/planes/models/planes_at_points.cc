#include "core/planes/models/planes_at_points.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "core/common/hash_map.h"
#include "core/geometry/primitives.h"
#include "core/planes/models/plane_mixture.h"
#include "core/planes/moments.h"
#include "core/planes/planar_cells.h"

namespace strata {
namespace {

constexpr double kAtAnAngleCosine = 0.97;  // 14°
constexpr double kTailBands = 1.6;         // from a plane, of a cell of its points beyond its band

// Points without noise are off by rounding.
constexpr double kLeastBandM = 0.001;

}  // namespace

PlanesAtPoints::PlanesAtPoints(const PlaneMixture& mixture, double band_sigmas)
    : mixture_(mixture), removed_(mixture.planes.size(), false) {
  std::vector<double> squares(mixture.planes.size(), 0.0), areas(mixture.planes.size(), 0.0);
  for (std::size_t j = 0; j < mixture.cells().size(); ++j) {
    const std::optional<std::uint32_t> of = mixture.PlaneOf(j);
    if (!of.has_value()) continue;
    const MixtureCell& cell = mixture.cells()[j];
    const Plane& plane = mixture.planes[*of].plane;
    const double off = SignedDistance(cell.mean, plane);
    squares[*of] += cell.area_m2 * (off * off + plane.normal.dot(cell.covariance * plane.normal));
    areas[*of] += cell.area_m2;
  }
  for (std::uint32_t m = 0; m < mixture.planes.size(); ++m) {
    const double sigma_m = std::sqrt(squares[m] / std::max(1e-9, areas[m]));
    bands_m_.push_back(std::max(kLeastBandM, band_sigmas * sigma_m));
    for (const Voxel voxel : mixture.planes[m].voxels) {
      for (const Voxel around : VoxelsAround(voxel)) {
        std::vector<std::uint32_t>& list = at_[around];
        if (list.empty() || list.back() != m) list.push_back(m);
      }
    }
  }
}

const std::vector<std::uint32_t>& PlanesAtPoints::Around(const Eigen::Vector3d& p) const {
  static const std::vector<std::uint32_t> none;
  const auto found = at_.find(VoxelOf(p));
  return found == at_.end() ? none : found->second;
}

bool PlanesAtPoints::IsOn(const Eigen::Vector3d& p, std::uint32_t m) const {
  return !removed_[m] && Distance(p, mixture_.planes[m].plane) <= bands_m_[m];
}

std::optional<std::uint32_t> PlanesAtPoints::Nearest(const Eigen::Vector3d& p) const {
  std::optional<std::uint32_t> nearest;
  double least = 0.0;
  for (const std::uint32_t m : Around(p)) {
    if (!IsOn(p, m)) continue;
    const double off = Distance(p, mixture_.planes[m].plane);
    if (nearest.has_value() && off >= least) continue;
    least = off;
    nearest = m;
  }
  return nearest;
}

bool PlanesAtPoints::AnyAt(const Eigen::Vector3d& p) const {
  const std::vector<std::uint32_t>& around = Around(p);
  return std::any_of(around.begin(), around.end(), [&](std::uint32_t m) { return IsOn(p, m); });
}

bool PlanesAtPoints::IsOfOne(const PlanarCell& cell, const Eigen::Vector3d& shift) const {
  const std::vector<std::uint32_t>& around = Around(cell.mean + shift);
  return std::any_of(around.begin(), around.end(), [&](std::uint32_t m) {
    Plane plane = mixture_.planes[m].plane;
    plane.distance -= plane.normal.dot(shift);
    return std::abs(cell.normal.dot(plane.normal)) > kAtAnAngleCosine &&
           RmsDistance(cell.moments, plane) <= kTailBands * bands_m_[m];
  });
}

bool PlanesAtPoints::IsOnLarger(const Eigen::Vector3d& p,
                                std::uint32_t plane,
                                const std::vector<std::uint32_t>& points) const {
  const std::vector<std::uint32_t>& around = Around(p);
  const Eigen::Vector3d& normal = mixture_.planes[plane].plane.normal;
  return std::any_of(around.begin(), around.end(), [&](std::uint32_t m) {
    return points[m] > points[plane] &&
           std::abs(mixture_.planes[m].plane.normal.dot(normal)) <= kAtAnAngleCosine && IsOn(p, m);
  });
}

}  // namespace strata
