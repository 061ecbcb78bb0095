// The Iterative Closest Point algorithm on plain point sets (thesis Alg. 3) with the choices of
// 7.2.2 (Rusinkiewicz and Levoy 2001), put together of PCL's parts. For local maps use
// mls_registration.h: it is faster and drifts less; this one takes any points.
#ifndef STRATA_CORE_REGISTRATION_CLOUDS_ICP_H_
#define STRATA_CORE_REGISTRATION_CLOUDS_ICP_H_

#include <cstdint>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/cloud/point_cloud.h"
#include "core/geometry/pose.h"
#include "core/registration/registration_result.h"

namespace strata {

enum class IcpSelection {
  kAll,
  kEveryNth,  // evenly along the order of the points
  kRandom,    // one out of each of `max_points` equal stretches, by `seed`
};

enum class IcpMatching {
  kClosestPoint,  // exact
  // The point whose direction from the target's sensor falls into the same cell of a spherical
  // image of the target (and, while that is empty, of the eight around it): constant time, needs a
  // target seen from one place.
  kProjection,
};

enum class IcpWeighting {
  kUniform,
  kDistance,            // 1 − distance / gate
  kNormalCompatibility  // |n_source · n_target|
};

enum class IcpMetric {
  kPointToPoint,
  kPointToPlane,
  // Generalised ICP (Segal, Haehnel, Thrun 2009), which has its own selection (all), matching
  // (closest points), weighting and steps.
  kPlaneToPlane
};

// Longer steps while the last ones point the same way; see extrapolation.h.
enum class IcpExtrapolation { kNone, kLinear, kQuadratic };

struct IcpOptions {
  IcpSelection selection = IcpSelection::kAll;
  int max_points = 5000;   // kEveryNth, kRandom; in [3, 10⁸]
  std::uint64_t seed = 1;  // kRandom
  IcpMatching matching = IcpMatching::kClosestPoint;
  double projection_cell_rad = 0.007;  // of the spherical image; in [0.001, 0.5]
  IcpWeighting weighting = IcpWeighting::kUniform;
  IcpMetric metric = IcpMetric::kPointToPoint;
  IcpExtrapolation extrapolation = IcpExtrapolation::kNone;
  double max_extrapolation = 5.0;  // in [0, 100]

  double max_distance_m = 1.0;  // farther pairs are rejected; in (0, 10⁴]
  // Share of the pairs left that is kept, the closest ones (trimmed ICP); in (0, 1].
  double keep_share = 1.0;
  // Keep only pairs that are each other's closest points; not with kProjection.
  bool mutual = false;
  // Pairs whose normals, towards their sensors, meet at a larger angle are rejected; in (0, π], π
  // rejects none.
  double max_normal_angle_rad = 3.141592653589793;
  int normal_neighbours = 10;  // that span a normal; in [3, 64]

  int max_iterations = 50;  // in [1, 10000]
  // Converged once the last step is below both.
  double rotation_tolerance_rad = 1e-5;
  double translation_tolerance_m = 1e-4;
  double min_overlap = 0.1;  // kept pairs / selected points; less is kTooLittleOverlap; in [0, 1]
  // Farther from the guess: kDiverged.
  double max_translation_m = 100.0;
  double max_rotation_rad = 3.15;
  double min_eigenvalue_ratio = 1e-4;  // see SolveNormalEquations

  // INVALID_ARGUMENT naming every field out of its range.
  absl::Status Validate() const;
};

// Moves `source` onto `target`, starting at the guess. Points that are not finite are ignored, the
// clouds' double origins are taken into account: T_target_source maps origin + point to origin +
// point. Distances are those of floats, 0.01 mm at 100 m. Deterministic; safe to call from several
// threads. INVALID_ARGUMENT for invalid options or a guess that is no pose; everything else is an
// outcome.
absl::StatusOr<RegistrationResult> RegisterClouds(const PointCloud& source,
                                                  const PointCloud& target,
                                                  const Pose& T_target_source_guess,
                                                  const IcpOptions& options = {});

}  // namespace strata

#endif  // STRATA_CORE_REGISTRATION_CLOUDS_ICP_H_
