// Options that several commands share, and values that CLI11 does not know. A bad value ends the
// parsing with CLI::ValidationError (exit 2).
#ifndef STRATA_CLIENT_CLI_TERMINAL_ARGUMENTS_H_
#define STRATA_CLIENT_CLI_TERMINAL_ARGUMENTS_H_

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <Eigen/Geometry>

#include "core/mls/tile_key.h"
#include "core/world/plan.h"
#include "core/world/robot_profile.h"
#include "core/world/scan.h"

namespace strata::cli {

// No number is an angle.
inline constexpr std::size_t kNoAngle = static_cast<std::size_t>(-1);

// Numbers separated by commas, `min_count` to `max_count` of them, all finite; nullopt for anything
// else. The one at the index `angle`, if it is the last, is in degrees or as in 1.57rad [rad].
std::optional<std::vector<double>> ParseNumbers(const std::string& text,
                                                std::size_t min_count,
                                                std::size_t max_count,
                                                std::size_t angle = kNoAngle);

// Adds an option that takes such numbers; `shape` is shown in the help, as in "X,Y,Z".
CLI::Option* AddNumbers(CLI::App* app,
                        const std::string& name,
                        const std::string& shape,
                        std::size_t min_count,
                        std::size_t max_count,
                        std::function<void(const std::vector<double>&)> set,
                        const std::string& description,
                        std::size_t angle = kNoAngle);

// Adds an option that takes a pose as a place, a place and a turn about z (90 or 1.57rad), or a
// place and a quaternion, which is normalised. `set` also gets how many numbers there were: 3, 4
// or 7.
CLI::Option* AddPose(CLI::App* app,
                     const std::string& name,
                     std::function<void(const Pose&, std::size_t)> set,
                     const std::string& description);

// Adds --region X0,Y0,X1,Y1[,Z0,Z1], a box in the map [m]; of any height without Z0 and Z1.
CLI::Option* AddRegion(CLI::App* app, std::optional<Eigen::AlignedBox3d>& region);

// The positional argument NAME.
void AddMapName(CLI::App* app, std::string& map);
// The positional argument TRAJECTORY/SEQUENCE.
void AddScanId(CLI::App* app, ScanId& id);
// The positional argument LEVEL/X/Y.
void AddTileKey(CLI::App* app, TileKey& key);

// Those fields of a robot profile that the command line gives.
struct ProfileOverrides {
  std::optional<double> radius_m, height_m, max_step_m, max_slope_rad, max_gap_m, max_roughness_m;

  RobotProfile Over(RobotProfile profile) const;
};
void AddProfileOptions(CLI::App* app, ProfileOverrides& overrides);

// Adds --inferred.
CLI::Option* AddInferred(CLI::App* app, InferredAs& inferred);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_TERMINAL_ARGUMENTS_H_
