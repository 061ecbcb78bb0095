// The distances of points of a scan to a plane that moves too (thesis 7.19).
// Internal to core/posegraph, not installed.
#ifndef STRATA_CORE_POSEGRAPH_COSTS_PLANE_COST_H_
#define STRATA_CORE_POSEGRAPH_COSTS_PLANE_COST_H_

#include <Eigen/Core>

#include "core/geometry/pose.h"
#include "core/geometry/primitives.h"
#include "core/posegraph/pose_graph.h"

namespace strata {

// A plane n · (x − centre) = height about a centre near its points: far from the map's origin,
// turning n · x = d would move it far away.
class MovingPlane {
 public:
  MovingPlane() = default;
  MovingPlane(const Plane& plane_map, const Eigen::Vector3d& centre);

  // Steps are [two turns of the normal, height].
  MovingPlane Retracted(const Eigen::Vector3d& step) const;
  Plane plane() const;

  const Eigen::Vector3d& normal() const { return normal_; }
  const Eigen::Vector3d& centre() const { return centre_; }
  double height() const { return height_; }
  // Two unit vectors across the normal.
  const Eigen::Matrix<double, 3, 2>& tangents() const { return tangents_; }

 private:
  void SetNormal(const Eigen::Vector3d& normal);

  Eigen::Vector3d normal_ = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d centre_ = Eigen::Vector3d::Zero();
  Eigen::Matrix<double, 3, 2> tangents_ = Eigen::Matrix<double, 3, 2>::Zero();
  double height_ = 0.0;
};

// Three directions that stand for the scatter of a view's points and their mean, all times the
// square root of their weight.
struct PlaneView {
  Eigen::Matrix<double, 3, 4> points;  // the last column is the mean
  double weight = 0.0;                 // square root of Σ w
};
// REQUIRES: `moments` positive semidefinite.
PlaneView SummariseView(const PointMoments& moments);

double PlaneViewCost(const PlaneView& view, const Pose& T, const MovingPlane& plane);

struct PlaneViewDerivatives {
  // Gauss–Newton blocks and JᵀΩe by a right-hand step on T and by a step of the plane.
  Matrix6d poses;
  Eigen::Matrix<double, 6, 3> mixed;
  Eigen::Matrix3d planes;
  Vector6d gradient_pose;
  Eigen::Vector3d gradient_plane;
};
PlaneViewDerivatives DifferentiatePlaneView(const PlaneView& view,
                                            const Pose& T,
                                            const MovingPlane& plane);

}  // namespace strata

#endif  // STRATA_CORE_POSEGRAPH_COSTS_PLANE_COST_H_
