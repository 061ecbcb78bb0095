#include "core/planes/moments.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Core>

#include "core/geometry/eigen_solvers.h"
#include "core/geometry/pose.h"
#include "core/geometry/primitives.h"

namespace strata {

MomentsFit FitMoments(const Eigen::Matrix4d& moments) {
  const double weight = moments(3, 3);
  MomentsFit fit;
  fit.mean = moments.topRightCorner<3, 1>() / weight;
  const Eigen::Matrix3d covariance =
      moments.topLeftCorner<3, 3>() / weight - fit.mean * fit.mean.transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance);
  fit.eigenvalues = solver.eigenvalues().cwiseMax(0.0);
  fit.eigenvectors = solver.eigenvectors();
  fit.plane.normal = fit.eigenvectors.col(0);
  fit.plane.distance = fit.plane.normal.dot(fit.mean);
  return fit;
}

Eigen::Matrix4d MomentsOf(double weight,
                          const Eigen::Vector3d& mean,
                          const Eigen::Matrix3d& covariance) {
  Eigen::Matrix4d moments;
  moments.topLeftCorner<3, 3>() = weight * (covariance + mean * mean.transpose());
  moments.topRightCorner<3, 1>() = weight * mean;
  moments.bottomLeftCorner<1, 3>() = weight * mean.transpose();
  moments(3, 3) = weight;
  return moments;
}

Eigen::Matrix4d Moved(const Pose& T, const Eigen::Matrix4d& moments) {
  return T.matrix() * moments * T.matrix().transpose();
}

double RmsDistance(const Eigen::Matrix4d& moments, const Plane& plane) {
  Eigen::Vector4d pi;
  pi << plane.normal, -plane.distance;
  return std::sqrt(std::max(0.0, pi.dot(moments * pi)) / moments(3, 3));
}

}  // namespace strata
