// The flat cells of a cloud: an octree whose nodes are kept as large as they are flat.
// Internal to core/planes, not installed.
#ifndef STRATA_CORE_PLANES_PLANAR_CELLS_H_
#define STRATA_CORE_PLANES_PLANAR_CELLS_H_

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/planes/extraction.h"

namespace strata {

inline constexpr int kCellLevels = 4;  // from cell_size_m down to an eighth of it

struct PlanarCell {
  int level = 0;                   // edge = smallest edge · 2^level
  std::array<std::int32_t, 3> at;  // in cells of this level
  double size_m = 0.0;             // edge
  std::uint32_t point_count = 0;
  double area_m2 = 0.0;          // of a rectangle with the same spread, inside the cell
  double sigma_m = 0.0;          // of the sensor at this range
  double rms_m = 0.0;            // about the cell's own plane, (n − 3)-corrected
  Eigen::Vector3d mean, normal;  // the normal's sign is arbitrary
  Eigen::Matrix4d moments;       // total weight: area_m2
};

// What is asked of a cell. kEven: that it is no plane through several strips at an angle to it,
// which is as flat as a surface is (shelves, steps).
enum class CellCheck { kFlat, kEven };

// Where a point was seen from, by its index.
using SensorOfPoint = std::function<Eigen::Vector3f(std::uint32_t)>;

// The flat cells of `points` in the order of their place. Smaller cells are tried where a cell is
// not flat, or less flat than what it holds (a kerb, a recess). With `sensor_of` no cell holds both
// faces of a thin wall, which are as flat as one surface where most points are on one of them.
std::vector<PlanarCell> FindPlanarCells(std::span<const Eigen::Vector3f> points,
                                        const Eigen::Vector3f& sensor_origin,
                                        const PlaneExtractionOptions& options,
                                        CellCheck check = CellCheck::kFlat,
                                        const SensorOfPoint& sensor_of = {});

// Of points that spread so in a cell whose cross section is `most_m2`; `eigenvalues`: ascending, of
// their covariance.
double SpreadArea(const Eigen::Vector3d& eigenvalues, double most_m2);
double CrossSectionOf(double size_m, const Eigen::Vector3d& normal);

// For every cell those that touch it, edges and corners included, ascending.
std::vector<std::vector<std::uint32_t>> TouchingCells(std::span<const PlanarCell> cells);

}  // namespace strata

#endif  // STRATA_CORE_PLANES_PLANAR_CELLS_H_
