#include "core/egomotion/geodesy.h"

#include <numbers>

#include <Eigen/Core>
#include <GeographicLib/Ellipsoid.hpp>

namespace strata {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;

}  // namespace

CurvatureRadii CurvatureAt(double latitude_rad) {
  const GeographicLib::Ellipsoid& earth = GeographicLib::Ellipsoid::WGS84();
  return {earth.TransverseCurvatureRadius(latitude_rad * kDegrees),
          earth.MeridionalCurvatureRadius(latitude_rad * kDegrees)};
}

LocalFrame::LocalFrame(const GeodeticOrigin& origin)
    : origin_(origin),
      frame_(origin.latitude_rad * kDegrees, origin.longitude_rad * kDegrees, origin.altitude_m) {}

Eigen::Vector3d LocalFrame::ToMap(const GeodeticOrigin& place) const {
  Eigen::Vector3d p;
  frame_.Forward(place.latitude_rad * kDegrees,
                 place.longitude_rad * kDegrees,
                 place.altitude_m,
                 p.x(),
                 p.y(),
                 p.z());
  return p;
}

GeodeticOrigin LocalFrame::ToEarth(const Eigen::Vector3d& p_map) const {
  double latitude_deg = 0.0, longitude_deg = 0.0, altitude_m = 0.0;
  frame_.Reverse(p_map.x(), p_map.y(), p_map.z(), latitude_deg, longitude_deg, altitude_m);
  return {latitude_deg / kDegrees, longitude_deg / kDegrees, altitude_m};
}

}  // namespace strata
