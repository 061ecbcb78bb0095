// Tilted sensors: multi-level maps, pictures from above and headings are of frames that stand
// upright, however a sensor is mounted or held.
#ifndef STRATA_CORE_REGISTRATION_UPRIGHT_FRAME_H_
#define STRATA_CORE_REGISTRATION_UPRIGHT_FRAME_H_

#include <span>

#include <Eigen/Core>

#include "core/geometry/pose.h"

namespace strata {

// R_upright_scan: the shortest turn from a frame in which `up` is the vertical (not 0) into one
// whose z axis it is. Identity where that is less than 0.25 rad: sensors that are meant to be
// level, on ground that is not. A pure function.
Eigen::Matrix3d UprightTurn(const Eigen::Vector3d& up);
// The vertical in the frame of a scan.
Eigen::Vector3d UpOf(const Pose& T_map_scan);
// `up_said`, the vertical as the pose has it, or the scan's z axis: that of the two to which more
// of the flat pieces of the scan lie level or upright. Odometry of level sensors drifts by 20° in
// roll and pitch; a sensor that is tilted by that much says so, too. `points` in the scan's frame;
// of many some are looked at. A pure function.
Eigen::Vector3d BelievedUp(std::span<const Eigen::Vector3f> points, const Eigen::Vector3d& up_said);

}  // namespace strata

#endif  // STRATA_CORE_REGISTRATION_UPRIGHT_FRAME_H_
