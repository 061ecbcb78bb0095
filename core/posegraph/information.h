// Information matrices of relative poses, [rotation, translation], of right-hand steps.
#ifndef STRATA_CORE_POSEGRAPH_INFORMATION_H_
#define STRATA_CORE_POSEGRAPH_INFORMATION_H_

#include "core/geometry/pose.h"

namespace strata {

// Information of independent errors, the same along every axis; both > 0.
Matrix6d IsotropicInformation(double sigma_rad, double sigma_m);

// (information⁻¹ + extra⁻¹)⁻¹: an error of its own and an `extra` one. `information` may be
// singular, `extra` not.
Matrix6d LoosenedInformation(const Matrix6d& information, const Matrix6d& extra);

// `other` in those directions alone of which `information` knows less than `share` times as much;
// zero if there is none. `information` may be singular, `other` not.
Matrix6d WhereLess(const Matrix6d& information, const Matrix6d& other, double share);

// The information [rotation, translation] of a right-hand step on T_i_j from that of g2o's
// EDGE_SE3:QUAT, [translation, vec q].
Matrix6d InformationFromG2o(const Matrix6d& information);
// Its inverse.
Matrix6d InformationToG2o(const Matrix6d& information);

}  // namespace strata

#endif  // STRATA_CORE_POSEGRAPH_INFORMATION_H_
