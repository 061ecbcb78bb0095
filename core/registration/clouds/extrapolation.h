// Longer steps for ICP along a steady direction (Besl and McKay 1992, thesis 7.2.2).
// Internal to core/registration, not installed.
#ifndef STRATA_CORE_REGISTRATION_CLOUDS_EXTRAPOLATION_H_
#define STRATA_CORE_REGISTRATION_CLOUDS_EXTRAPOLATION_H_

#include <vector>

#include "core/geometry/pose.h"

namespace strata {

// Remembers the last steps and the mean squared errors they led to.
class StepExtrapolator {
 public:
  // `quadratic` uses a parabola through the last three errors where it has a minimum ahead, a line
  // through the last two otherwise. No extrapolation is longer than `max_factor` last steps.
  // Rotations count as the arc they cause at `radius_m`.
  StepExtrapolator(bool quadratic, double max_factor, double radius_m);

  // What to add after `step`, which led to `mean_squared_error`: zero until the last steps (two for
  // a line, three for a parabola) point the same way to 10° and the error falls.
  Vector6d Extend(const Vector6d& step, double mean_squared_error);

 private:
  bool quadratic_;
  double max_factor_;
  Vector6d scale_ = Vector6d::Ones();
  std::vector<Vector6d> steps_;  // scaled, oldest first, at most three
  std::vector<double> errors_;
};

}  // namespace strata

#endif  // STRATA_CORE_REGISTRATION_CLOUDS_EXTRAPOLATION_H_
