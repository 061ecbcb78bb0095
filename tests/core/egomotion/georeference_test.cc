#include "core/egomotion/georeference.h"

#include <cmath>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/egomotion/geodesy.h"
#include "tests/support/simulator/simulator.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::strata::testing::StatusIs;
using ::testing::HasSubstr;

const GeodeticOrigin kRun = {0.82, 0.14, 400.0};

// A way of 200 m that a map has shifted, turned and with errors of `sigma_m`.
std::vector<SeenTwice> Way(const Eigen::Vector3d& shift, double turn_rad, double sigma_m) {
  testing::Random random(5);
  std::vector<SeenTwice> places;
  for (int i = 0; i < 100; ++i) {
    SeenTwice& place = places.emplace_back();
    place.p_run = {100.0 * std::sin(0.06 * i), 100.0 * std::sin(0.12 * i), 0.1 * i};
    const Eigen::AngleAxisd turn(turn_rad, Eigen::Vector3d::UnitZ());
    place.p_map = turn * place.p_run + shift;
    for (double& number : place.p_map) number += sigma_m * random.Gaussian();
  }
  return places;
}

// Any place of the map is where the run has it.
TEST(GeoreferenceTest, TheOriginIsWhereTheWaySaysItIs) {
  const Eigen::Vector3d shift(120.0, -40.0, 7.0);
  STRATA_ASSERT_OK_AND_ASSIGN(const Georeference fit, FitOrigin(kRun, Way(shift, 0.0, 0.2)));
  EXPECT_EQ(fit.places, 100U);
  EXPECT_NEAR(fit.rms_m, 0.28, 0.05);
  EXPECT_NEAR(fit.turn_rad, 0.0, 0.005);
  const Eigen::Vector3d p_run(30.0, 50.0, 2.0);
  const GeodeticOrigin at = LocalFrame(kRun).ToEarth(p_run);
  const Eigen::Vector3d p_map = LocalFrame(fit.origin).ToMap(at);
  EXPECT_LT((p_map - p_run - shift).norm(), 0.1);
}

TEST(GeoreferenceTest, WithoutPlacesTheFrameIsTheRuns) {
  STRATA_ASSERT_OK_AND_ASSIGN(const Georeference fit, FitOrigin(kRun, {}));
  EXPECT_EQ(fit.origin, kRun);
  STRATA_ASSERT_OK_AND_ASSIGN(const Georeference one,
                              FitOrigin(kRun, {{{1.0, 2.0, 3.0}, {1.0, 2.0, 3.0}}}));
  EXPECT_NEAR(one.origin.latitude_rad, kRun.latitude_rad, 1e-12);
}

TEST(GeoreferenceTest, AMapThatIsTurnedIsRefused) {
  EXPECT_THAT(FitOrigin(kRun, Way({0.0, 0.0, 0.0}, 0.4, 0.2)),
              StatusIs(absl::StatusCode::kFailedPrecondition,
                       HasSubstr("turned by 22.9 degrees against east and north")));
  // So little is an error of the way's.
  STRATA_EXPECT_OK(FitOrigin(kRun, Way({0.0, 0.0, 0.0}, -0.03, 0.2)));
}

}  // namespace
}  // namespace strata
