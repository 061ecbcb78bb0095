// Second moments of points, the sums from which planes are fitted: Σ w p̃p̃ᵀ with p̃ = (x, y, z, 1).
// They add, and moving the points by T gives T M Tᵀ.
#ifndef STRATA_CORE_PLANES_MOMENTS_H_
#define STRATA_CORE_PLANES_MOMENTS_H_

#include <Eigen/Core>

#include "core/geometry/pose.h"
#include "core/geometry/primitives.h"

namespace strata {

struct MomentsFit {
  Plane plane;                   // through `mean`; the sign of the normal is arbitrary
  Eigen::Vector3d mean;          // weighted
  Eigen::Vector3d eigenvalues;   // of the weighted covariance, ascending, ≥ 0 [m²]
  Eigen::Matrix3d eigenvectors;  // in columns, in the same order; column 0 is the plane's normal
};

// The plane of least mean squared distance (thesis 2.6.1). REQUIRES: a positive total weight.
MomentsFit FitMoments(const Eigen::Matrix4d& moments);

// Moments of points of total weight `weight` with this mean and covariance.
Eigen::Matrix4d MomentsOf(double weight,
                          const Eigen::Vector3d& mean,
                          const Eigen::Matrix3d& covariance);

// The moments of the points moved by T.
Eigen::Matrix4d Moved(const Pose& T, const Eigen::Matrix4d& moments);

// Root of the weighted mean squared distance of the points to the plane [m].
double RmsDistance(const Eigen::Matrix4d& moments, const Plane& plane);

}  // namespace strata

#endif  // STRATA_CORE_PLANES_MOMENTS_H_
