// Occupancy grids as nav2's map_server reads them: a picture and a YAML file that says what it is.
#ifndef STRATA_CLIENT_FORMATS_GRID_WRITER_H_
#define STRATA_CLIENT_FORMATS_GRID_WRITER_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/world/floor.h"

namespace strata {

enum class GridCell : std::uint8_t {
  kUnknown = 0,
  kFree = 1,
  kGround = 2,  // seen, and nothing stands there, but the robot cannot be there
  kOccupied = 3,
};

// How map_server reads values: as three states, or with what lies between as costs.
enum class GridMode : std::uint8_t { kTrinary = 0, kScale = 1 };

struct OccupancyGrid {
  int width = 0;   // cells along x
  int height = 0;  // cells along y
  double resolution_m = 0.0;
  double x_m = 0.0;  // lower left corner of the grid, map frame
  double y_m = 0.0;
  std::vector<GridCell> cells;  // by rows, the lowest y first
};

// RESOURCE_EXHAUSTED for a box of more than 2^28 cells. Empty for a floor without cells.
absl::StatusOr<OccupancyGrid> GridOf(const Floor& floor, double cell_size_m);

// A binary PGM, the highest y first. Trinary: 254 free, 205 unknown and ground, 0 occupied. Scale:
// 254 free, 110 ground, and 150 unknown, for a PGM has no transparency, which alone says unknown in
// this mode; read with the thresholds of Nav2Yaml that is 82 and 48 of 100.
std::string PgmBytes(const OccupancyGrid& grid, GridMode mode);

// `image`: name of the PGM, beside the YAML file. Free is below 0.196, so that 205 is not.
std::string Nav2Yaml(const OccupancyGrid& grid, GridMode mode, absl::string_view image);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_GRID_WRITER_H_
