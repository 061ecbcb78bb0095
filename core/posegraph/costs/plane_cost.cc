#include "core/posegraph/costs/plane_cost.h"

#include <cmath>

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

namespace strata {
namespace {

constexpr int kMean = 3;

// The points in the map, about the plane's centre.
Eigen::Matrix<double, 3, 4> AboutCentre(const PlaneView& view,
                                        const Pose& T,
                                        const Eigen::Vector3d& centre) {
  Eigen::Matrix<double, 3, 4> x = T.linear() * view.points;
  x.col(kMean) += view.weight * (T.translation() - centre);
  return x;
}

Eigen::Vector4d Distances(const Eigen::Matrix<double, 3, 4>& x,
                          double weight,
                          const MovingPlane& plane) {
  Eigen::Vector4d distances = x.transpose() * plane.normal();
  distances[kMean] -= weight * plane.height();
  return distances;
}

}  // namespace

MovingPlane::MovingPlane(const Plane& plane_map, const Eigen::Vector3d& centre)
    : centre_(centre), height_(plane_map.distance - plane_map.normal.dot(centre)) {
  SetNormal(plane_map.normal);
}

void MovingPlane::SetNormal(const Eigen::Vector3d& normal) {
  normal_ = normal.normalized();
  tangents_.col(0) = normal_.unitOrthogonal();
  tangents_.col(1) = normal_.cross(tangents_.col(0));
}

MovingPlane MovingPlane::Retracted(const Eigen::Vector3d& step) const {
  MovingPlane result = *this;
  result.SetNormal(normal_ + tangents_ * step.head<2>());
  result.height_ += step[2];
  return result;
}

Plane MovingPlane::plane() const {
  return Plane{.normal = normal_, .distance = height_ + normal_.dot(centre_)};
}

PlaneView SummariseView(const PointMoments& moments) {
  PlaneView view;
  const double total = moments(3, 3);
  if (!(total > 0.0)) {
    view.points.setZero();
    return view;
  }
  const Eigen::Vector3d sum = moments.block<3, 1>(0, 3);
  const Eigen::Matrix3d scatter = moments.block<3, 3>(0, 0) - sum * sum.transpose() / total;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(scatter);
  view.weight = std::sqrt(total);
  view.points << eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal(),
      sum / view.weight;
  return view;
}

double PlaneViewCost(const PlaneView& view, const Pose& T, const MovingPlane& plane) {
  return Distances(AboutCentre(view, T, plane.centre()), view.weight, plane).squaredNorm();
}

PlaneViewDerivatives DifferentiatePlaneView(const PlaneView& view,
                                            const Pose& T,
                                            const MovingPlane& plane) {
  const Eigen::Matrix<double, 3, 4> x = AboutCentre(view, T, plane.centre());
  const Eigen::Vector4d e = Distances(x, view.weight, plane);
  const Eigen::Vector3d normal_scan = T.linear().transpose() * plane.normal();
  Eigen::Matrix<double, 4, 6> by_pose;
  Eigen::Matrix<double, 4, 3> by_plane;
  for (int k = 0; k <= kMean; ++k) {
    const double s = k == kMean ? view.weight : 0.0;
    by_pose.row(k) << view.points.col(k).cross(normal_scan).transpose(),
        s * normal_scan.transpose();
    by_plane.row(k) << x.col(k).transpose() * plane.tangents(), -s;
  }
  PlaneViewDerivatives result;
  result.poses.noalias() = by_pose.transpose() * by_pose;
  result.mixed.noalias() = by_pose.transpose() * by_plane;
  result.planes.noalias() = by_plane.transpose() * by_plane;
  result.gradient_pose.noalias() = by_pose.transpose() * e;
  result.gradient_plane.noalias() = by_plane.transpose() * e;
  return result;
}

}  // namespace strata
