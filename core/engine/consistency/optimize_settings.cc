#include "core/engine/consistency/optimize_settings.h"

#include "core/world/job_kinds.h"

namespace strata {

OptimizeSettings::OptimizeSettings(const JobArguments& arguments)
    : dry_run(arguments.Flag("dry_run")),
      closures(arguments.Flag("closures")),
      planes(arguments.Flag("planes")),
      directions(arguments.Flag("directions")),
      robust(arguments.Flag("robust")),
      rounds(arguments.Whole("rounds")),
      pool(arguments.Whole("pool")),
      weighting(arguments.Text("weighting") == "local_global" ? Weighting::kLocalGlobal
                                                              : Weighting::kCovariance),
      local_weight(arguments.Real("local_weight")),
      tolerance{.translation_m = arguments.Real("tolerance_m"),
                .rotation_rad = arguments.Real("tolerance_rad")} {}

OptimizeSettings DefaultOptimizeSettings() {
  return OptimizeSettings(ReadJobArguments(kOptimizeJob, {}).value());
}

}  // namespace strata
