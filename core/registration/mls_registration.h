// Registration of local MLS maps (thesis 7.2.3, eq. 7.9): finds where a new scan belongs, given
// roughly where it is.
//
//   const ScanFeatures source = ScanFeatures::FromMap(local_map);
//   const RegistrationTarget target(placed, {.centre = T_target_source_guess.translation()});
//   const RegistrationResult r = RegisterScan(source, target, T_target_source_guess, {});
//   if (r.converged()) …
#ifndef STRATA_CORE_REGISTRATION_MLS_REGISTRATION_H_
#define STRATA_CORE_REGISTRATION_MLS_REGISTRATION_H_

#include "absl/status/status.h"

#include "core/geometry/pose.h"
#include "core/registration/registration_result.h"
#include "core/registration/registration_target.h"
#include "core/registration/scan_features.h"

namespace strata {

enum class MlsErrorMetric {
  // Distances weighed by the surfaces on both sides (generalised ICP, Segal, Haehnel, Thrun 2009),
  // over the source's sample: fast, and slides freely along surfaces.
  kPlaneToPlane,
  // The thesis' metric: squared distances of feature points, closed form (eq. 7.1–7.9).
  kPointToPoint,
};

struct MlsRegistrationOptions {
  MlsErrorMetric metric = MlsErrorMetric::kPlaneToPlane;
  // A feature is matched to the nearest one of its class closer than the gate. The gate shrinks
  // from the first to the last value by `gate_factor` an iteration. The first must exceed the
  // guess's error where the features are; the last decides what is an outlier and what overlap
  // means. In (0, 100], last ≤ first.
  double initial_gate_m = 2.0;
  double final_gate_m = 0.5;
  double gate_factor = 0.6;  // in [0.1, 1)
  int max_iterations = 30;   // in [1, 1000]
  // Source features used until the gate is narrow and steps are small, and then. kPointToPoint uses
  // `max_samples` alone, or all features when it is 0. In [0, 1000000].
  int coarse_samples = 500;
  int max_samples = 2000;
  // Converged once the last step is below both.
  double rotation_tolerance_rad = 2e-4;
  double translation_tolerance_m = 1e-3;
  // Noise of a surface along its normal and reach of a feature within it [m]; in (0, 10]. A shorter
  // reach draws what slides to where the scans overlap most (docs/decisions/0253).
  double normal_sigma_m = 0.03;
  double tangent_sigma_m = 0.5;
  // Cauchy kernel on residuals in units of their σ: larger ones count less; in (0, 1e6].
  double robust_width = 3.0;
  double min_overlap = 0.3;  // smaller: kTooLittleOverlap; in [0, 1]
  int min_inliers = 30;      // fewer: kTooLittleOverlap; in [6, 1000000]
  // Farther from the guess: kDiverged.
  double max_translation_m = 5.0;
  double max_rotation_rad = 0.5;
  double min_eigenvalue_ratio = 1e-3;  // see SolveNormalEquations; in [0, 1]
  // For kPlaneToPlane: a direction that a smaller share of the features holds, or no more than
  // normals that err as much as these may by chance, is left as guessed. What is seen all around a
  // sensor moves with it: floors slide to where they overlap most. 0 for an object seen from
  // outside, whose overlap is right. In [0, 1].
  double min_hold = 0.0025;
  // For kPlaneToPlane: the guess is one more measurement, with these σ of each direction. Where
  // many features hold one that is nothing; where few do, they are often false. 0, either: it is
  // none. In [0, 1000].
  double guess_sigma_m = 0.0;
  double guess_sigma_rad = 0.0;
  // Target side of the surface elements, as ScanFeatureOptions has them for the source.
  int neighbours = 16;
  double neighbour_radius_m = 1.5;

  // INVALID_ARGUMENT naming every field out of its range.
  absl::Status Validate() const;
};

// Moves `source` onto `target`, starting at the guess. `options` must be valid. Deterministic,
// holds no state, safe to call from several threads. Frames may be anywhere: the work is done
// relative to the target's origin. A guess that is not finite answers kDiverged.
RegistrationResult RegisterScan(const ScanFeatures& source,
                                const RegistrationTarget& target,
                                const Pose& T_target_source_guess,
                                const MlsRegistrationOptions& options = {});

}  // namespace strata

#endif  // STRATA_CORE_REGISTRATION_MLS_REGISTRATION_H_
