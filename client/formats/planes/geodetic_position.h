// Where on earth a place of a map is.
#ifndef STRATA_CLIENT_FORMATS_PLANES_GEODETIC_POSITION_H_
#define STRATA_CLIENT_FORMATS_PLANES_GEODETIC_POSITION_H_

#include <Eigen/Core>

#include "core/world/map_info.h"

namespace strata {

// Longitude and latitude [degrees] and height above the ellipsoid [m] (WGS 84) of a place in a map
// whose x points east, y north and z up at its origin. Exact to 0.1 mm within 1000 km, by Bowring's
// method (Survey Review 1976), twice.
Eigen::Vector3d GeodeticPosition(const GeodeticOrigin& origin, const Eigen::Vector3d& p_map);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_PLANES_GEODETIC_POSITION_H_
