#include "core/mls/elevation/elevation_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include <Eigen/Core>

#include "core/cloud/point_cloud.h"
#include "core/cloud/sensor_model.h"
#include "core/common/status.h"
#include "core/geometry/pose.h"
#include "core/mls/mls_parameters.h"
#include "core/mls/surface_tile.h"
#include "core/mls/tile_key.h"

namespace strata {
namespace {

constexpr double kMaxCell = 1 << 30;

// A return in the map frame; places in cells.
struct Measurement {
  double x = 0.0;
  double y = 0.0;
  double z_m = 0.0;
  double range_m = 0.0;
  double variance_m2 = -1.0;  // < 0: no return, or outside the sensor's range

  bool valid() const { return variance_m2 >= 0.0; }
};

absl::StatusOr<std::vector<Measurement>> Measure(const PointCloud& cloud,
                                                 const Pose& T_map_scan,
                                                 const SensorModel& sensor,
                                                 double cell_size_m) {
  STRATA_RETURN_IF_ERROR(ValidateCloud(cloud));
  STRATA_RETURN_IF_ERROR(ValidatePose(T_map_scan));
  STRATA_RETURN_IF_ERROR(ValidateSensorModel(sensor));
  STRATA_RETURN_IF_ERROR(ValidateMlsParameters({.cell_size_m = cell_size_m}));
  std::vector<Measurement> measurements(cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (!cloud.points[i].allFinite()) continue;
    const double range = (cloud.points[i] - cloud.sensor_origin).cast<double>().norm();
    if (!sensor.Takes(range)) continue;
    const Eigen::Vector3d p = T_map_scan * (cloud.origin + cloud.points[i].cast<double>());
    const double sigma = sensor.SigmaAt(range);
    measurements[i] = {.x = p.x() / cell_size_m,
                       .y = p.y() / cell_size_m,
                       .z_m = p.z(),
                       .range_m = range,
                       .variance_m2 = sigma * sigma};
  }
  return measurements;
}

absl::StatusOr<ElevationMap> Rectangle(const Eigen::Array2d& low,
                                       const Eigen::Array2d& size,
                                       double cell_size_m) {
  if ((low < -kMaxCell).any() || (low + size > kMaxCell).any() ||
      size.prod() > static_cast<double>(kMaxElevationCells)) {
    return absl::OutOfRangeError(
        absl::StrCat("elevation map: it would span ",
                     size.x(),
                     " × ",
                     size.y(),
                     " cells from (",
                     low.x(),
                     ", ",
                     low.y(),
                     "), at most ",
                     kMaxElevationCells,
                     " within ±2^30 are made; take a smaller region or larger cells"));
  }
  ElevationMap map;
  map.cell_size_m = cell_size_m;
  map.corner = {static_cast<std::int32_t>(low.x()), static_cast<std::int32_t>(low.y())};
  map.width = static_cast<std::int32_t>(size.x());
  map.height = static_cast<std::int32_t>(size.y());
  map.cells.resize(static_cast<std::size_t>(map.width) * map.height);
  return map;
}

// An unobserved map over the cells of all measurements.
absl::StatusOr<ElevationMap> EmptyMapAround(const std::vector<Measurement>& measurements,
                                            double cell_size_m) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Eigen::Array2d low = Eigen::Array2d::Constant(kInfinity);
  Eigen::Array2d high = -low;
  for (const Measurement& m : measurements) {
    if (!m.valid()) continue;
    low = low.min(Eigen::Array2d(m.x, m.y));
    high = high.max(Eigen::Array2d(m.x, m.y));
  }
  if (low.x() > high.x())
    return Rectangle(Eigen::Array2d::Zero(), Eigen::Array2d::Zero(), cell_size_m);
  low = low.floor();
  return Rectangle(low, high.floor() - low + 1.0, cell_size_m);
}

ElevationCell& CellAt(ElevationMap& map, double x, double y) {
  return map.CellAt(
      {static_cast<std::int32_t>(std::floor(x)), static_cast<std::int32_t>(std::floor(y))});
}

bool Higher(double z_m, double variance_m2, const ElevationCell& cell) {
  if (!cell.observed()) return true;
  const auto z = static_cast<float>(z_m);
  const auto sigma = static_cast<float>(std::sqrt(variance_m2));
  return z > cell.z_m || (z == cell.z_m && sigma < cell.sigma_m);
}

void KeepHighest(double z_m, double variance_m2, ElevationCell& cell) {
  if (!Higher(z_m, variance_m2, cell)) return;
  cell = {.z_m = static_cast<float>(z_m), .sigma_m = static_cast<float>(std::sqrt(variance_m2))};
}

// A cell's Kalman filter in information form: 6.1 and 6.2 repeated are Σz/σ² / Σ1/σ² and 1/Σ1/σ².
struct Fusion {
  double information = 0.0;
  double weighted_z = 0.0;

  void Add(double z_m, double variance_m2) {
    information += 1.0 / variance_m2;
    weighted_z += z_m / variance_m2;
  }
  // An unobserved cell of nothing.
  ElevationCell Cell() const {
    if (information == 0.0) return {};
    return {.z_m = static_cast<float>(weighted_z / information),
            .sigma_m = static_cast<float>(std::sqrt(1.0 / information))};
  }
};

void FuseAll(const std::vector<Measurement>& measurements, ElevationMap& map) {
  std::vector<Fusion> fusions(map.cells.size());
  for (const Measurement& m : measurements) {
    if (!m.valid()) continue;
    fusions[&CellAt(map, m.x, m.y) - map.cells.data()].Add(m.z_m, m.variance_m2);
  }
  for (std::size_t i = 0; i < fusions.size(); ++i) map.cells[i] = fusions[i].Cell();
}

ElevationCell CellOfSurfaces(std::span<const Surface> surfaces, ElevationRule rule) {
  if (rule == ElevationRule::kHighest) {
    return {.z_m = surfaces.back().z_m, .sigma_m = surfaces.back().sigma_m};
  }
  Fusion fusion;
  for (const Surface& surface : surfaces) {
    fusion.Add(surface.z_m, double{surface.sigma_m} * surface.sigma_m);
  }
  return fusion.Cell();
}

using Facet = std::array<const Measurement*, 3>;

bool OneObject(const Facet& facet, double max_range_ratio) {
  double nearest = std::numeric_limits<double>::infinity();
  double farthest = 0.0;
  for (const Measurement* corner : facet) {
    if (!corner->valid()) return false;
    nearest = std::min(nearest, corner->range_m);
    farthest = std::max(farthest, corner->range_m);
  }
  return farthest <= max_range_ratio * nearest;
}

// Twice the signed area of the triangle a, b, (x, y) from above.
double Cross(const Measurement& a, const Measurement& b, double x, double y) {
  return (b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x);
}

// Interpolates over every cell whose middle is inside the facet seen from above.
void DrawFacet(const Facet& facet, ElevationMap& map) {
  const auto& [a, b, c] = facet;
  const double area = Cross(*a, *b, c->x, c->y);
  if (area == 0.0) return;
  const auto [x_low, x_high] = std::minmax({a->x, b->x, c->x});
  const auto [y_low, y_high] = std::minmax({a->y, b->y, c->y});
  // Middles are at whole numbers plus a half.
  const auto first_x = static_cast<std::int64_t>(std::ceil(x_low - 0.5));
  const auto first_y = static_cast<std::int64_t>(std::ceil(y_low - 0.5));
  for (std::int64_t row = first_y; static_cast<double>(row) + 0.5 <= y_high; ++row) {
    const double y = static_cast<double>(row) + 0.5;
    for (std::int64_t column = first_x; static_cast<double>(column) + 0.5 <= x_high; ++column) {
      const double x = static_cast<double>(column) + 0.5;
      const double wa = Cross(*b, *c, x, y) / area;
      const double wb = Cross(*c, *a, x, y) / area;
      const double wc = Cross(*a, *b, x, y) / area;
      if (wa < 0.0 || wb < 0.0 || wc < 0.0) continue;
      KeepHighest(wa * a->z_m + wb * b->z_m + wc * c->z_m,
                  wa * wa * a->variance_m2 + wb * wb * b->variance_m2 + wc * wc * c->variance_m2,
                  CellAt(map, x, y));
    }
  }
}

}  // namespace

absl::StatusOr<ElevationMap> RectangleAround(const std::vector<CellIndex>& cells,
                                             double cell_size_m) {
  if (cells.empty()) return Rectangle(Eigen::Array2d::Zero(), Eigen::Array2d::Zero(), cell_size_m);
  Eigen::Array2d low(cells.front().x, cells.front().y);
  Eigen::Array2d high = low;
  for (const CellIndex& cell : cells) {
    low = low.min(Eigen::Array2d(cell.x, cell.y));
    high = high.max(Eigen::Array2d(cell.x, cell.y));
  }
  return Rectangle(low, high - low + 1.0, cell_size_m);
}

bool IsInside(CellIndex cell, double cell_size_m, const ElevationRegion& region) {
  return region.contains((Eigen::Vector2d(cell.x, cell.y).array() + 0.5).matrix() * cell_size_m);
}

ElevationCell ElevationMap::At(CellIndex cell) const {
  const std::int64_t x = std::int64_t{cell.x} - corner.x;
  const std::int64_t y = std::int64_t{cell.y} - corner.y;
  if (x < 0 || y < 0 || x >= width || y >= height) return {};
  return cells[static_cast<std::size_t>(y) * width + x];
}

std::size_t ElevationMap::observed_count() const {
  return static_cast<std::size_t>(std::count_if(
      cells.begin(), cells.end(), [](const ElevationCell& cell) { return cell.observed(); }));
}

absl::StatusOr<ElevationMap> InsertForward(const PointCloud& cloud,
                                           const Pose& T_map_scan,
                                           const SensorModel& sensor,
                                           double cell_size_m,
                                           ElevationRule rule) {
  STRATA_ASSIGN_OR_RETURN(const std::vector<Measurement> measurements,
                          Measure(cloud, T_map_scan, sensor, cell_size_m));
  STRATA_ASSIGN_OR_RETURN(ElevationMap map, EmptyMapAround(measurements, cell_size_m));
  if (rule == ElevationRule::kKalman) {
    FuseAll(measurements, map);
    return map;
  }
  for (const Measurement& m : measurements) {
    if (m.valid()) KeepHighest(m.z_m, m.variance_m2, CellAt(map, m.x, m.y));
  }
  return map;
}

absl::StatusOr<ElevationMap> InterpolateBackward(const PointCloud& cloud,
                                                 const Pose& T_map_scan,
                                                 const SensorModel& sensor,
                                                 double cell_size_m,
                                                 const BackwardOptions& options) {
  if (!cloud.organised()) {
    return absl::FailedPreconditionError(
        "elevation map: backward interpolation needs an organised scan; insert forward instead");
  }
  if (!(options.max_range_ratio > 1.0)) {
    return absl::InvalidArgumentError(absl::StrCat(
        "elevation map: max_range_ratio = ", options.max_range_ratio, " is not above 1"));
  }
  STRATA_ASSIGN_OR_RETURN(const std::vector<Measurement> pixels,
                          Measure(cloud, T_map_scan, sensor, cell_size_m));
  STRATA_ASSIGN_OR_RETURN(ElevationMap map, EmptyMapAround(pixels, cell_size_m));
  const std::size_t columns = cloud.columns;
  for (std::size_t row = 0; row + 1 < cloud.rows; ++row) {
    for (std::size_t column = 0; column + 1 < columns; ++column) {
      const Measurement* const corner = &pixels[row * columns + column];
      for (const Facet& facet : {Facet{corner, corner + 1, corner + columns},
                                 Facet{corner + 1, corner + columns + 1, corner + columns}}) {
        if (OneObject(facet, options.max_range_ratio)) DrawFacet(facet, map);
      }
    }
  }
  return map;
}

absl::StatusOr<ElevationMap> ElevationOf(const std::vector<SurfaceTile>& tiles,
                                         double cell_size_m,
                                         ElevationRule rule,
                                         const ElevationRegion& region) {
  std::vector<CellIndex> indices;
  std::vector<ElevationCell> cells;
  for (const SurfaceTile& tile : tiles) {
    const std::span<const Surface> surfaces = tile.surfaces;
    for (std::size_t begin = 0, end = 0; begin < surfaces.size(); begin = end) {
      while (end < surfaces.size() && surfaces[end].cell == surfaces[begin].cell) ++end;
      const CellIndex cell = CellOf(tile.key, surfaces[begin].cell);
      if (!IsInside(cell, cell_size_m, region)) continue;
      indices.push_back(cell);
      cells.push_back(CellOfSurfaces(surfaces.subspan(begin, end - begin), rule));
    }
  }
  STRATA_ASSIGN_OR_RETURN(ElevationMap map, RectangleAround(indices, cell_size_m));
  for (std::size_t i = 0; i < indices.size(); ++i) map.CellAt(indices[i]) = cells[i];
  return map;
}

std::vector<SurfaceTile> SurfacesOf(const ElevationMap& map) {
  std::map<TileKey, SurfaceTile> tiles;
  for (std::int32_t y = 0; y < map.height; ++y) {
    for (std::int32_t x = 0; x < map.width; ++x) {
      const ElevationCell& cell = map.cells[static_cast<std::size_t>(y) * map.width + x];
      if (!cell.observed()) continue;
      const CellIndex index = {map.corner.x + x, map.corner.y + y};
      tiles[TileOfCell(index)].surfaces.push_back(
          {.cell = CellInTile(index), .z_m = cell.z_m, .sigma_m = cell.sigma_m});
    }
  }
  std::vector<SurfaceTile> result;
  for (auto& [key, tile] : tiles) {
    tile.key = key;
    tile.IndexRows();
    result.push_back(std::move(tile));
  }
  return result;
}

}  // namespace strata
