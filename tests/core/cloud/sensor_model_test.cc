#include "core/cloud/sensor_model.h"

#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::StatusIs;

TEST(SensorModelTest, SigmaGrowsLinearlyWithRange) {
  const SensorModel model = {.sigma_m = 0.02, .sigma_per_metre = 0.001};
  EXPECT_DOUBLE_EQ(model.SigmaAt(0.0), 0.02);
  EXPECT_DOUBLE_EQ(model.SigmaAt(30.0), 0.05);
}

TEST(SensorModelTest, BoundsAreInclusive) {
  STRATA_EXPECT_OK(ValidateSensorModel({}));
  STRATA_EXPECT_OK(ValidateSensorModel({.sigma_m = 0.0005, .sigma_per_metre = 0.0}));
  STRATA_EXPECT_OK(ValidateSensorModel(
      {.sigma_m = 10.0, .sigma_per_metre = 1.0, .min_range_m = 5.0, .max_range_m = 5.0}));
}

TEST(SensorModelTest, EveryFaultIsNamed) {
  EXPECT_THAT(ValidateSensorModel({.sigma_m = 0.0, .sigma_per_metre = -1.0}),
              StatusIs(absl::StatusCode::kInvalidArgument,
                       AllOf(HasSubstr("sigma_m = 0 is not in [0.0005, 10]"),
                             HasSubstr("sigma_per_metre = -1 is not in [0, 1]"))));
  EXPECT_THAT(ValidateSensorModel({.min_range_m = 9.0, .max_range_m = 8.0}),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("max_range_m = 8")));
  EXPECT_THAT(ValidateSensorModel({.sigma_m = std::numeric_limits<double>::quiet_NaN()}),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("sigma_m = nan")));
}

}  // namespace
}  // namespace strata
