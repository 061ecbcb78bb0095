// Places of a map as latitude and longitude, where the map is on earth.
#ifndef STRATA_CLIENT_CLI_TERMINAL_ON_EARTH_H_
#define STRATA_CLIENT_CLI_TERMINAL_ON_EARTH_H_

#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include <Eigen/Core>

#include "client/cli/terminal/command.h"
#include "client/cli/terminal/output.h"
#include "core/egomotion/geodesy.h"

namespace strata::cli {

// nullopt for a map without an origin.
absl::StatusOr<std::optional<LocalFrame>> EarthOf(Context& context, const std::string& map);

// Adds latitude, longitude [degrees, nine decimals: 0.1 mm] and altitude above the ellipsoid [m] of
// a place in the map.
void AddPlaceOnEarth(const LocalFrame& earth, const Eigen::Vector3d& p_map, Json& json);

// [latitude, longitude, altitude].
Json PlaceOnEarth(const LocalFrame& earth, const Eigen::Vector3d& p_map);
Json ToJson(const GeodeticOrigin& place);

// Adds an option LAT,LON,ALT [degrees, degrees, m].
CLI::Option* AddOrigin(CLI::App* app,
                       std::optional<GeodeticOrigin>& origin,
                       const std::string& description);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_TERMINAL_ON_EARTH_H_
