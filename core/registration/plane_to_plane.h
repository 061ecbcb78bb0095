// One linearisation of the plane-to-plane error between a scan's sample and a target: the inner
// part of RegisterScan.
// Internal to core/registration, not installed.
#ifndef STRATA_CORE_REGISTRATION_PLANE_TO_PLANE_H_
#define STRATA_CORE_REGISTRATION_PLANE_TO_PLANE_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "core/geometry/pose.h"
#include "core/registration/column_grid.h"
#include "core/registration/registration_target.h"
#include "core/registration/scan_features.h"

namespace strata {

struct MlsRegistrationOptions;

// Sums over the matches of one iteration.
struct PlaneToPlaneSums {
  Matrix6d H = Matrix6d::Zero();  // Σ w JᵀMJ
  Vector6d b = Vector6d::Zero();  // Σ w JᵀM r
  // Σ w JᵀNJ / 2σn², N the symmetric part of ±n_p n_qᵀ: what surfaces hold across themselves where
  // both sides say so. Normals that only err are not of one mind: they hold nothing on average.
  Matrix6d H_across = Matrix6d::Zero();
  double squared_lean = 0.0;         // Σ sin²(n_p, n_q) over matches with both
  int leans = 0;                     // those
  double weight = 0.0;               // Σ w
  double squared_error = 0.0;        // Σ w rᵀM r
  double squared_distance_m2 = 0.0;  // Σ (distance along the normal)²
  double squared_radius_m2 = 0.0;    // Σ |p|², p in the scan frame
  int selected = 0;
  int inliers = 0;
};

// A match pairs p (scan frame) with q (target). With r = T⁻¹q − p and a right-hand step
// T·Exp([ω, v]) its error is rᵀM r, its Jacobian J = [−[p]ₓ, I], and
//   M = (C_p + Rᵀ C_q R)⁻¹,   C = σt² I − (σt² − σn²) n nᵀ
// with n the normal of the surface element, so that a surface is known to σn across and to σt
// along. A line that a beam drew has no normal and takes that of the other side; two of them, what
// may be a line on a wall, and two surfaces that lean 60° to each other (the end of a corridor that
// comes into view beside the walls where they ended) count as overlap and pull nowhere.
class PlaneToPlaneMatcher {
 public:
  // Keeps references.
  PlaneToPlaneMatcher(const ScanFeatures& source,
                      const RegistrationTarget& target,
                      const MlsRegistrationOptions& options);

  // `fine` uses `max_samples`, otherwise `coarse_samples`. Two sides of a thin wall are no match:
  // of a target that is one scan by where it was seen from, otherwise by FaceTowards(). Normals of
  // the target are computed at its first match and kept.
  PlaneToPlaneSums Linearise(const Pose& T_target_source, double gate_m, bool fine);

 private:
  // The nearest feature of the class and closer than the gate, or kNone.
  std::uint32_t Match(std::size_t sample, const Eigen::Vector3f& p_target, float gate_m, bool fine);
  // A scan at `sensor` sees a surface with this normal there.
  struct TargetSurface {
    SurfaceElement element;
    bool is_other_face = false;
  };
  const TargetSurface& SurfaceAt(FeatureClass c,
                                 std::uint32_t index,
                                 const Eigen::Vector3f& sensor,
                                 const Eigen::Vector3f& normal);

  const ScanFeatures& source_;
  const RegistrationTarget& target_;
  const MlsRegistrationOptions& options_;
  std::array<std::vector<std::uint32_t>, kFeatureClasses> element_index_;  // 0: not computed yet
  std::vector<TargetSurface> surfaces_;
  struct KnownMatch {
    Eigen::Vector3f p_target = Eigen::Vector3f::Zero();  // it was looked up for
    ColumnGrid::SlackMatch match;
  };
  std::vector<KnownMatch> known_;  // of the sample; the last iterations hardly move
};

}  // namespace strata

#endif  // STRATA_CORE_REGISTRATION_PLANE_TO_PLANE_H_
