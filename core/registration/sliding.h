// Surfaces slide along themselves without being noticed: what a scan of nearly nothing but a floor
// says about where on the floor it is.
// Internal to core/registration, not installed.
#ifndef STRATA_CORE_REGISTRATION_SLIDING_H_
#define STRATA_CORE_REGISTRATION_SLIDING_H_

#include "core/geometry/pose.h"

namespace strata {

struct NormalEquations {
  Matrix6d H = Matrix6d::Zero();
  Vector6d b = Vector6d::Zero();
};

// Leaves out the directions that hardly any surface holds. `H_across` is what surfaces hold across
// themselves. What features have along theirs is in `all.H`, too: it steadies a registration that
// surfaces hold in every direction, but where they hold it in none it is all that is left, looks
// certain as it is a sum of thousands, and pulls towards where the scans overlap most. Directions
// are the eigenvectors of `H_across`, rotations weighed as the arc at `radius_m`; one is left out
// if its eigenvalue is below `least` (Zhang, Kaess, Singh, "On degeneracy of optimization-based
// state estimation problems", ICRA 2016).
NormalEquations WithoutSliding(const NormalEquations& all,
                               const Matrix6d& H_across,
                               double least,
                               double radius_m);

// The share of `matches` matches that hold a direction by chance only: three times what is expected
// of the products of two normals' errors, their mean square lean from each other being
// `squared_lean` (sin², of two directions on two sides). 0 where there are no matches. Where a scan
// is far off its pairs are of two surfaces, which says nothing of errors: it is at most 0.015.
double FeignedHold(double squared_lean, int matches);

}  // namespace strata

#endif  // STRATA_CORE_REGISTRATION_SLIDING_H_
