// The values of the database as JSON objects: the one place that names keys.
#ifndef STRATA_CLIENT_CLI_TERMINAL_JSON_H_
#define STRATA_CLIENT_CLI_TERMINAL_JSON_H_

#include <string>

#include "absl/time/time.h"
#include <Eigen/Core>

#include "client/cli/terminal/output.h"
#include "core/api/tiles.h"
#include "core/world/classifier_info.h"
#include "core/world/constraint.h"
#include "core/world/job.h"
#include "core/world/map_class.h"
#include "core/world/map_info.h"
#include "core/world/plan.h"
#include "core/world/scan.h"

namespace strata::cli {

Json ToJson(const Eigen::Vector3d& point);  // [x, y, z]
Json ToJson(const Pose& pose);              // [x, y, z, qx, qy, qz, qw]
Json ToJson(const RobotProfile& profile);
Json ToJson(const MapInfo& info);
Json ToJson(const ClassifierInfo& classifier);
Json ToJson(const Colour& colour);  // "#rrggbb"
Json ToJson(const MapClass& map_class);
Json ToJson(const MapInfo& info, const MapStats& stats);
Json ToJson(const ScanInfo& info);
Json ToJson(const PoseNode& node);
Json ToJson(const JobInfo& job);
Json ToJson(const PlanResult& plan);
Json ToJson(const PathCheck& check);
Json ToJson(const Surface& surface);
Json ToJson(const SurfaceColumn& column);
Json ToJson(const api::TileInfo& tile);

// UTC, RFC 3339 with microseconds.
std::string TimeText(absl::Time time);

std::string ToString(ScanState state);
std::string ToString(Traversability traversability);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_TERMINAL_JSON_H_
