#include "client/formats/planes/geodetic_position.h"

#include <cmath>
#include <numbers>

#include <Eigen/Core>

#include "client/formats/grid/wgs84.h"

namespace strata {
namespace {

constexpr double kEquatorM = wgs84::kSemiMajorAxisM;
constexpr double kPoleM = kEquatorM * (1.0 - wgs84::kFlattening);
constexpr double kFirst2 = wgs84::kEccentricity2;
constexpr double kSecond2 = kFirst2 / (1.0 - kFirst2);  // the second eccentricity, squared

// From the middle of the earth.
Eigen::Vector3d EarthPosition(const GeodeticOrigin& origin, const Eigen::Vector3d& p_map) {
  const double sin_lat = std::sin(origin.latitude_rad), cos_lat = std::cos(origin.latitude_rad);
  const double sin_lon = std::sin(origin.longitude_rad), cos_lon = std::cos(origin.longitude_rad);
  const Eigen::Vector3d east(-sin_lon, cos_lon, 0.0);
  const Eigen::Vector3d north(-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat);
  const Eigen::Vector3d up(cos_lat * cos_lon, cos_lat * sin_lon, sin_lat);
  const double n = kEquatorM / std::sqrt(1.0 - kFirst2 * sin_lat * sin_lat);
  return n * Eigen::Vector3d(up.x(), up.y(), (1.0 - kFirst2) * up.z()) + p_map.x() * east +
         p_map.y() * north + (origin.altitude_m + p_map.z()) * up;
}

}  // namespace

Eigen::Vector3d GeodeticPosition(const GeodeticOrigin& origin, const Eigen::Vector3d& p_map) {
  const Eigen::Vector3d p = EarthPosition(origin, p_map);
  const double r = std::hypot(p.x(), p.y());
  double beta = std::atan2(p.z() * kEquatorM, r * kPoleM);
  double latitude = 0.0;
  for (int i = 0; i < 2; ++i) {
    latitude = std::atan2(p.z() + kSecond2 * kPoleM * std::pow(std::sin(beta), 3),
                          r - kFirst2 * kEquatorM * std::pow(std::cos(beta), 3));
    beta = std::atan2((1.0 - wgs84::kFlattening) * std::sin(latitude), std::cos(latitude));
  }
  const double sine = std::sin(latitude);
  const double height =
      r * std::cos(latitude) + p.z() * sine - kEquatorM * std::sqrt(1.0 - kFirst2 * sine * sine);
  constexpr double kDegrees = 180.0 / std::numbers::pi;
  return {std::atan2(p.y(), p.x()) * kDegrees, latitude * kDegrees, height};
}

}  // namespace strata
