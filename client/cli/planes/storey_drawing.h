// The plan of a storey as a drawing.
#ifndef STRATA_CLIENT_CLI_PLANES_STOREY_DRAWING_H_
#define STRATA_CLIENT_CLI_PLANES_STOREY_DRAWING_H_

#include <filesystem>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

#include "client/cli/planes/storey_plan.h"

namespace strata::cli {

// SVG 1.1 in millimetres of paper, at the largest scale 1:10, 1:20, 1:50, 1:100 … with which the
// plan fits on A3, with a title, the scale and a bar of it, the extent, and a legend. Groups
// "floor", "obstacle", "wall" and "unseen"; x to the right, y up. <desc> says where the map's
// origin is, for many programs' numbers are too short for coordinates far from it.
std::string StoreySvg(const StoreyPlan& plan, absl::string_view title);

// DXF R12 in metres of the map, at z = 0; layers WALL, UNSEEN, FLOOR, OBSTACLE.
std::string StoreyDxf(const StoreyPlan& plan);

// INVALID_ARGUMENT if the file's name ends neither on .svg nor on .dxf, FAILED_PRECONDITION if it
// cannot be written.
absl::Status WriteStorey(const std::filesystem::path& path,
                         const StoreyPlan& plan,
                         absl::string_view title);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_PLANES_STOREY_DRAWING_H_
