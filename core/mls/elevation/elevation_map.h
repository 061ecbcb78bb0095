// Elevation maps: one height a cell (thesis 6.3). What multi-level surface maps are compared with,
// all a robot on open ground needs, and what geographic information systems read.
#ifndef STRATA_CORE_MLS_ELEVATION_ELEVATION_MAP_H_
#define STRATA_CORE_MLS_ELEVATION_ELEVATION_MAP_H_

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "absl/status/statusor.h"
#include <Eigen/Geometry>

#include "core/cloud/point_cloud.h"
#include "core/cloud/sensor_model.h"
#include "core/geometry/pose.h"
#include "core/mls/surface_tile.h"
#include "core/mls/tile_key.h"

namespace strata {

struct ElevationCell {
  float z_m = 0.0F;
  float sigma_m = -1.0F;  // < 0: nothing was measured here

  bool observed() const { return sigma_m >= 0.0F; }
  friend bool operator==(const ElevationCell&, const ElevationCell&) = default;
};

// A dense rectangle of the cells of an MLS map: cell (x, y) is [x, x + 1) × [y, y + 1) · cell_size.
struct ElevationMap {
  double cell_size_m = 0.1;
  CellIndex corner;  // lowest x and y
  std::int32_t width = 0;
  std::int32_t height = 0;
  std::vector<ElevationCell> cells;  // row by row, y · width + x

  // An unobserved cell outside the rectangle.
  ElevationCell At(CellIndex cell) const;
  // REQUIRES: inside the rectangle.
  ElevationCell& CellAt(CellIndex cell) {
    return cells[static_cast<std::size_t>(cell.y - corner.y) * width + (cell.x - corner.x)];
  }
  std::size_t observed_count() const;
};

// Largest rectangle that is made.
inline constexpr std::int64_t kMaxElevationCells = std::int64_t{1} << 26;

// The smallest rectangle around cells, all unobserved; an empty one around none. OUT_OF_RANGE if
// it has more than kMaxElevationCells.
absl::StatusOr<ElevationMap> RectangleAround(const std::vector<CellIndex>& cells,
                                             double cell_size_m);

// A part of a map seen from above [m]; a cell belongs to it by its middle.
using ElevationRegion = Eigen::AlignedBox2d;
inline const ElevationRegion kEverywhere =
    ElevationRegion(Eigen::Vector2d::Constant(-std::numeric_limits<double>::infinity()),
                    Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity()));
bool IsInside(CellIndex cell, double cell_size_m, const ElevationRegion& region);

enum class ElevationRule {
  kHighest,  // the highest measurement of the cell with its σ
  kKalman,   // all measurements fused by the Kalman update (6.1, 6.2), whatever their heights
};

// Forward insertion (6.3.1): every point of any cloud into its cell. Points without a return or
// outside the sensor's range are left out; σ is the sensor model's at the point's range.
// INVALID_ARGUMENT for a cloud, pose, model or cell size ([0.01, 100] m) that does not validate;
// OUT_OF_RANGE if the points span more than kMaxElevationCells or leave the map (±2³⁰ cells).
absl::StatusOr<ElevationMap> InsertForward(const PointCloud& cloud,
                                           const Pose& T_map_scan,
                                           const SensorModel& sensor,
                                           double cell_size_m,
                                           ElevationRule rule);

struct BackwardOptions {
  // Pixels whose ranges differ by more than this factor lie on different objects: nothing is
  // interpolated between them. Larger closes more of the ground far away and of the shadows behind
  // obstacles; > 1.
  double max_range_ratio = 1.2;
};

// Backward interpolation (6.3.1, after Hebert et al. 1989): for every cell the height of the
// surface straight above and below its middle, interpolated in the range image between the pixels
// around it. The image is taken as piecewise linear: each three neighbouring pixels (two triangles
// between four) are a facet unless their ranges jump; of several facets over a cell's middle the
// highest counts, as 6.3 wants it. σ² is interpolated alike, with squared weights. The first and
// last column of a full turn are not joined. Cells may be as fine as one likes. Errors as
// InsertForward; FAILED_PRECONDITION if the cloud is not organised.
absl::StatusOr<ElevationMap> InterpolateBackward(const PointCloud& cloud,
                                                 const Pose& T_map_scan,
                                                 const SensorModel& sensor,
                                                 double cell_size_m,
                                                 const BackwardOptions& options = {});

// The elevation map of the surfaces of tiles, those of one level of detail. Each horizontal surface
// is the fusion of its measurements (6.1, 6.2) and comes in as one, so that kKalman fuses all of
// the cell's, but for those of vertical surfaces: of these only the highest is there (6.5.2). Cells
// are `cell_size_m` wide. OUT_OF_RANGE as RectangleAround.
absl::StatusOr<ElevationMap> ElevationOf(const std::vector<SurfaceTile>& tiles,
                                         double cell_size_m,
                                         ElevationRule rule,
                                         const ElevationRegion& region = kEverywhere);

// The observed cells as tiles of one level each, for AnnotateTraversability and MakeSurfaceMesh;
// sorted by key.
std::vector<SurfaceTile> SurfacesOf(const ElevationMap& map);

}  // namespace strata

#endif  // STRATA_CORE_MLS_ELEVATION_ELEVATION_MAP_H_
