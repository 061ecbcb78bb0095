// Robots that closures alone join, and whose scans contradict each other there: storeys and houses
// that look alike.
#ifndef STRATA_CORE_ENGINE_CONSISTENCY_CONTRADICTED_JOINS_H_
#define STRATA_CORE_ENGINE_CONSISTENCY_CONTRADICTED_JOINS_H_

#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"

#include "core/engine/consistency/closure_search.h"
#include "core/engine/consistency/graph_world.h"
#include "core/engine/scans/scan_views.h"
#include "core/posegraph/closures/path_uncertainty.h"

namespace strata {

// ContradictionOf() two nodes at these poses; DATA_LOSS where one is damaged.
absl::StatusOr<double> ContradictionAt(ScanViews& views,
                                       std::span<const Pose> T_map_scan,
                                       const std::pair<std::size_t, std::size_t>& nodes);

// Those of `closures` that join what `edges` do not, none of which is sure or says what the robots'
// frames do, and that put scans where they look through what the others saw far more than scans of
// one robot do (docs/decisions/0254). `T_map_scan`: with the closures closed. Ascending.
absl::StatusOr<std::vector<std::size_t>> ContradictedJoins(const GraphWorld& world,
                                                           ScanViews& views,
                                                           std::span<const GraphEdge> edges,
                                                           std::span<const FoundClosure> closures,
                                                           std::span<const Pose> T_map_scan);

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_CONSISTENCY_CONTRADICTED_JOINS_H_
