// How planes that scans share hold poses.
// Internal to core/posegraph, not installed.
#ifndef STRATA_CORE_POSEGRAPH_ALIGNMENT_PLANE_TERMS_H_
#define STRATA_CORE_POSEGRAPH_ALIGNMENT_PLANE_TERMS_H_

#include <cstddef>
#include <vector>

#include "core/geometry/pose.h"
#include "core/planes/shared_directions.h"
#include "core/planes/shared_planes.h"
#include "core/posegraph/alignment/alignment.h"
#include "core/posegraph/pose_graph.h"

namespace strata {

// Whether `found` is what was excluded: the same plane to 3°, and to 0.2 m where a scan that they
// have in common sees it.
bool IsExcluded(const SharedPlane& found,
                const ExcludedPlane& excluded,
                const std::vector<Pose>& T_map_scan);

// The term of a direction, each view as much as it agrees with the others.
DirectionTerm TermOf(const SharedDirection& direction, const std::vector<Pose>& T_map_scan);

// The term of a plane, as much as its views agree at these poses.
PlaneTerm TermOf(const SharedPlane& plane, const std::vector<Pose>& T_map_scan);

// The planes as each part of the graph sees them, in the order of `planes`; `parts` says of every
// scan which it is of. Those that fewer than two scans of a part see are left out.
std::vector<SharedPlane> SplitByPart(const std::vector<SharedPlane>& planes,
                                     const std::vector<std::size_t>& parts);

}  // namespace strata

#endif  // STRATA_CORE_POSEGRAPH_ALIGNMENT_PLANE_TERMS_H_
