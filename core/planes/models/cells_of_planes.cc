#include "core/planes/models/cells_of_planes.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "core/common/hash_map.h"
#include "core/planes/extraction.h"
#include "core/planes/models/coloured_cells.h"
#include "core/planes/models/plane_mixture.h"
#include "core/planes/models/plane_model_finder.h"
#include "core/planes/models/planes_at_points.h"
#include "core/planes/moments.h"
#include "core/planes/planar_cells.h"

namespace strata {
namespace {

constexpr double kOnSigmas = 2.5;
constexpr double kMostCrossed = 0.7;  // of a plane's points that are on larger ones, too
constexpr double kLeastOfPart = 4.0;  // points
constexpr std::uint32_t kNoPlane = UINT32_MAX;

// A plane's points in one of the largest cells.
struct PlanePart {
  std::uint32_t plane = 0;
  std::array<std::int32_t, 3> at{};
  Eigen::Matrix4d sum = Eigen::Matrix4d::Zero();  // about the middle of the cell
};

struct PointsInMixture {
  const PosedPoints& points;
  Eigen::Vector3d shift;

  Eigen::Vector3d At(std::size_t i) const { return points.points[i].cast<double>() + shift; }
};

// Of each point.
std::vector<std::uint32_t> NearestPlanes(const PointsInMixture& points,
                                         std::size_t planes,
                                         PlanesAtPoints& at) {
  std::vector<std::uint32_t> nearest(points.points.points.size(), kNoPlane);
  std::vector<std::uint32_t> counts(planes, 0), crossed(planes, 0);
  for (std::size_t i = 0; i < nearest.size(); ++i) {
    const std::optional<std::uint32_t> plane = at.Nearest(points.At(i));
    if (!plane.has_value()) continue;
    nearest[i] = *plane;
    ++counts[*plane];
  }
  for (std::size_t i = 0; i < nearest.size(); ++i) {
    if (nearest[i] == kNoPlane) continue;
    if (at.IsOnLarger(points.At(i), nearest[i], counts)) ++crossed[nearest[i]];
  }
  std::vector<bool> removed(planes, false);
  for (std::uint32_t m = 0; m < planes; ++m) {
    removed[m] = crossed[m] > kMostCrossed * counts[m];
    if (removed[m]) at.Remove(m);
  }
  for (std::size_t i = 0; i < nearest.size(); ++i) {
    if (nearest[i] == kNoPlane || !removed[nearest[i]]) continue;
    nearest[i] = at.Nearest(points.At(i)).value_or(kNoPlane);
  }
  return nearest;
}

Eigen::Vector3d MiddleOf(const std::array<std::int32_t, 3>& at, double size_m) {
  return size_m * Eigen::Vector3d(at[0] + 0.5, at[1] + 0.5, at[2] + 0.5);
}

std::vector<PlanePart> PartsOf(const PointsInMixture& points,
                               const std::vector<std::uint32_t>& nearest,
                               std::size_t planes,
                               double size_m) {
  std::vector<HashMap<std::array<std::int32_t, 3>, std::uint32_t>> index(planes);
  std::vector<PlanePart> parts;
  for (std::size_t i = 0; i < nearest.size(); ++i) {
    if (nearest[i] == kNoPlane) continue;
    const Eigen::Vector3d p = points.points.points[i].cast<double>();
    std::array<std::int32_t, 3> at;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      at[axis] = static_cast<std::int32_t>(std::floor(p(static_cast<Eigen::Index>(axis)) / size_m));
    }
    const auto [found, is_new] =
        index[nearest[i]].try_emplace(at, static_cast<std::uint32_t>(parts.size()));
    if (is_new) {
      parts.emplace_back();
      parts.back().plane = nearest[i];
      parts.back().at = at;
    }
    PlanePart& part = parts[found->second];
    const Eigen::Vector4d x = (p - MiddleOf(at, size_m)).homogeneous();
    part.sum += x * x.transpose();
  }
  return parts;
}

PlanarCell CellOfPart(const PlanePart& part,
                      const Eigen::Vector3d& normal,
                      const PlaneExtractionOptions& options) {
  const double n = part.sum(3, 3);
  const MomentsFit fit = FitMoments(part.sum);
  const Eigen::Vector3d& e = fit.eigenvalues;
  PlanarCell cell;
  cell.level = kCellLevels - 1;
  cell.at = part.at;
  cell.size_m = options.cell_size_m;
  cell.point_count = static_cast<std::uint32_t>(n);
  cell.normal = normal;
  cell.area_m2 = SpreadArea(e, CrossSectionOf(cell.size_m, normal));
  cell.sigma_m = options.sensor.sigma_m;
  cell.rms_m = std::sqrt(e(0) * n / (n - 3.0));
  cell.mean = MiddleOf(part.at, cell.size_m) + fit.mean;
  const Eigen::Matrix3d& V = fit.eigenvectors;
  cell.moments = MomentsOf(cell.area_m2, cell.mean, V * e.asDiagonal() * V.transpose());
  return cell;
}

}  // namespace

std::vector<CellLayer> CellsOfPlanes(const PosedPoints& points,
                                     const Eigen::Vector3d& reference,
                                     const PlaneMixture& mixture,
                                     const PlaneExtractionOptions& options) {
  const std::size_t planes = mixture.planes.size();
  const PointsInMixture moved{points, points.origin - reference};
  PlanesAtPoints at(mixture, kOnSigmas);
  const std::vector<std::uint32_t> nearest = NearestPlanes(moved, planes, at);
  std::vector<CellLayer> layers;
  HashMap<std::array<std::int32_t, 3>, std::uint32_t> depth;  // by place
  for (const PlanePart& part : PartsOf(moved, nearest, planes, options.cell_size_m)) {
    if (part.sum(3, 3) < kLeastOfPart) continue;
    const std::uint32_t k = depth[part.at]++;
    if (layers.size() <= k) layers.resize(k + 1);
    layers[k].cells.push_back(CellOfPart(part, mixture.planes[part.plane].plane.normal, options));
    layers[k].colours.emplace_back();
  }
  ShareBorders(layers);
  return layers;
}

}  // namespace strata
