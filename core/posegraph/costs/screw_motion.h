// The exponential of SE(3). Internal to core/posegraph, not installed.
#ifndef STRATA_CORE_POSEGRAPH_COSTS_SCREW_MOTION_H_
#define STRATA_CORE_POSEGRAPH_COSTS_SCREW_MOTION_H_

#include "core/geometry/pose.h"

namespace strata {

// T moved along the screw with the right-hand step [rotation, translation] as its velocity. To
// first order it is Retract(); but steps that turn all poses about one axis turn them as one body,
// however far, so that a map that swings about a single anchor does not strain its relative poses.
Pose MovedAlongScrew(const Pose& T, const Vector6d& step);

}  // namespace strata

#endif  // STRATA_CORE_POSEGRAPH_COSTS_SCREW_MOTION_H_
