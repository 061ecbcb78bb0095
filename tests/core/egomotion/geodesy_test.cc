#include "core/egomotion/geodesy.h"

#include <cmath>

#include <Eigen/Core>
#include <gtest/gtest.h>

#include "tests/support/simulator/simulator.h"

namespace strata {
namespace {

// From the middle of the earth, by the definition of WGS 84.
Eigen::Vector3d Ecef(const GeodeticOrigin& place) {
  constexpr double kEquatorM = 6378137.0, kFlattening = 1.0 / 298.257223563;
  constexpr double kE2 = kFlattening * (2.0 - kFlattening);
  const double sine = std::sin(place.latitude_rad), cosine = std::cos(place.latitude_rad);
  const double n = kEquatorM / std::sqrt(1.0 - kE2 * sine * sine);
  const double r = (n + place.altitude_m) * cosine;
  return {r * std::cos(place.longitude_rad),
          r * std::sin(place.longitude_rad),
          (n * (1.0 - kE2) + place.altitude_m) * sine};
}

// East, north, up as differences of places a little apart.
Eigen::Matrix3d Axes(const GeodeticOrigin& origin) {
  constexpr double kStep = 1e-5;
  const auto direction = [&](double lat, double lon, double alt) {
    const GeodeticOrigin after = {
        origin.latitude_rad + lat, origin.longitude_rad + lon, origin.altitude_m + alt};
    const GeodeticOrigin before = {
        origin.latitude_rad - lat, origin.longitude_rad - lon, origin.altitude_m - alt};
    return Eigen::Vector3d((Ecef(after) - Ecef(before)).normalized());
  };
  Eigen::Matrix3d axes;
  axes << direction(0, kStep, 0), direction(kStep, 0, 0), direction(0, 0, 1.0);
  return axes;
}

TEST(GeodesyTest, MapsLieOnThePlaneThatTouchesTheEarth) {
  testing::Random random(3);
  for (int i = 0; i < 50; ++i) {
    const double latitude = random.Uniform(-1.5, 1.5), longitude = random.Uniform(-3.0, 3.0);
    const GeodeticOrigin origin = {latitude, longitude, random.Uniform(-50.0, 3000.0)};
    const double north = random.Uniform(-0.001, 0.001), east = random.Uniform(-0.001, 0.001);
    const GeodeticOrigin place = {latitude + north, longitude + east, random.Uniform(0.0, 500.0)};
    const LocalFrame frame(origin);
    const Eigen::Vector3d p = frame.ToMap(place);
    const Eigen::Vector3d expected = Axes(origin).transpose() * (Ecef(place) - Ecef(origin));
    EXPECT_LT((p - expected).norm(), 1e-5) << i;
    const GeodeticOrigin back = frame.ToEarth(p);
    EXPECT_NEAR(back.latitude_rad, place.latitude_rad, 1e-14);
    EXPECT_NEAR(back.longitude_rad, place.longitude_rad, 1e-13);
    EXPECT_NEAR(back.altitude_m, place.altitude_m, 1e-7);
  }
}

// By arcs of a millimetre's accuracy: a step to the north or the east on the ellipsoid.
TEST(GeodesyTest, RadiiOfCurvatureAreThoseOfArcs) {
  for (const double latitude : {-1.5, -0.6, 0.0, 0.8}) {
    constexpr double kStep = 1e-4;
    const Eigen::Vector3d here = Ecef({latitude, 0.0, 0.0});
    const auto [east_m, north_m] = CurvatureAt(latitude);
    const double north = (Ecef({latitude + kStep, 0.0, 0.0}) - here).norm() / kStep;
    const double east = (Ecef({latitude, kStep, 0.0}) - here).norm() / kStep / std::cos(latitude);
    EXPECT_NEAR(north_m / north, 1.0, 1e-5);
    EXPECT_NEAR(east_m / east, 1.0, 1e-6);
  }
  EXPECT_NEAR(EquatorRadiusM() * (1.0 - EarthFlattening()), 6356752.314245, 1e-6);
}

}  // namespace
}  // namespace strata
