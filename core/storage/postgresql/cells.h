// Where boxes of scans lie on a grid of 64 m, by which they are found.
#ifndef STRATA_CORE_STORAGE_POSTGRESQL_CELLS_H_
#define STRATA_CORE_STORAGE_POSTGRESQL_CELLS_H_

#include <cstdint>

#include <Eigen/Geometry>

namespace strata {

// Cells [x_min, x_max] × [y_min, y_max], bounds included.
struct CellRange {
  std::int64_t x_min = 0, x_max = 0;
  std::int64_t y_min = 0, y_max = 0;
};

// Those that the box touches. What is not empty has some; what lies beyond the numbers of cells
// counts to the last.
CellRange CellsOf(const Eigen::AlignedBox2d& box);

// Whether a footprint has more cells than are kept of one scan: it is looked at in every query.
bool IsWide(const CellRange& cells);

}  // namespace strata

#endif  // STRATA_CORE_STORAGE_POSTGRESQL_CELLS_H_
