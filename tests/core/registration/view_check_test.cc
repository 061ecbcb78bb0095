#include "core/registration/view_check.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/mls/build.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

// A round wall 10 m away over the azimuths [from, to), between 20° below and above the sensor.
ScanFeatures RoundWall(double from_rad, double to_rad) {
  std::array<std::vector<Vector3f>, kFeatureClasses> points;
  for (double azimuth = from_rad; azimuth < to_rad; azimuth += 0.01) {
    for (double elevation = -0.35; elevation < 0.35; elevation += 0.01) {
      points[static_cast<std::size_t>(FeatureClass::kVertical)].push_back(
          (10.0 * Vector3d(std::cos(elevation) * std::cos(azimuth),
                           std::cos(elevation) * std::sin(azimuth),
                           std::sin(elevation)))
              .cast<float>());
    }
  }
  return ScanFeatures::FromPoints(std::move(points));
}

constexpr double kPi = std::numbers::pi;

TEST(ViewImageTest, TellsWhatIsThereFromWhatIsSeenThroughAndHidden) {
  const ViewImage image(RoundWall(-kPi, kPi), Vector3d::Zero());
  EXPECT_EQ(image.At({10.0F, 0.0F, 0.5F}), Sight::kAgreeing);
  EXPECT_EQ(image.At({-6.9F, -6.9F, 0.5F}), Sight::kAgreeing);
  EXPECT_EQ(image.At({5.0F, 0.0F, 0.5F}), Sight::kSeenThrough);
  EXPECT_EQ(image.At({15.0F, 0.0F, 0.5F}), Sight::kUnknown) << "behind the wall";
  EXPECT_EQ(image.At({0.5F, 0.0F, 0.0F}), Sight::kUnknown) << "at the sensor";
  EXPECT_EQ(image.At({0.0F, 0.0F, 8.0F}), Sight::kUnknown) << "above where it looked";
}

TEST(ViewImageTest, LooksFromWhereTheSensorWas) {
  const ViewImage image(RoundWall(-kPi, kPi), {4.0, 0.0, 0.0});
  EXPECT_EQ(image.At({10.0F, 0.0F, 0.0F}), Sight::kAgreeing);
  EXPECT_EQ(image.At({-10.0F, 0.0F, 0.0F}), Sight::kAgreeing);
  EXPECT_EQ(image.At({4.0F, 5.0F, 0.0F}), Sight::kSeenThrough);
}

TEST(ViewImageTest, NothingComesBackOnlyWhereASensorLooks) {
  // A sensor that turns, with posts around and a gap ahead.
  const ViewImage around(RoundWall(0.2, 2.0 * kPi - 0.2), Vector3d::Zero());
  EXPECT_EQ(around.At({6.0F, 0.0F, 0.5F}), Sight::kUnknown) << "no beam is known to go there";
  std::array<std::vector<Vector3f>, kFeatureClasses> points;
  const ScanFeatures walls = RoundWall(0.2, 2.0 * kPi - 0.2);
  points[static_cast<std::size_t>(FeatureClass::kVertical)] = walls.points(FeatureClass::kVertical);
  for (float y = -2.0F; y < 2.0F; y += 0.02F) {  // the road in the gap
    for (float x = 4.0F; x < 9.0F; x += 0.05F) {
      points[static_cast<std::size_t>(FeatureClass::kTraversable)].emplace_back(x, y, -1.5F);
    }
  }
  const ViewImage road(ScanFeatures::FromPoints(std::move(points)), Vector3d::Zero());
  EXPECT_EQ(road.At({6.0F, 0.0F, 1.0F}), Sight::kNoReturn);
  EXPECT_EQ(road.At({25.0F, 0.0F, 1.0F}), Sight::kUnknown) << "far things may not answer";
  // One that looks ahead only may just not have looked.
  const ViewImage ahead(RoundWall(-0.5, 0.5), Vector3d::Zero());
  EXPECT_EQ(ahead.At({0.0F, 10.0F, 0.0F}), Sight::kUnknown);
}

// Rings of a sensor 1.2 m above level ground, 4° from one to the next.
TEST(ViewImageTest, BeamsThatPassAboveGroundLookThroughNothing) {
  std::array<std::vector<Vector3f>, kFeatureClasses> points;
  for (double down = 0.02; down < 0.7; down += 0.07) {
    for (double azimuth = -kPi; azimuth < kPi; azimuth += 0.01) {
      const double range = 1.2 / std::tan(down);
      points[static_cast<std::size_t>(FeatureClass::kTraversable)].push_back(
          Vector3d(range * std::cos(azimuth), range * std::sin(azimuth), -1.2).cast<float>());
    }
  }
  const ViewImage image(ScanFeatures::FromPoints(std::move(points)), Vector3d::Zero());
  for (float range = 3.0F; range < 30.0F; range += 0.1F) {
    EXPECT_NE(image.At({range, 0.0F, -1.2F}, true), Sight::kSeenThrough) << range;
  }
  EXPECT_EQ(image.At({2.5F, 0.0F, -0.225F}, true), Sight::kSeenThrough) << "a table";
  EXPECT_EQ(image.At({15.0F, 0.0F, -0.3F}), Sight::kSeenThrough) << "a wall";
}

// What may be a ceiling is no feature, and stops beams all the same.
TEST(ViewImageTest, NothingIsSeenThroughWhatIsDoubtful) {
  PointCloud room;
  for (float y = -3.0F; y < 3.0F; y += 0.1F) {
    for (float x = -3.0F; x < 3.0F; x += 0.1F) {
      room.points.emplace_back(x, y, 0.0F);
      room.points.emplace_back(x, y, 2.5F);
    }
  }
  constexpr float kFar = 8.05F;  // too few there to tell the side of
  for (int i = 0; i < 20; ++i) {
    for (float y = -6.0F; y < 6.0F; y += 1.5F) {
      room.points.emplace_back(kFar + static_cast<float>(i), y, 2.5F);
    }
  }
  const absl::StatusOr<MlsBuildResult> local = BuildMlsMap(room, Pose::Identity(), {}, {});
  STRATA_ASSERT_OK(local);
  ScanFeatureOptions options;
  options.sensor_origin = {0.0, 0.0, 1.0};
  const ScanFeatures features = ScanFeatures::FromMap(local->map, options);
  ASSERT_GT(features.doubtful().size(), 50U);
  const ViewImage image(features, options.sensor_origin);
  for (const Vector3f& p : features.doubtful()) {
    EXPECT_EQ(image.At(p, true), Sight::kAgreeing) << p.transpose();
  }
}

TEST(ViewImageTest, WithoutFeaturesNothingIsKnown) {
  EXPECT_EQ(ViewImage().At({5.0F, 0.0F, 0.0F}), Sight::kUnknown);
  EXPECT_EQ(ViewImage(ScanFeatures(), Vector3d::Zero()).At({5.0F, 0.0F, 0.0F}), Sight::kUnknown);
  const float nan = std::nanf("");
  EXPECT_EQ(ViewImage(RoundWall(-kPi, kPi), Vector3d::Zero()).At({nan, 0.0F, 0.0F}),
            Sight::kUnknown);
}

}  // namespace
}  // namespace strata
