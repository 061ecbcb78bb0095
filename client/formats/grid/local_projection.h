// Where on earth the coordinates of a map are that has an origin there.
#ifndef STRATA_CLIENT_FORMATS_GRID_LOCAL_PROJECTION_H_
#define STRATA_CLIENT_FORMATS_GRID_LOCAL_PROJECTION_H_

#include <string>

#include <Eigen/Core>

#include "core/world/map_info.h"

namespace strata {

// A map's x and y, east and north on the plane that touches the earth at its origin, as the
// coordinates of a transverse Mercator projection of WGS 84: central meridian and latitude are the
// origin's, so that grid north is the map's y; the scale there is 1 + altitude / radius, so that
// lengths are those of the map and not of the ellipsoid below. 10 km from the origin the two are
// 7 mm apart; for what lies z above the origin z / 6371 km of the distance comes on top.
class LocalProjection {
 public:
  explicit LocalProjection(const GeodeticOrigin& origin);

  double latitude_deg() const { return latitude_deg_; }
  double longitude_deg() const { return longitude_deg_; }
  double scale() const { return scale_; }

  // Height above the ellipsoid of a place in the map [m]: within a millimetre up to 20 km from the
  // origin. The earth falls away from the plane, by 8 cm at 1 km.
  double EllipsoidHeight(const Eigen::Vector3d& p_map) const;

  // As a .prj file has it: ESRI's WKT.
  std::string Wkt() const;

 private:
  double latitude_deg_;
  double longitude_deg_;
  double scale_;
  double altitude_m_;
  double east_radius_m_;  // of curvature, at the origin's height
  double north_radius_m_;
};

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_GRID_LOCAL_PROJECTION_H_
