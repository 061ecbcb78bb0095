// What an optimize job is told to do.
#ifndef STRATA_CORE_ENGINE_CONSISTENCY_OPTIMIZE_SETTINGS_H_
#define STRATA_CORE_ENGINE_CONSISTENCY_OPTIMIZE_SETTINGS_H_

#include "core/engine/ingest/pose_change.h"
#include "core/posegraph/pose_graph.h"
#include "core/world/job_arguments.h"

namespace strata {

// Parameters of kOptimizeJob by the same names, where bounds and defaults stand
// (core/world/job_kinds.h).
struct OptimizeSettings {
  explicit OptimizeSettings(const JobArguments& arguments);

  bool dry_run;     // propose only
  bool closures;    // look for closures nobody has tried
  bool planes;      // hold planes against all scans that see them
  bool directions;  // turn scans alike by the directions that walls face in; needs planes
  bool robust;      // closures may turn out to be false
  int rounds;       // of correspondences and planes from the current poses
  int pool;         // consecutive scans of a pooled local map
  Weighting weighting;
  double local_weight;      // of local_global
  MoveTolerance tolerance;  // tolerance_m, tolerance_rad
};

// What holds where nobody says anything.
OptimizeSettings DefaultOptimizeSettings();

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_CONSISTENCY_OPTIMIZE_SETTINGS_H_
