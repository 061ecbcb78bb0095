#include "core/world/map_info.h"

#include <cmath>
#include <numbers>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

#include "core/cloud/sensor_model.h"
#include "core/common/status.h"
#include "core/mls/mls_parameters.h"
#include "core/world/robot_profile.h"

namespace strata {

absl::Status ValidateMapParameters(const MapParameters& parameters) {
  STRATA_RETURN_IF_ERROR(ValidateMlsParameters(parameters.mls));
  STRATA_RETURN_IF_ERROR(ValidateSensorModel(parameters.sensor));
  STRATA_RETURN_IF_ERROR(ValidateRobotProfile(parameters.default_profile));
  if (parameters.fade_after > kMaxFadeAfter) {
    return absl::InvalidArgumentError(absl::StrCat(
        "fade_after = ", parameters.fade_after, " scans is not in [0, ", kMaxFadeAfter, "]"));
  }
  if (parameters.fade_after > 0 && !parameters.keep_points) {
    return absl::InvalidArgumentError(
        absl::StrCat("fade_after = ",
                     parameters.fade_after,
                     " needs keep_points: what has faded is told by the rays of scans"));
  }
  return parameters.origin.has_value() ? ValidateGeodeticOrigin(*parameters.origin)
                                       : absl::OkStatus();
}

absl::Status ValidateGeodeticOrigin(const GeodeticOrigin& origin) {
  if (std::abs(origin.latitude_rad) <= std::numbers::pi / 2 &&
      std::abs(origin.longitude_rad) <= std::numbers::pi && std::abs(origin.altitude_m) <= 1e5) {
    return absl::OkStatus();
  }
  constexpr double kDegrees = 180.0 / std::numbers::pi;
  return absl::InvalidArgumentError(absl::StrCat("origin: latitude ",
                                                 origin.latitude_rad * kDegrees,
                                                 "°, longitude ",
                                                 origin.longitude_rad * kDegrees,
                                                 "°, altitude ",
                                                 origin.altitude_m,
                                                 " m is not on earth; latitudes are in [-90°, "
                                                 "90°], longitudes in [-180°, 180°]"));
}

}  // namespace strata
