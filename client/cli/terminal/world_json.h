// Epochs, what watchers are told, and what holds scans in their places, as JSON objects; where maps
// lie.
#ifndef STRATA_CLIENT_CLI_TERMINAL_WORLD_JSON_H_
#define STRATA_CLIENT_CLI_TERMINAL_WORLD_JSON_H_

#include <string>

#include "client/cli/terminal/output.h"
#include "core/api/maps.h"
#include "core/api/posegraph.h"
#include "core/world/constraint.h"
#include "core/world/epoch.h"
#include "core/world/exploration.h"
#include "core/world/localization.h"
#include "core/world/map_info.h"
#include "core/world/plane_model.h"
#include "core/world/tracking.h"

namespace strata::cli {

Json ToJson(const EpochInfo& epoch);
Json ToJson(const api::ScanChange& scan);
Json ToJson(const api::TileChangeNotice& tile);
Json ToJson(const api::MapUpdate& update);
Json ToJson(const Constraint& constraint);
Json ToJson(const GlobalPlane& plane);
Json ToJson(const ModelPlane& plane);
Json ToJson(const PlaneModelInfo& info);
Json ToJson(const api::PoseLookup& lookup);
Json ToJson(const LocalizeCandidate& candidate);
Json ToJson(const LocalizeResult& result);
Json ToJson(const TrackedPose& pose);
Json ToJson(const ExploreResult& result);
Json ToJson(const Matrix6d& matrix);  // six rows of six

// "within (X, Y, Z) and (X, Y, Z)": the box around a map's surfaces [m].
std::string ExtentOf(const MapStats& stats);

std::string ToString(ConstraintOrigin origin);
std::string ToString(PlaneKind kind);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_TERMINAL_WORLD_JSON_H_
