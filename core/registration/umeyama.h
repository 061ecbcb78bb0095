// The rigid transform between two sets of corresponding points (thesis 7.2.1; Umeyama 1991).
#ifndef STRATA_CORE_REGISTRATION_UMEYAMA_H_
#define STRATA_CORE_REGISTRATION_UMEYAMA_H_

#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/geometry/pose.h"

namespace strata {

// How far the points x spread; it decides how much of a rotation they determine.
enum class PointSpread {
  kVolume,     // everything determined
  kPlane,      // everything determined; the sign S of eq. 7.8 excludes the mirror image
  kLine,       // rotation about the line is not: the smallest one that fits is taken
  kPoint,      // translation only: the rotation is the identity
  kNothing,    // no point of positive weight: the identity
};

struct UmeyamaResult {
  Pose T_y_x = Pose::Identity();  // minimises Σ w ‖y − T x‖² (eq. 7.1)
  PointSpread spread = PointSpread::kNothing;
  double rms_m = 0.0;  // √(Σ w ‖y − T x‖² / Σ w)
  // Undetermined right-hand steps on T_y_x, [rotation, translation], unit length: three rotations
  // about a point, one about a line, six for nothing.
  std::vector<Vector6d> degenerate_directions;
};

// `weights` is empty (all 1) or as long as the others, ≥ 0. REQUIRES: x and y of equal length and
// finite. Needs no initial guess; never answers a reflection.
UmeyamaResult FitRigidTransform(std::span<const Eigen::Vector3d> x,
                                std::span<const Eigen::Vector3d> y,
                                std::span<const double> weights = {});

// Information of a right-hand step on T when points `x` are matched with isotropic noise `sigma_m`:
// Σ JᵀJ / σ², J = [−[x]ₓ, I].
Matrix6d PointInformation(std::span<const Eigen::Vector3d> x, double sigma_m);

}  // namespace strata

#endif  // STRATA_CORE_REGISTRATION_UMEYAMA_H_
