// Heights, one a cell, as files of geographic information systems.
#ifndef STRATA_CLIENT_CLI_HEIGHTS_HEIGHT_RASTER_H_
#define STRATA_CLIENT_CLI_HEIGHTS_HEIGHT_RASTER_H_

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"

#include "client/cli/terminal/command.h"
#include "core/mls/elevation/elevation_map.h"
#include "core/world/map_info.h"

namespace strata::cli {

inline constexpr float kNoHeight = std::numeric_limits<float>::quiet_NaN();

// In the frame of a map.
struct Heights {
  ElevationMap map;
  std::vector<float> classes;  // beside map.cells, kNoHeight where nothing is; empty: not asked for
};

struct HeightFile {
  std::string format;  // "geotiff" or "asc"
  std::string out;
  std::string surface;  // which heights they are, for the report
};

// Writes the file and says what is in it: as "geotiff" with bands for height, σ and class; as "asc"
// the heights, and beside it OUT-sigma.asc and OUT-class.asc, each with a .prj where the map has an
// origin on earth. With an origin heights are above the ellipsoid.
absl::Status WriteHeights(Context& context,
                          Heights heights,
                          const std::optional<GeodeticOrigin>& origin,
                          const HeightFile& file);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_HEIGHTS_HEIGHT_RASTER_H_
