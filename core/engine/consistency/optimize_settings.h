// What an optimize job is told to do.
#ifndef STRATA_CORE_ENGINE_CONSISTENCY_OPTIMIZE_SETTINGS_H_
#define STRATA_CORE_ENGINE_CONSISTENCY_OPTIMIZE_SETTINGS_H_

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/engine/ingest/pose_change.h"
#include "core/posegraph/pose_graph.h"
#include "core/world/job.h"

namespace strata {

inline constexpr absl::string_view kOptimizeJob = "optimize";

// Parameters of the job by the same names; a flag is 0 or 1.
struct OptimizeSettings {
  bool dry_run = false;  // propose only
  bool closures = true;  // look for closures nobody has tried
  bool planes = true;    // hold planes against all scans that see them
  bool robust = true;    // closures may turn out to be false
  int rounds = 5;        // of correspondences and planes from the current poses; [1, 20]
  int pool = 5;          // consecutive scans of a pooled local map; [1, 50]
  Weighting weighting = Weighting::kCovariance;  // "covariance" or "local_global"
  double local_weight = 0.5;                     // of local_global; (0, 1)
  MoveTolerance tolerance;                       // tolerance_m, tolerance_rad; [0, 1]
  int threads = 0;                               // [1, 64]; 0: the engine's
  // Tells people that nobody asked for the job: a closure was verified.
  bool automatic = false;
};

// INVALID_ARGUMENT naming the parameter, its value and what it may be.
absl::StatusOr<OptimizeSettings> ParseOptimizeSettings(const JobParameters& parameters);

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_CONSISTENCY_OPTIMIZE_SETTINGS_H_
