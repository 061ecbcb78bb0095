// A map's heights, one a cell, as files of geographic information systems.
#ifndef STRATA_CLIENT_CLI_MAP_HEIGHT_FILES_H_
#define STRATA_CLIENT_CLI_MAP_HEIGHT_FILES_H_

#include <cstdint>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include <Eigen/Geometry>

#include "client/cli/terminal/command.h"
#include "core/api/planning.h"

namespace strata::cli {

struct HeightOptions {
  std::string surface = "highest";                          // "highest", "kalman" or "ground"
  std::string profile = std::string(api::kDefaultProfile);  // ground: for whom it is
  std::int32_t level = 0;
  std::optional<Eigen::AlignedBox3d> region;
};

// Writes `out`: as "geotiff" with bands for height, σ and, of ground, class (ElevationClass); as
// "asc" the heights, and beside it OUT-sigma.asc and OUT-class.asc, each with a .prj where the map
// has an origin on earth. With an origin heights are above the ellipsoid. Surfaces outside the
// region's heights are left out. FAILED_PRECONDITION for a map without surfaces, NOT_FOUND for a
// region without, OUT_OF_RANGE for more than kMaxElevationCells, DATA_LOSS, after writing the
// others, for damaged tiles.
absl::Status ExportHeights(Context& context,
                           const std::string& map,
                           const HeightOptions& options,
                           const std::string& format,
                           const std::string& out);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_MAP_HEIGHT_FILES_H_
