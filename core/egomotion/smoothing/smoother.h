// A filtered log once more, all of it at once: a pose knows what was measured after it, too.
#ifndef STRATA_CORE_EGOMOTION_SMOOTHING_SMOOTHER_H_
#define STRATA_CORE_EGOMOTION_SMOOTHING_SMOOTHER_H_

#include "absl/status/statusor.h"

#include "core/common/stop.h"
#include "core/egomotion/egomotion.h"
#include "core/egomotion/motion_log.h"
#include "core/egomotion/rig.h"

namespace strata {

// Least squares (Ceres) over a state every kNodeS: the IMU's relative motions (Forster et al.
// 2017), wheels, and all fixes, believed by Cauchy's loss: slow walks that no gate sees count less.
// Covariances by ceres::Covariance. In the report fixes are those within kGpsGateNis of the
// result; innovations are residuals and NIS is without the state's own uncertainty. Recoveries,
// gaps and the start are the filter's. The same log gives the same poses to the bit, and
// covariances but for rounding. REQUIRES: `filtered` is FilterLog() of the same log and rig.
// INTERNAL if the solver fails; CANCELLED or DEADLINE_EXCEEDED by `stop`.
inline constexpr double kNodeS = 0.5;
absl::StatusOr<Egomotion> SmoothLog(const MotionLog& log,
                                    const Rig& rig,
                                    const Egomotion& filtered,
                                    const Stop& stop = Stop());

}  // namespace strata

#endif  // STRATA_CORE_EGOMOTION_SMOOTHING_SMOOTHER_H_
