#include "core/planes/creases.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/LU>

#include "core/geometry/primitives.h"
#include "core/planes/extraction.h"
#include "core/planes/planar_cells.h"
#include "core/planes/region_growing.h"
#include "core/planes/scan_planes.h"

namespace strata {
namespace {

constexpr double kMinSine = 0.34;  // 20°

// Through the point of both planes that is nearest to `near`.
std::optional<Line> Intersection(const Plane& a, const Plane& b, const Eigen::Vector3d& near) {
  const Eigen::Vector3d direction = a.normal.cross(b.normal);
  if (direction.norm() < kMinSine) return std::nullopt;
  Eigen::Matrix3d A;
  A << a.normal.transpose(), b.normal.transpose(), direction.normalized().transpose();
  const Eigen::Vector3d b_values(a.distance, b.distance, direction.normalized().dot(near));
  return Line{.origin = A.partialPivLu().solve(b_values), .direction = direction.normalized()};
}

struct Stretch {
  double from_m, to_m;
};

// The stretches of the line beside which the region has cells, joined over gaps up to
// `gap_m`; beside is nearer than that or than the cell is large.
std::vector<Stretch> StretchesBeside(const Line& line,
                                     std::span<const PlanarCell> cells,
                                     const PlanarRegion& region,
                                     double gap_m) {
  std::vector<Stretch> stretches;
  for (const std::uint32_t i : region.cells) {
    const PlanarCell& cell = cells[i];
    if (Distance(cell.mean, line) > std::max(cell.size_m, gap_m)) continue;
    const double s = line.direction.dot(cell.mean - line.origin);
    stretches.push_back({s - cell.size_m / 2, s + cell.size_m / 2});
  }
  std::sort(stretches.begin(), stretches.end(), [](const Stretch& a, const Stretch& b) {
    return a.from_m < b.from_m;
  });
  std::vector<Stretch> joined;
  for (const Stretch& s : stretches) {
    if (!joined.empty() && s.from_m <= joined.back().to_m + gap_m) {
      joined.back().to_m = std::max(joined.back().to_m, s.to_m);
    } else {
      joined.push_back(s);
    }
  }
  return joined;
}

std::vector<Stretch> Common(std::span<const Stretch> a, std::span<const Stretch> b) {
  std::vector<Stretch> common;
  for (std::size_t i = 0, j = 0; i < a.size() && j < b.size();) {
    const Stretch both = {std::max(a[i].from_m, b[j].from_m), std::min(a[i].to_m, b[j].to_m)};
    if (both.to_m > both.from_m) common.push_back(both);
    if (a[i].to_m < b[j].to_m) {
      ++i;
    } else {
      ++j;
    }
  }
  return common;
}

double ReachOf(const PlanarRegion& region) {
  return 2.0 * std::sqrt(region.fit.eigenvalues(2)) + 2.0;
}

}  // namespace

std::vector<EdgeFeature> FindCreases(std::span<const PlanarCell> cells,
                                     std::span<const PlanarRegion> regions,
                                     const PlaneExtractionOptions& options) {
  std::vector<EdgeFeature> edges;
  for (std::size_t i = 0; i < regions.size(); ++i) {
    for (std::size_t j = i + 1; j < regions.size(); ++j) {
      const MomentsFit& a = regions[i].fit;
      const MomentsFit& b = regions[j].fit;
      const double reach = ReachOf(regions[i]) + ReachOf(regions[j]) + options.cell_size_m;
      if (Distance(a.mean, b.mean) > reach) continue;
      const std::optional<Line> line = Intersection(a.plane, b.plane, (a.mean + b.mean) / 2);
      if (!line.has_value()) continue;
      const double gap = options.cell_size_m / 2;  // cells that hold both are not flat
      for (const Stretch& s : Common(StretchesBeside(*line, cells, regions[i], gap),
                                     StretchesBeside(*line, cells, regions[j], gap))) {
        if (s.to_m - s.from_m < options.min_edge_length_m) continue;
        EdgeFeature edge;
        edge.points = {line->origin + s.from_m * line->direction,
                       line->origin + s.to_m * line->direction};
        edge.line = {.origin = (edge.points[0] + edge.points[1]) / 2, .direction = line->direction};
        edge.length_m = s.to_m - s.from_m;
        edge.rms_m = std::sqrt(a.eigenvalues(0) + b.eigenvalues(0));
        edges.push_back(edge);
      }
    }
  }
  return edges;
}

}  // namespace strata
