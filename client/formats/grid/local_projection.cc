#include "client/formats/grid/local_projection.h"

#include <cmath>
#include <numbers>

#include "absl/strings/str_format.h"

#include "core/egomotion/geodesy.h"

namespace strata {

LocalProjection::LocalProjection(const GeodeticOrigin& origin) : altitude_m_(origin.altitude_m) {
  constexpr double kDegreesPerRad = 180.0 / std::numbers::pi;
  const auto [east_m, north_m] = CurvatureAt(origin.latitude_rad);
  latitude_deg_ = origin.latitude_rad * kDegreesPerRad;
  longitude_deg_ = origin.longitude_rad * kDegreesPerRad;
  scale_ = 1.0 + altitude_m_ / std::sqrt(east_m * north_m);
  east_radius_m_ = east_m + altitude_m_;
  north_radius_m_ = north_m + altitude_m_;
}

double LocalProjection::EllipsoidHeight(const Eigen::Vector3d& p_map) const {
  return altitude_m_ + p_map.z() + p_map.x() * p_map.x() / (2.0 * east_radius_m_) +
         p_map.y() * p_map.y() / (2.0 * north_radius_m_);
}

std::string LocalProjection::Wkt() const {
  return absl::StrFormat(R"(PROJCS["Strata_map",GEOGCS["GCS_WGS_1984",DATUM["D_WGS_1984",)"
                         R"(SPHEROID["WGS_1984",%.1f,%.9f]],PRIMEM["Greenwich",0.0],)"
                         R"(UNIT["Degree",0.0174532925199433]],PROJECTION["Transverse_Mercator"],)"
                         R"(PARAMETER["False_Easting",0.0],PARAMETER["False_Northing",0.0],)"
                         R"(PARAMETER["Central_Meridian",%.15g],PARAMETER["Scale_Factor",%.15g],)"
                         R"(PARAMETER["Latitude_Of_Origin",%.15g],UNIT["Meter",1.0]])",
                         EquatorRadiusM(),
                         1.0 / EarthFlattening(),
                         longitude_deg_,
                         scale_,
                         latitude_deg_);
}

}  // namespace strata
