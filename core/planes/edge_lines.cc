#include "core/planes/edge_lines.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "core/common/hash_map.h"
#include "core/geometry/primitives.h"
#include "core/planes/moments.h"
#include "core/planes/scan_planes.h"

namespace strata {
namespace {

constexpr std::size_t kMinEdgels = 5;
constexpr double kMinLinearity = 9.0;     // first over second eigenvalue of a tangent's neighbours
constexpr double kClusterCosine = 0.985;  // 10° around a cluster's mean direction
constexpr int kElevationBins = 9;         // of the half sphere, 10° each

// Indices of points by cubes of a size.
class PointGrid {
 public:
  PointGrid(std::span<const Eigen::Vector3d> points, double size_m)
      : points_(points), size_m_(size_m) {
    for (std::uint32_t i = 0; i < points.size(); ++i) cubes_[CubeOf(points[i])].push_back(i);
  }

  // Calls visit(index) for all points of the 27 cubes around p.
  template <typename Visit>
  void Near(const Eigen::Vector3d& p, Visit visit) const {
    const Cube c = CubeOf(p);
    for (std::int64_t k = 0; k < 27; ++k) {
      const auto found = cubes_.find({c[0] + k % 3 - 1, c[1] + k / 3 % 3 - 1, c[2] + k / 9 - 1});
      if (found == cubes_.end()) continue;
      for (const std::uint32_t i : found->second) visit(i);
    }
  }

 private:
  using Cube = std::array<std::int64_t, 3>;
  Cube CubeOf(const Eigen::Vector3d& p) const {
    return {static_cast<std::int64_t>(std::floor(p.x() / size_m_)),
            static_cast<std::int64_t>(std::floor(p.y() / size_m_)),
            static_cast<std::int64_t>(std::floor(p.z() / size_m_))};
  }
  std::span<const Eigen::Vector3d> points_;
  double size_m_;
  HashMap<Cube, std::vector<std::uint32_t>> cubes_;
};

struct Tangent {
  std::uint32_t edgel;
  Eigen::Vector3d direction;  // in the upper half sphere
};

Eigen::Vector3d Upper(const Eigen::Vector3d& direction) {
  const bool lower = direction.z() < 0.0 ||
                     (direction.z() == 0.0 &&
                      (direction.y() < 0.0 || (direction.y() == 0.0 && direction.x() < 0.0)));
  return lower ? Eigen::Vector3d(-direction) : direction;
}

std::vector<Tangent> TangentsOf(std::span<const Eigen::Vector3d> edgels, double radius_m) {
  const PointGrid grid(edgels, radius_m);
  std::vector<Tangent> tangents;
  for (std::uint32_t i = 0; i < edgels.size(); ++i) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
    std::size_t n = 0;
    grid.Near(edgels[i], [&](std::uint32_t j) {
      const Eigen::Vector3d d = edgels[j] - edgels[i];
      if (d.squaredNorm() > radius_m * radius_m) return;
      sum += d;
      squares += d * d.transpose();
      ++n;
    });
    if (n < kMinEdgels) continue;
    const auto count = static_cast<double>(n);
    const Eigen::Vector3d mean = sum / count;
    const MomentsFit fit =
        FitMoments(MomentsOf(1.0, mean, squares / count - mean * mean.transpose()));
    if (fit.eigenvalues(2) < kMinLinearity * fit.eigenvalues(1)) continue;
    tangents.push_back({i, Upper(fit.eigenvectors.col(2))});
  }
  return tangents;
}

// Rings of equal elevation, cut into bins of about the same size.
int HistogramBin(const Eigen::Vector3d& direction) {
  const Bearing bearing = BearingOf(direction);
  const double width = std::numbers::pi / 2 / kElevationBins;
  const int ring =
      std::clamp(static_cast<int>(bearing.elevation_rad / width), 0, kElevationBins - 1);
  const int bins = std::max(
      1,
      static_cast<int>(std::round(2 * std::numbers::pi * std::cos((ring + 0.5) * width) / width)));
  const int bin =
      static_cast<int>((bearing.azimuth_rad + std::numbers::pi) / (2 * std::numbers::pi) * bins);
  return ring * 64 + std::clamp(bin, 0, bins - 1);
}

// The mean of the directions within reach of `start`, moved until it stays.
Eigen::Vector3d ClusterMean(const std::vector<Tangent>& tangents, Eigen::Vector3d start) {
  for (int i = 0; i < 10; ++i) {
    Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
    for (const Tangent& t : tangents) {
      if (std::abs(t.direction.dot(start)) < kClusterCosine) continue;
      squares += t.direction * t.direction.transpose();
    }
    const MomentsFit fit = FitMoments(MomentsOf(1.0, Eigen::Vector3d::Zero(), squares));
    const Eigen::Vector3d mean = Upper(fit.eigenvectors.col(2));
    if (std::abs(mean.dot(start)) > 1.0 - 1e-9) break;
    start = mean;
  }
  return start;
}

// Takes the most frequent direction's tangents out of `tangents`.
std::vector<Tangent> TakeCluster(std::vector<Tangent>& tangents) {
  std::vector<std::uint32_t> counts(64 * kElevationBins, 0);
  for (const Tangent& t : tangents) ++counts[static_cast<std::size_t>(HistogramBin(t.direction))];
  const auto top =
      static_cast<int>(std::max_element(counts.begin(), counts.end()) - counts.begin());
  const auto first = std::find_if(tangents.begin(), tangents.end(), [top](const Tangent& t) {
    return HistogramBin(t.direction) == top;
  });
  const Eigen::Vector3d mean = ClusterMean(tangents, first->direction);
  const auto out = std::stable_partition(tangents.begin(), tangents.end(), [&](const Tangent& t) {
    return std::abs(t.direction.dot(mean)) < kClusterCosine && &t != &*first;
  });
  std::vector<Tangent> cluster(out, tangents.end());
  tangents.erase(out, tangents.end());
  return cluster;
}

bool BesideEachOther(const Eigen::Vector3d& d,
                     const Eigen::Vector3d& direction,
                     const EdgeLineOptions& options) {
  const double along = direction.dot(d);
  return std::abs(along) <= options.neighbour_radius_m &&
         (d - along * direction).norm() <= options.width_m;
}

// Connected groups of a cluster.
std::vector<std::vector<Eigen::Vector3d>> SplitInSpace(std::span<const Eigen::Vector3d> edgels,
                                                       const std::vector<Tangent>& cluster,
                                                       const EdgeLineOptions& options) {
  std::vector<Eigen::Vector3d> points;
  for (const Tangent& t : cluster) points.push_back(edgels[t.edgel]);
  const PointGrid grid(points, options.neighbour_radius_m + options.width_m);
  std::vector<bool> taken(points.size(), false);
  std::vector<std::vector<Eigen::Vector3d>> groups;
  for (std::uint32_t seed = 0; seed < points.size(); ++seed) {
    if (taken[seed]) continue;
    taken[seed] = true;
    std::vector<std::uint32_t> group = {seed};
    for (std::size_t next = 0; next < group.size(); ++next) {
      const std::uint32_t i = group[next];
      grid.Near(points[i], [&](std::uint32_t j) {
        if (taken[j]) return;
        if (!BesideEachOther(points[j] - points[i], cluster[i].direction, options)) return;
        taken[j] = true;
        group.push_back(j);
      });
    }
    if (group.size() < kMinEdgels) continue;
    std::sort(group.begin(), group.end());
    groups.emplace_back();
    for (const std::uint32_t i : group) groups.back().push_back(points[i]);
  }
  return groups;
}

EdgeFeature PolylineOf(const std::vector<Eigen::Vector3d>& edgels, double vertex_every_m) {
  Eigen::Matrix4d moments = Eigen::Matrix4d::Zero();
  for (const Eigen::Vector3d& p : edgels) moments += MomentsOf(1.0, p, Eigen::Matrix3d::Zero());
  const MomentsFit fit = FitMoments(moments);
  const Eigen::Vector3d direction = Upper(fit.eigenvectors.col(2));
  std::vector<std::pair<double, std::size_t>> along;
  for (std::size_t i = 0; i < edgels.size(); ++i) {
    along.emplace_back(direction.dot(edgels[i] - fit.mean), i);
  }
  std::sort(along.begin(), along.end());
  EdgeFeature edge;
  edge.length_m = along.back().first - along.front().first;
  edge.rms_m = std::sqrt(fit.eigenvalues(0) + fit.eigenvalues(1));
  for (std::size_t i = 0; i < along.size();) {
    const double end = along[i].first + vertex_every_m;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double n = 0.0;
    for (; i < along.size() && along[i].first <= end; ++i, ++n) sum += edgels[along[i].second];
    edge.points.emplace_back(sum / n);
  }
  edge.line = {.origin = fit.mean, .direction = direction};
  return edge;
}

}  // namespace

std::vector<EdgeFeature> FindEdgeLines(std::span<const Eigen::Vector3d> edgels,
                                       const EdgeLineOptions& options) {
  std::vector<Tangent> tangents = TangentsOf(edgels, options.neighbour_radius_m);
  std::vector<EdgeFeature> edges;
  while (tangents.size() >= kMinEdgels) {
    const std::vector<Tangent> cluster = TakeCluster(tangents);
    if (cluster.size() < kMinEdgels) continue;
    for (const std::vector<Eigen::Vector3d>& group : SplitInSpace(edgels, cluster, options)) {
      EdgeFeature edge = PolylineOf(group, options.neighbour_radius_m);
      if (edge.length_m < options.min_length_m || edge.points.size() < 2 ||
          edge.rms_m > options.width_m) {
        continue;
      }
      edges.push_back(std::move(edge));
    }
  }
  return edges;
}

}  // namespace strata
