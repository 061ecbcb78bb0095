#include "core/world/localization.h"

#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::strata::testing::StatusIs;
using ::testing::HasSubstr;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

LocalizeQuery Good() {
  LocalizeQuery query;
  query.cloud.points = {{1, 2, 3}, {4, 5, 6}};
  query.T_map_scan_guess = Pose::Identity();
  query.sensor = SensorModel();
  return query;
}

void ExpectRefused(const LocalizeQuery& query, const char* what) {
  EXPECT_THAT(ValidateLocalizeQuery(query),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr(what)));
}

TEST(LocalizationTest, AGoodQueryPasses) {
  STRATA_EXPECT_OK(ValidateLocalizeQuery(Good()));
  LocalizeQuery bare;
  bare.cloud.points = {{1, 2, 3}};
  STRATA_EXPECT_OK(ValidateLocalizeQuery(bare));
  STRATA_EXPECT_OK(ValidateLocalizeGuess(LocalizeQuery()));  // the points come later
}

TEST(LocalizationTest, WhatIsWrongIsNamed) {
  for (const double radius_m : {0.0, -1.0, 10'001.0, kNan}) {
    LocalizeQuery query = Good();
    query.guess_radius_m = radius_m;
    ExpectRefused(query, "guess_radius_m");
  }
  LocalizeQuery query = Good();
  query.T_map_scan_guess->translation().z() = kNan;
  ExpectRefused(query, "guess: ");
  query = Good();
  query.sensor->sigma_m = -1.0;
  ExpectRefused(query, "sigma_m");
  query = Good();
  query.cloud.sensor_origin.x() = 2e6F;
  ExpectRefused(query, "sensor_origin");
  query = Good();
  query.cloud.points.clear();
  ExpectRefused(query, "no points");
  query = Good();
  query.cloud.points[1].y() = std::numeric_limits<float>::infinity();
  ExpectRefused(query, "point 1");
  query = Good();
  query.cloud.origin.x() = 500'000.0;
  ExpectRefused(query, "origin");
}

}  // namespace
}  // namespace strata
