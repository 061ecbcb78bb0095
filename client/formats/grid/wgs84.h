// The ellipsoid that stands for the earth (WGS 84, NGA.STND.0036: its two defining lengths).
#ifndef STRATA_CLIENT_FORMATS_GRID_WGS84_H_
#define STRATA_CLIENT_FORMATS_GRID_WGS84_H_

namespace strata::wgs84 {

inline constexpr double kSemiMajorAxisM = 6378137.0;
inline constexpr double kInverseFlattening = 298.257223563;

inline constexpr double kFlattening = 1.0 / kInverseFlattening;
inline constexpr double kEccentricity2 = kFlattening * (2.0 - kFlattening);  // the first, squared

}  // namespace strata::wgs84

#endif  // STRATA_CLIENT_FORMATS_GRID_WGS84_H_
