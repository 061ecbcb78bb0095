#include "core/world/localization.h"

#include "absl/strings/str_cat.h"

#include "core/common/status.h"

namespace strata {

absl::Status ValidateLocalizeGuess(const LocalizeQuery& query) {
  if (query.sensor.has_value()) {
    STRATA_RETURN_IF_ERROR(Annotate(ValidateSensorModel(*query.sensor), "sensor"));
  }
  if (query.T_map_scan_guess.has_value()) {
    STRATA_RETURN_IF_ERROR(Annotate(ValidatePose(*query.T_map_scan_guess), "guess"));
  }
  // The negated comparison also catches NaN.
  if (!(query.guess_radius_m > 0.0 && query.guess_radius_m <= kMaxGuessRadiusM)) {
    return absl::InvalidArgumentError(absl::StrCat(
        "guess_radius_m = ", query.guess_radius_m, " is not in (0, ", kMaxGuessRadiusM, "]"));
  }
  if (!(query.cloud.sensor_origin.cwiseAbs().maxCoeff<Eigen::PropagateNaN>() <= 1e6F)) {
    return absl::InvalidArgumentError("sensor_origin is not within ±1e6 m");
  }
  return absl::OkStatus();
}

absl::Status ValidateLocalizeQuery(const LocalizeQuery& query) {
  STRATA_RETURN_IF_ERROR(ValidateLocalizeGuess(query));
  if (query.cloud.points.empty()) return absl::InvalidArgumentError("the scan has no points");
  if (!query.cloud.origin.isZero(0.0)) {
    return absl::InvalidArgumentError("the cloud has an origin; fold it into guess and answer");
  }
  return ValidateCloud(query.cloud);
}

}  // namespace strata
