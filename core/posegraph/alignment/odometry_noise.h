// How good the motions are that a robot uploads, learned from what registration says of them.
#ifndef STRATA_CORE_POSEGRAPH_ALIGNMENT_ODOMETRY_NOISE_H_
#define STRATA_CORE_POSEGRAPH_ALIGNMENT_ODOMETRY_NOISE_H_

#include <optional>
#include <span>

#include "core/geometry/pose.h"

namespace strata {

// Standard deviations of one step along one axis, as of independent errors.
struct OdometryNoise {
  double sigma_rad = 0.0;
  double sigma_m = 0.0;
};

// A robot that restarts its odometry, or is carried, says nothing of that step: its error is no
// noise. Six standard deviations of ordinary steps, and more than what registration believes
// unverified.
bool IsJump(const Pose& error, const OdometryNoise& noise);

// `errors`: of every step in the order of the way, T_i_j as uploaded to T_i_j as registered,
// T_said⁻¹ T_measured; nullopt where nothing was measured. The error of ten steps in a row counts
// as well as that of one: a robot that always turns a little too little errs by much in the end.
// What registration errs is part of the result, so that it is rather too large. Jumps do not count,
// and end what is summed. nullopt for fewer than thirty steps.
std::optional<OdometryNoise> EstimateOdometryNoise(std::span<const std::optional<Pose>> errors);

}  // namespace strata

#endif  // STRATA_CORE_POSEGRAPH_ALIGNMENT_ODOMETRY_NOISE_H_
