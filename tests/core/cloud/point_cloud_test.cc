#include "core/cloud/point_cloud.h"

#include <cstdint>
#include <functional>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::testing::HasSubstr;
using testing::StatusIs;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

PointCloud ThreePoints() {
  PointCloud cloud;
  cloud.points = {{0, 0, 0}, {1, 2, 3}, {-1e6F, 1e6F, 0}};
  return cloud;
}

TEST(PointCloudTest, PlainAndFullCloudsAreValid) {
  STRATA_EXPECT_OK(ValidateCloud(PointCloud()));
  PointCloud cloud = ThreePoints();
  STRATA_EXPECT_OK(ValidateCloud(cloud));
  cloud.origin = {5e6, 3e5, 100.0};
  cloud.intensity = {1, 2, 3};
  cloud.colour.resize(3);
  cloud.label = {0, 7, 65535};
  cloud.rows = 1;
  cloud.columns = 3;
  STRATA_EXPECT_OK(ValidateCloud(cloud));
  EXPECT_EQ(CountFinite(cloud), 3U);
}

TEST(PointCloudTest, FaultsAreNamed) {
  const auto refused = [](const std::function<void(PointCloud&)>& spoil, const char* why) {
    PointCloud cloud = ThreePoints();
    spoil(cloud);
    EXPECT_THAT(ValidateCloud(cloud), StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr(why)));
  };
  refused([](PointCloud& c) { c.intensity = {1}; }, "intensity has 1 entries for 3 points");
  refused([](PointCloud& c) { c.colour.resize(4); }, "colour has 4 entries");
  refused([](PointCloud& c) { c.label.resize(2); }, "label has 2 entries");
  refused(
      [](PointCloud& c) {
        c.rows = 2;
        c.columns = 2;
      },
      "grid of 2 × 2 does not hold 3");
  refused([](PointCloud& c) { c.columns = 3; }, "grid of 0 × 3");
  refused([](PointCloud& c) { c.rows = 3; }, "grid of 3 × 0");
  // 2³² rows · columns overflow 32 bits to 0.
  refused([](PointCloud& c) { c.rows = c.columns = 1U << 16; }, "grid of 65536 × 65536");
  refused([](PointCloud& c) { c.origin.x() = kNan; }, "origin");
  refused([](PointCloud& c) { c.sensor_origin.z() = kInfinity; }, "origin");
  refused([](PointCloud& c) { c.points[1].y() = kNan; }, "point 1 (1, nan, 3)");
  refused([](PointCloud& c) { c.points[0].z() = -kInfinity; }, "point 0");
  refused([](PointCloud& c) { c.points[2].x() = 1.1e6F; }, "point 2");
  refused([](PointCloud& c) { c.points[0] = {kNan, kNan, kNan}; }, "point 0");
}

TEST(PointCloudTest, OrganisedCloudHoldsPixelsWithoutReturn) {
  PointCloud cloud = ThreePoints();
  cloud.rows = 3;
  cloud.columns = 1;
  cloud.points[1] = {kNan, kNan, kNan};
  STRATA_EXPECT_OK(ValidateCloud(cloud));
  EXPECT_EQ(CountFinite(cloud), 2U);
  cloud.points[1].x() = 0.0F;  // half a return is none
  EXPECT_THAT(ValidateCloud(cloud),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("point 1")));
}

}  // namespace
}  // namespace strata
