// Places on earth in the frame of a map: x east, y north, z up at an origin on WGS 84.
#ifndef STRATA_CORE_EGOMOTION_GEODESY_H_
#define STRATA_CORE_EGOMOTION_GEODESY_H_

#include <Eigen/Core>
#include <GeographicLib/Constants.hpp>
#include <GeographicLib/LocalCartesian.hpp>

#include "core/world/map_info.h"

namespace strata {

// The ellipsoid that stands for the earth.
inline double EquatorRadiusM() { return GeographicLib::Constants::WGS84_a(); }
inline double EarthFlattening() { return GeographicLib::Constants::WGS84_f(); }

// Of the ellipsoid's curvature at a latitude.
struct CurvatureRadii {
  double east_m = 0.0;
  double north_m = 0.0;
};
CurvatureRadii CurvatureAt(double latitude_rad);

// By GeographicLib::LocalCartesian, exact to nanometres.
class LocalFrame {
 public:
  explicit LocalFrame(const GeodeticOrigin& origin);

  const GeodeticOrigin& origin() const { return origin_; }
  Eigen::Vector3d ToMap(const GeodeticOrigin& place) const;
  GeodeticOrigin ToEarth(const Eigen::Vector3d& p_map) const;

 private:
  GeodeticOrigin origin_;
  GeographicLib::LocalCartesian frame_;
};

}  // namespace strata

#endif  // STRATA_CORE_EGOMOTION_GEODESY_H_
