// Floors as commands ask for them, and as files.
#ifndef STRATA_CLIENT_CLI_MAP_FLOOR_FILES_H_
#define STRATA_CLIENT_CLI_MAP_FLOOR_FILES_H_

#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "client/cli/terminal/command.h"
#include "client/formats/grid_writer.h"
#include "core/mls/surface_tile.h"
#include "core/world/floor.h"

namespace strata::cli {

struct FloorOptions {
  std::string profile = std::string(api::kDefaultProfile);
  std::optional<int> floor;
  std::optional<PlanEndpoint> at;
  InferredAs inferred = InferredAs::kIgnore;
};

// --profile, --floor, --at.
void AddFloorOptions(CLI::App* verb, FloorOptions& options, bool with_number);

// The map's floors, with the cells of those that are asked for. NOT_FOUND: --profile, --floor, or
// no floor at --at.
absl::StatusOr<FloorPlan> FloorsOf(Context& context,
                                   const std::string& map,
                                   const FloorOptions& options,
                                   bool cells);

// Leaves of finest tiles what lies on the floor that is asked for, and up to the robot's height
// above; all where none is. Errors of FloorsOf, and NOT_FOUND where the map has no floor.
absl::Status KeepFloor(Context& context,
                       const std::string& map,
                       const FloorOptions& options,
                       std::vector<SurfaceTile>& tiles);

// Writes STEM.pgm and STEM.yaml of one floor, or STEM-N.pgm and STEM-N.yaml of all where none is
// asked for; `out` is STEM or one of the two files.
absl::Status ExportFloors(Context& context,
                          const std::string& map,
                          const FloorOptions& options,
                          GridMode mode,
                          const std::string& out);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_MAP_FLOOR_FILES_H_
