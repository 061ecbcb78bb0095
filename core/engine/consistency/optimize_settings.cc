#include "core/engine/consistency/optimize_settings.h"

#include <string>

#include "core/common/status.h"
#include "core/engine/map/job_parameters.h"

namespace strata {
namespace {

ReadParameter WeightingName(Weighting& to) {
  return [&to](const std::string& text) {
    to = text == "local_global" ? Weighting::kLocalGlobal : Weighting::kCovariance;
    return text == "local_global" || text == "covariance";
  };
}

KnownParameters ParametersOf(OptimizeSettings& settings) {
  return {
      {"dry_run", {FlagParameter(settings.dry_run), "0 or 1"}},
      {"closures", {FlagParameter(settings.closures), "0 or 1"}},
      {"planes", {FlagParameter(settings.planes), "0 or 1"}},
      {"robust", {FlagParameter(settings.robust), "0 or 1"}},
      {"rounds", {WholeParameter(settings.rounds, 1, 20), "in [1, 20]"}},
      {"pool", {WholeParameter(settings.pool, 1, 50), "in [1, 50]"}},
      {"weighting", {WeightingName(settings.weighting), "covariance or local_global"}},
      {"local_weight", {RealParameter(settings.local_weight, 1e-6, 1.0 - 1e-6), "in (0, 1)"}},
      {"tolerance_m", {RealParameter(settings.tolerance.translation_m, 0.0, 1.0), "in [0, 1]"}},
      {"tolerance_rad", {RealParameter(settings.tolerance.rotation_rad, 0.0, 1.0), "in [0, 1]"}},
      {"threads", {WholeParameter(settings.threads, 1, 64), "in [1, 64]"}},
      {"automatic", {FlagParameter(settings.automatic), "0 or 1"}}};
}

}  // namespace

absl::StatusOr<OptimizeSettings> ParseOptimizeSettings(const JobParameters& parameters) {
  OptimizeSettings settings;
  STRATA_RETURN_IF_ERROR(ReadJobParameters(kOptimizeJob, parameters, ParametersOf(settings)));
  return settings;
}

}  // namespace strata
