#include "core/planes/extraction.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <span>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/cloud/point_cloud.h"
#include "core/cloud/sensor_model.h"
#include "core/common/option_checks.h"
#include "core/common/status.h"
#include "core/mls/features.h"
#include "core/mls/mls_map.h"
#include "core/planes/creases.h"
#include "core/planes/curvature.h"
#include "core/planes/edge_lines.h"
#include "core/planes/planar_cells.h"
#include "core/planes/range_image.h"
#include "core/planes/region_growing.h"
#include "core/planes/scan_planes.h"

namespace strata {
namespace {

constexpr int kFootprintSquares = 32;
constexpr double kCellSpread = 0.4;  // of surfaces in a map of cells, in cells

void SetExtent(std::span<const PlanarCell> cells, const PlanarRegion& region, PlanePatch& patch) {
  const Eigen::Vector3d axis_v = patch.plane.normal.cross(patch.axis_u);
  Eigen::AlignedBox2d box;
  for (const std::uint32_t i : region.cells) {
    const Eigen::Vector3d p = cells[i].mean - patch.centroid;
    const Eigen::Vector2d at(patch.axis_u.dot(p), axis_v.dot(p));
    const double half = std::sqrt(cells[i].area_m2) / 2;
    box.extend(at + Eigen::Vector2d::Constant(half));
    box.extend(at - Eigen::Vector2d::Constant(half));
  }
  patch.extent_min = box.min();
  patch.extent_max = box.max();
}

int SquareAt(double offset_m, double square_m) {
  return std::clamp(static_cast<int>(std::floor(offset_m / square_m)), 0, kFootprintSquares - 1);
}

// REQUIRES: the extent is set.
void SetFootprint(std::span<const PlanarCell> cells,
                  const PlanarRegion& region,
                  double finest_m,
                  PlanePatch& patch) {
  const Eigen::Vector3d axis_v = patch.plane.normal.cross(patch.axis_u);
  const Eigen::Vector2d size = patch.extent_max - patch.extent_min;
  const double square = std::max(finest_m, 1.001 * size.maxCoeff() / kFootprintSquares);
  patch.footprint_cell_m = square;
  patch.footprint.assign(static_cast<std::size_t>(SquareAt(size.x(), square)) + 1, 0);
  for (const std::uint32_t i : region.cells) {
    const Eigen::Vector3d p = cells[i].mean - patch.centroid;
    const double a = patch.axis_u.dot(p) - patch.extent_min.x();
    const double b = axis_v.dot(p) - patch.extent_min.y();
    const double half = std::sqrt(cells[i].area_m2) / 2;
    for (int k = SquareAt(a - half, square); k <= SquareAt(a + half, square); ++k) {
      if (k >= std::ssize(patch.footprint)) break;
      for (int j = SquareAt(b - half, square); j <= SquareAt(b + half, square); ++j) {
        patch.footprint[static_cast<std::size_t>(k)] |= 1U << j;
      }
    }
  }
}

// The cells' areas, but no more than the footprint: where a surface lies on the border between two
// layers of cells, both hold it.
void SetArea(double area_of_cells_m2, PlanePatch& patch) {
  const double square_m2 = patch.footprint_cell_m * patch.footprint_cell_m;
  double squares = 0.0;
  for (const std::uint32_t row : patch.footprint) squares += std::popcount(row);
  patch.area_m2 = std::min(area_of_cells_m2, squares * square_m2);
  patch.moments *= patch.area_m2 / area_of_cells_m2;
}

PlanePatch PatchOf(std::span<const PlanarCell> cells,
                   const PlanarRegion& region,
                   const Eigen::Vector3d& sensor,
                   double finest_m) {
  PlanePatch patch;
  patch.moments = region.moments;
  patch.centroid = region.fit.mean;
  patch.plane = region.fit.plane;
  if (SignedDistance(sensor, patch.plane) < 0.0) {
    patch.plane = {.normal = -patch.plane.normal, .distance = -patch.plane.distance};
  }
  patch.axis_u = region.fit.eigenvectors.col(2);
  patch.rms_m = std::sqrt(region.fit.eigenvalues(0));
  for (const std::uint32_t i : region.cells) patch.point_count += cells[i].point_count;
  SetExtent(cells, region, patch);
  SetFootprint(cells, region, finest_m, patch);
  SetArea(region.moments(3, 3), patch);
  return patch;
}

// Points to patches and creases.
ScanPlanes PatchesAndCreases(std::span<const Eigen::Vector3f> points,
                             const Eigen::Vector3f& sensor_origin,
                             const PlaneExtractionOptions& options) {
  const std::vector<PlanarCell> cells = FindPlanarCells(points, sensor_origin, options);
  const std::vector<std::vector<std::uint32_t>> touching = TouchingCells(cells);
  std::vector<PlanarRegion> regions = GrowRegions(cells, touching, options);
  std::erase_if(regions,
                [&](const PlanarRegion& r) { return r.moments(3, 3) < options.min_area_m2; });
  std::stable_sort(regions.begin(), regions.end(), [](const auto& a, const auto& b) {
    return a.moments(3, 3) > b.moments(3, 3);
  });
  if (std::ssize(regions) > options.max_patches) {
    regions.resize(static_cast<std::size_t>(options.max_patches));
  }
  ScanPlanes planes;
  for (const PlanarRegion& region : regions) {
    PlanePatch& patch = planes.patches.emplace_back(
        PatchOf(cells, region, sensor_origin.cast<double>(), options.cell_size_m / 4));
    patch.curvature = CurvatureOf(cells,
                                  AroundFew(cells, touching, region.cells, options.max_angle_rad),
                                  patch.axis_u,
                                  patch.plane.normal.cross(patch.axis_u));
  }
  planes.edges = FindCreases(cells, regions, options);
  return planes;
}

void KeepLongest(int count, std::vector<EdgeFeature>& edges) {
  std::stable_sort(edges.begin(), edges.end(), [](const EdgeFeature& a, const EdgeFeature& b) {
    return a.length_m > b.length_m;
  });
  if (std::ssize(edges) > count) edges.resize(static_cast<std::size_t>(count));
}

}  // namespace

absl::Status PlaneExtractionOptions::Validate() const {
  STRATA_RETURN_IF_ERROR(ValidateSensorModel(sensor));
  OptionChecks checks("plane extraction");
  checks.InRange("|sensor_origin|", sensor_origin.norm(), 0.0F, 1e6F);
  checks.InRange("max_range_m", max_range_m, 1e-3, 1000.0);
  checks.InRange("cell_size_m", cell_size_m, 0.2, 20.0);
  checks.InRange("max_rms_m", max_rms_m, 0.001, 1.0);
  checks.InRange("max_angle_rad", max_angle_rad, 0.01, 0.5);
  checks.InRange("min_area_m2", min_area_m2, 0.01, 10000.0);
  checks.InRange("range_jump_m", range_jump_m, 0.01, 100.0);
  checks.InRange("min_edge_length_m", min_edge_length_m, 0.1, 1000.0);
  checks.InRange("max_patches", max_patches, 0, 10000);
  checks.InRange("max_edges", max_edges, 0, 10000);
  return checks.status();
}

ScanPlanes ExtractPlanes(const PointCloud& cloud, const PlaneExtractionOptions& options) {
  ScanPlanes planes = PatchesAndCreases(cloud.points, cloud.sensor_origin, options);
  const RangeImage image = MakeRangeImage(cloud, options.max_range_m);
  std::vector<Eigen::Vector3d> edgels;
  for (const std::uint32_t i : DepthBorders(image, options.range_jump_m)) {
    edgels.push_back(cloud.points[i].cast<double>());
  }
  for (EdgeFeature& edge : FindEdgeLines(edgels, {.min_length_m = options.min_edge_length_m})) {
    planes.edges.push_back(std::move(edge));
  }
  KeepLongest(options.max_edges, planes.edges);
  return planes;
}

ScanPlanes ExtractPlanes(const MlsMap& local_map, const PlaneExtractionOptions& options) {
  std::vector<Eigen::Vector3f> points;
  points.reserve(local_map.patch_count());
  for (const MlsTile& tile : local_map.tiles) {  // one by one: features take four times as much
    const MlsMap part{local_map.parameters, {tile}};
    const std::vector<Feature> features = ExtractFeatures(part).value();  // default options
    for (const Feature& feature : features) points.push_back(feature.p_map.cast<float>());
  }
  PlaneExtractionOptions blurred = options;
  blurred.max_rms_m = std::max(options.max_rms_m, kCellSpread * local_map.parameters.cell_size_m);
  ScanPlanes planes = PatchesAndCreases(points, options.sensor_origin, blurred);
  KeepLongest(options.max_edges, planes.edges);
  return planes;
}

}  // namespace strata
