#include "core/registration/place_descriptor.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/common/random.h"
#include "core/mls/build.h"
#include "tests/core/registration/place_scans.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::testing::HasSubstr;
using testing::MapAt;
using testing::StandingAt;
using testing::StatusIs;

double HeadingError(double a, double b) {
  return std::abs(std::remainder(a - b, std::numbers::pi));
}

class PlaceDescriptorTest : public ::testing::Test {
 protected:
  PlaceDescriptor At(double x, double y, double heading, double tilt, std::uint64_t seed) const {
    return DescribePlace(
        MapAt(world_.scene, StandingAt(world_.scene, x, y, 50, heading, tilt), seed));
  }
  const testing::World world_ = testing::CampusWorld();
};

TEST_F(PlaceDescriptorTest, ComparedWithItselfThereIsNoDistance) {
  const PlaceDescriptor place = At(0, 0, 0, 0, 1);
  EXPECT_FALSE(place.empty());
  const PlaceSimilarity same = ComparePlaces(place, place);
  EXPECT_NEAR(same.distance, 0.0, 1e-12);
  EXPECT_EQ(same.heading_rad, 0.0);
  EXPECT_EQ(place, At(0, 0, 0, 0, 1)) << "a pure function";
}

TEST_F(PlaceDescriptorTest, ATurnedShiftedAndTiltedVisitIsNearerThanOtherPlaces) {
  const PlaceDescriptor first = At(0, 0, 0.3, 0, 1);
  double nearest_elsewhere = 2.0;
  for (const double x : {-90.0, -60.0, 60.0, 90.0}) {
    const PlaceSimilarity s = ComparePlaces(first, At(x, 0, 0, 0, 2));
    nearest_elsewhere = std::min(nearest_elsewhere, s.distance);
  }
  for (const double turn : {0.0, 1.0, 2.5, -2.0}) {
    const PlaceSimilarity s = ComparePlaces(first, At(3.0, 1.0, 0.3 + turn, 0.07, 3));
    EXPECT_LT(s.distance, nearest_elsewhere) << turn;
    EXPECT_LT(HeadingError(s.heading_rad, turn), 0.08) << turn;
  }
}

// Independent of scanning: the same posts, shifted and turned as points.
TEST_F(PlaceDescriptorTest, ShiftAndTurnOfTheSamePostsHardlyMatter) {
  const std::uint64_t seed = 5;
  SCOPED_TRACE(seed);
  SplitMix64 random(seed);
  std::vector<Eigen::Vector2d> posts;
  for (int i = 0; i < 80; ++i) {
    posts.emplace_back(40.0 * (random.Uniform() - 0.5), 40.0 * (random.Uniform() - 0.5));
  }
  const auto describe = [&](double turn, const Eigen::Vector2d& shift) {
    PointCloud cloud;
    for (const Eigen::Vector2d& post : posts) {
      const Eigen::Vector2d p = Eigen::Rotation2Dd(turn) * post + shift;
      for (int z = 0; z < 30; ++z) {
        cloud.points.emplace_back(
            static_cast<float>(p.x()), static_cast<float>(p.y()), 0.1F * static_cast<float>(z));
      }
    }
    return DescribePlace(BuildMlsMap(cloud, Pose::Identity(), SensorModel(), MlsParameters())->map);
  };
  const PlaceDescriptor original = describe(0.0, {0.0, 0.0});
  const PlaceSimilarity moved = ComparePlaces(describe(0.9, {4.0, -3.0}), original);
  EXPECT_LT(moved.distance, 0.3);
  EXPECT_LT(HeadingError(moved.heading_rad, 0.9), 0.06);
}

TEST_F(PlaceDescriptorTest, InvariantPartIsTheSameForTurnsByWholeDirections) {
  const PlaceDescriptor place = At(0, 0, 0, 0, 1);
  PlaceDescriptor turned;
  for (int w = 0; w < PlaceDescriptor::kWaves; ++w) {
    for (int d = 0; d < PlaceDescriptor::kDirections; ++d) {
      turned.spectrum[w * PlaceDescriptor::kDirections + (d + 17) % PlaceDescriptor::kDirections] =
          place.spectrum[w * PlaceDescriptor::kDirections + d];
    }
  }
  const std::vector<float> a = InvariantOf(place);
  const std::vector<float> b = InvariantOf(turned);
  ASSERT_EQ(a.size(), b.size());
  double squares = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_NEAR(a[i], b[i], 1e-5);
    squares += a[i] * a[i];
  }
  EXPECT_NEAR(squares, 1.0, 1e-5);
  EXPECT_NEAR(ComparePlaces(turned, place).heading_rad, 17 * std::numbers::pi / 60, 1e-12);
}

TEST_F(PlaceDescriptorTest, WithoutStructureThereIsNothingToRecognise) {
  const PlaceDescriptor empty = DescribePlace(MlsMap());
  EXPECT_TRUE(empty.empty());
  EXPECT_EQ(ComparePlaces(empty, empty).distance, 1.0);
  EXPECT_EQ(ComparePlaces(empty, At(0, 0, 0, 0, 1)).distance, 1.0);
  for (const float v : InvariantOf(empty)) EXPECT_EQ(v, 0.0F);
}

TEST_F(PlaceDescriptorTest, BytesComeBack) {
  const PlaceDescriptor place = At(0, 0, 0, 0, 1);
  const std::string bytes = EncodePlace(place);
  EXPECT_LE(bytes.size(), 2048U);
  STRATA_ASSERT_OK_AND_ASSIGN(const PlaceDescriptor read, DecodePlace(bytes));
  EXPECT_EQ(read, place);
}

TEST(PlaceBytesTest, OtherBytesAreRefused) {
  const std::string good = EncodePlace(PlaceDescriptor());
  std::string other_version = good;
  other_version[0] = 9;
  for (const std::string& bytes :
       {std::string(), good.substr(0, good.size() - 1), good + "x", other_version}) {
    EXPECT_THAT(DecodePlace(bytes),
                StatusIs(absl::StatusCode::kDataLoss, HasSubstr("place descriptor of")));
  }
}

TEST(PlaceDescriptorOptionsTest, NamesWhatIsOutOfRange) {
  PlaceDescriptorOptions options;
  STRATA_EXPECT_OK(options.Validate());
  options.radius_m = std::numeric_limits<double>::quiet_NaN();
  options.max_height_m = 0.1;
  EXPECT_THAT(options.Validate(),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("max_height_m is 0.1")));
}

}  // namespace
}  // namespace strata
