#include "client/cli/terminal/on_earth.h"

#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include <Eigen/Core>

#include "client/cli/terminal/arguments.h"
#include "core/common/status.h"

namespace strata::cli {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;

double Rounded(double value, double steps) { return std::round(value * steps) / steps; }

}  // namespace

absl::StatusOr<std::optional<LocalFrame>> EarthOf(Context& context, const std::string& map) {
  STRATA_ASSIGN_OR_RETURN(const MapInfo info, context.database.maps().Get(context.call, map));
  std::optional<LocalFrame> earth;
  if (info.parameters.origin.has_value()) earth.emplace(*info.parameters.origin);
  return earth;
}

Json ToJson(const GeodeticOrigin& place) {
  return {Rounded(place.latitude_rad * kDegrees, 1e9),
          Rounded(place.longitude_rad * kDegrees, 1e9),
          Rounded(place.altitude_m, 1e4)};
}

Json PlaceOnEarth(const LocalFrame& earth, const Eigen::Vector3d& p_map) {
  return ToJson(earth.ToEarth(p_map));
}

void AddPlaceOnEarth(const LocalFrame& earth, const Eigen::Vector3d& p_map, Json& json) {
  const Json place = PlaceOnEarth(earth, p_map);
  json["latitude"] = place[0];
  json["longitude"] = place[1];
  json["altitude"] = place[2];
}

CLI::Option* AddOrigin(CLI::App* app,
                       std::optional<GeodeticOrigin>& origin,
                       const std::string& description) {
  const auto set = [&origin](const std::vector<double>& n) {
    origin = GeodeticOrigin{n[0] / kDegrees, n[1] / kDegrees, n[2]};
  };
  return AddNumbers(app, "--origin", "LAT,LON,ALT", 3, 3, set, description);
}

}  // namespace strata::cli
