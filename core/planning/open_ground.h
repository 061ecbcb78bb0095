// Where the ground that a robot reaches goes on, but was seen too sparsely to drive on.
#ifndef STRATA_CORE_PLANNING_OPEN_GROUND_H_
#define STRATA_CORE_PLANNING_OPEN_GROUND_H_

#include <vector>

#include <Eigen/Core>

#include "core/cloud/field_of_view.h"
#include "core/planning/search_space.h"
#include "core/planning/viewpoints.h"

namespace strata {

// Cells without a surface beside ground that goes on, step by step, from the patches `reached`,
// where the robot can stand or not: middles, at the height of that ground. Only where voxels say
// that there is air above and that no ray went through the ground, and not where a look by `sensor`
// had a beam for every cell and nothing in the way: no other would find more. Each cell once a
// level.
std::vector<Eigen::Vector3d> OpenGround(SearchSpace& space,
                                        const std::vector<PatchId>& reached,
                                        const SeenSpace& seen,
                                        const FieldOfView& sensor);

}  // namespace strata

#endif  // STRATA_CORE_PLANNING_OPEN_GROUND_H_
