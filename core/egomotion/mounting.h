// How an IMU sits on a robot, found from a log.
#ifndef STRATA_CORE_EGOMOTION_MOUNTING_H_
#define STRATA_CORE_EGOMOTION_MOUNTING_H_

#include "absl/status/statusor.h"
#include <Eigen/Geometry>

#include "core/egomotion/motion_log.h"
#include "core/egomotion/rig.h"

namespace strata {

// R_body_imu: the body's z is where the mean specific force of the whole log points, its x where
// forward accelerations and those towards the middle of curves fit wheels and gyroscope best.
// FAILED_PRECONDITION without wheels, or where they moved too evenly to tell; names the cure.
absl::StatusOr<Eigen::Quaterniond> FindMounting(const MotionLog& log, const Rig& rig);

}  // namespace strata

#endif  // STRATA_CORE_EGOMOTION_MOUNTING_H_
