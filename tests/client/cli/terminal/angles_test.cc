#include "client/cli/terminal/angles.h"

#include <cmath>
#include <optional>

#include <gtest/gtest.h>

#include "client/cli/terminal/arguments.h"

namespace strata::cli {
namespace {

TEST(AnglesTest, DegreesAndRadians) {
  EXPECT_DOUBLE_EQ(ParseAngle("180deg").value(), std::acos(-1.0));
  EXPECT_DOUBLE_EQ(ParseAngle("-90°").value(), -std::asin(1.0));
  EXPECT_DOUBLE_EQ(ParseAngle("180").value(), std::acos(-1.0));
  EXPECT_DOUBLE_EQ(ParseAngle("0.35", AngleUnit::kRadians).value(), 0.35);
  EXPECT_DOUBLE_EQ(ParseAngle("180deg", AngleUnit::kRadians).value(), std::acos(-1.0));
  EXPECT_DOUBLE_EQ(ParseAngle(" 0.35 rad ").value(), 0.35);
  for (const char* text : {"", "deg", "20 degrees", "20grad", "nan", "inf", "1e400deg", "2,3"}) {
    EXPECT_FALSE(ParseAngle(text).has_value()) << text;
  }
}

TEST(AnglesTest, AnOptionHoldsRadiansWhateverIsSaid) {
  CLI::App app;
  std::optional<double> slope;
  TakesAngle(app.add_option("--slope", slope))->check(CLI::Range(0.0, 1.0));
  app.parse("--slope 45");
  EXPECT_EQ(slope.value(), std::atan(1.0));  // no digit is lost on the way
  EXPECT_THROW(app.parse("--slope 90deg"), CLI::ValidationError);
  EXPECT_THROW(app.parse("--slope steep"), CLI::ValidationError);
}

TEST(AnglesTest, TheTurnOfAPoseMayBeInDegrees) {
  CLI::App app;
  Pose pose = Pose::Identity();
  AddPose(
      &app, "--pose", [&pose](const Pose& set, std::size_t) { pose = set; }, "");
  app.parse("--pose 1,2,3,90");
  EXPECT_NEAR(pose.linear()(1, 0), 1.0, 1e-15);
  EXPECT_EQ(pose.translation().z(), 3.0);
  EXPECT_THROW(app.parse("--pose 1,2deg,3"), CLI::ValidationError);
}

}  // namespace
}  // namespace strata::cli
