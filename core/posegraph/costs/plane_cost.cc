#include "core/posegraph/costs/plane_cost.h"

#include <cmath>

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include "core/posegraph/costs/pose_block.h"

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
                          const double* plane_block) {
  Eigen::Vector4d distances = x.transpose() * Eigen::Map<const Eigen::Vector3d>(plane_block);
  distances[kMean] -= weight * plane_block[3];
  return distances;
}

}  // namespace

PlaneBlock PlaneBlockOf(const Plane& plane_map, const Eigen::Vector3d& centre) {
  const Eigen::Vector3d n = plane_map.normal.normalized();
  return {n.x(), n.y(), n.z(), plane_map.distance - plane_map.normal.dot(centre)};
}

Plane PlaneOf(const PlaneBlock& block, const Eigen::Vector3d& centre) {
  const Eigen::Vector3d normal(block[0], block[1], block[2]);
  return Plane{.normal = normal, .distance = block[3] + normal.dot(centre)};
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

Eigen::Vector4d PlaneViewDistances(const PlaneView& view,
                                   const Pose& T,
                                   const double* plane_block,
                                   const Eigen::Vector3d& centre) {
  return Distances(AboutCentre(view, T, centre), view.weight, plane_block);
}

PlaneViewCost::PlaneViewCost(const PlaneView& view, const Eigen::Vector3d& centre, double factor)
    : view_(view), centre_(centre), root_(std::sqrt(factor)) {}

bool PlaneViewCost::Evaluate(double const* const* blocks,
                             double* residuals,
                             double** jacobians) const {
  const Pose T = PoseOf(blocks[0]);
  const Eigen::Matrix<double, 3, 4> x = AboutCentre(view_, T, centre_);
  Eigen::Map<Eigen::Vector4d> weighted(residuals);
  weighted = root_ * Distances(x, view_.weight, blocks[1]);
  if (jacobians != nullptr && jacobians[0] != nullptr) {
    const Eigen::Vector3d normal_scan =
        T.linear().transpose() * Eigen::Map<const Eigen::Vector3d>(blocks[1]);
    Eigen::Matrix<double, 4, 6> by_pose;
    for (int k = 0; k <= kMean; ++k) {
      const double s = k == kMean ? view_.weight : 0.0;
      by_pose.row(k) << view_.points.col(k).cross(normal_scan).transpose(),
          s * normal_scan.transpose();
    }
    WritePoseJacobian(root_ * by_pose, jacobians[0]);
  }
  if (jacobians != nullptr && jacobians[1] != nullptr) {
    Eigen::Map<Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> by_plane(jacobians[1]);
    by_plane.leftCols<3>() = root_ * x.transpose();
    by_plane.col(3) << 0.0, 0.0, 0.0, -root_ * view_.weight;
  }
  return weighted.allFinite();
}

}  // namespace strata
