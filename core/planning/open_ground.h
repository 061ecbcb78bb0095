// Where the ground that a robot reaches goes on, but was seen too sparsely to drive on.
#ifndef STRATA_CORE_PLANNING_OPEN_GROUND_H_
#define STRATA_CORE_PLANNING_OPEN_GROUND_H_

#include <vector>

#include <Eigen/Core>

#include "core/cloud/field_of_view.h"
#include "core/planning/search_space.h"
#include "core/planning/viewpoints.h"

namespace strata {

// Ground that a robot could be on if it had been seen whole: cells without a surface beside ground
// that goes on, step by step, from the patches `reached`, where the robot can stand or not, and the
// patches of that ground that were not reached and from which its disc covers such a cell. Middles,
// at the height of that ground. Only where voxels say that there is air above and that no ray went
// through the ground, and not around cells that a look by `sensor` had a beam for, with nothing in
// the way: no other would find more. Each cell once a level.
std::vector<Eigen::Vector3d> OpenGround(SearchSpace& space,
                                        const std::vector<PatchId>& reached,
                                        const SeenSpace& seen,
                                        const FieldOfView& sensor);

}  // namespace strata

#endif  // STRATA_CORE_PLANNING_OPEN_GROUND_H_
