// Which fixes a filter believes. A gate alone locks out every fix once the state is wrong: those it
// rejects are kept, and where they agree among themselves against the state, the state moves.
#ifndef STRATA_CORE_EGOMOTION_GPS_GATE_H_
#define STRATA_CORE_EGOMOTION_GPS_GATE_H_

#include <cstddef>
#include <deque>
#include <optional>

#include <Eigen/Core>

#include "core/egomotion/information_filter.h"

namespace strata {

// χ² of 2 degrees of freedom that one good fix in a thousand exceeds. Fixes are judged by where
// they are on the ground: a receiver's altitude wanders by ten metres while its place is good.
inline constexpr double kGpsGateNis = 13.82;
// The same of 1. An altitude beyond it is not rejected: it counts with the σ that brings it there.
inline constexpr double kAltitudeNis = 10.83;

struct RejectedFix {
  double time_s = 0.0;
  Eigen::Vector3d measured_m = Eigen::Vector3d::Zero();   // the antenna in the map
  Eigen::Vector3d predicted_m = Eigen::Vector3d::Zero();  // where the state had it then
  Eigen::Vector3d sigma_m = Eigen::Vector3d::Ones();
};

class GpsGate {
 public:
  // Fixes that must agree, and for how long: what a wall reflects seldom lasts longer.
  static constexpr std::size_t kAgreeing = 8;
  static constexpr double kAgreeingS = 10.0;

  // A fix was believed: the ones before were wrong.
  void Accept() { rejected_.clear(); }

  // A fix was not believed. Those of the last 2 · kAgreeingS decide: where the way between them is
  // the state's, moved and if need be turned, by their own horizontal χ² of 99 %, that move is the
  // answer and the gate begins anew.
  std::optional<Relocation> Reject(const RejectedFix& fix);

 private:
  std::deque<RejectedFix> rejected_;
};

}  // namespace strata

#endif  // STRATA_CORE_EGOMOTION_GPS_GATE_H_
