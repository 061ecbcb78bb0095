// How the solver moves poses and planes. Internal to core/posegraph, not installed.
//
// Costs differentiate by steps, not by the numbers of a block (see WritePoseJacobian): the
// PlusJacobian() of poses is the identity, below it zeros. Nobody asks for Minus() to solve.
#ifndef STRATA_CORE_POSEGRAPH_SOLVER_MANIFOLDS_H_
#define STRATA_CORE_POSEGRAPH_SOLVER_MANIFOLDS_H_

#include <ceres/manifold.h>
#include <ceres/problem.h>

namespace strata {

// Options of a problem that leaves manifolds to their owner.
ceres::Problem::Options KeepingManifolds();

class SteppedManifold : public ceres::Manifold {
 public:
  bool Minus(const double* y, const double* x, double* step) const final;
  bool MinusJacobian(const double* x, double* jacobian) const final;
};

// A PoseBlock moved along the screw with the right-hand step [rotation, translation] as its
// velocity. To first order it is Retract(); but steps that turn all poses about one axis turn them
// as one body, however far, so that a map that swings about a single anchor does not strain its
// relative poses.
class PoseManifold final : public SteppedManifold {
 public:
  int AmbientSize() const override { return 7; }
  int TangentSize() const override { return 6; }
  bool Plus(const double* x, const double* step, double* moved) const override;
  bool PlusJacobian(const double* x, double* jacobian) const override;
};

// A PlanarPose, by Moved().
class PlanarPoseManifold final : public SteppedManifold {
 public:
  int AmbientSize() const override { return 3; }
  int TangentSize() const override { return 3; }
  bool Plus(const double* x, const double* step, double* moved) const override;
  bool PlusJacobian(const double* x, double* jacobian) const override;
};

// A PlaneBlock by [two turns of the normal, height], with the true Jacobian.
class PlaneManifold final : public SteppedManifold {
 public:
  int AmbientSize() const override { return 4; }
  int TangentSize() const override { return 3; }
  bool Plus(const double* x, const double* step, double* moved) const override;
  bool PlusJacobian(const double* x, double* jacobian) const override;
};

}  // namespace strata

#endif  // STRATA_CORE_POSEGRAPH_SOLVER_MANIFOLDS_H_
