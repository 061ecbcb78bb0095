// Boxes around points with the vertical fixed.
#ifndef STRATA_CORE_COMPLETION_UPRIGHT_BOX_H_
#define STRATA_CORE_COMPLETION_UPRIGHT_BOX_H_

#include <span>

#include <Eigen/Core>

#include "core/world/things/entity.h"

namespace strata {

// The oriented box of thesis 11.2.1 (OBB) that stands upright: turned by the first principal
// component of the points in plan, or, where points are much nearer to the sides of a box that is
// turned otherwise, as that is: of two sides of a car principal components go from corner to
// corner. All zero without points.
UprightBox UprightBoxOf(std::span<const Eigen::Vector3d> points);

}  // namespace strata

#endif  // STRATA_CORE_COMPLETION_UPRIGHT_BOX_H_
