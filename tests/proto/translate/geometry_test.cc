#include "proto/translate/geometry.h"

#include <cmath>
#include <cstdint>
#include <limits>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/status_matchers.h"

namespace strata::translate {
namespace {

using ::strata::testing::StatusIs;
using ::testing::HasSubstr;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr absl::StatusCode kInvalid = absl::StatusCode::kInvalidArgument;

TEST(TranslateGeometryTest, PosesComeBackToRounding) {
  const unsigned seed = 20261121;
  SCOPED_TRACE(seed);
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Quaterniond q =
        Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random))
            .normalized();
    const Pose T = MakePose(q, Eigen::Vector3d(normal(random), 1e6 * normal(random), 1e-3));
    STRATA_ASSERT_OK_AND_ASSIGN(const Pose back, FromProto("pose", ToProto(T)));
    EXPECT_EQ(back.translation(), T.translation());
    EXPECT_LE((back.linear() - T.linear()).cwiseAbs().maxCoeff(), 2e-15);
  }
}

TEST(TranslateGeometryTest, AnAbsentPoseIsTheIdentity) {
  STRATA_ASSERT_OK_AND_ASSIGN(const Pose T, FromProto("pose", v1::Pose()));
  EXPECT_EQ(T.matrix(), Pose::Identity().matrix());
}

TEST(TranslateGeometryTest, ASlightlyWrongQuaternionIsMended) {
  v1::Pose pose;
  pose.mutable_rotation()->set_w(1.0005);
  STRATA_ASSERT_OK_AND_ASSIGN(const Pose T, FromProto("pose", pose));
  EXPECT_EQ(T.matrix(), Pose::Identity().matrix());
}

TEST(TranslateGeometryTest, RefusesQuaternionsThatAreNoRotation) {
  v1::Pose pose;
  pose.mutable_rotation();
  EXPECT_THAT(FromProto("pose", pose), StatusIs(kInvalid, HasSubstr("pose.rotation: norm 0")));
  pose.mutable_rotation()->set_w(1.01);
  EXPECT_THAT(FromProto("pose", pose), StatusIs(kInvalid, HasSubstr("norm 1.01")));
  pose.mutable_rotation()->set_w(kNan);
  EXPECT_THAT(FromProto("pose", pose), StatusIs(kInvalid, HasSubstr("norm nan")));
}

TEST(TranslateGeometryTest, RefusesPlacesThatAreNotFinite) {
  v1::Pose pose;
  pose.mutable_translation()->set_y(kNan);
  EXPECT_THAT(FromProto("pose", pose), StatusIs(kInvalid, HasSubstr("pose.translation: (0, nan")));
  pose.mutable_translation()->set_y(1e9);
  EXPECT_THAT(FromProto("pose", pose), StatusIs(kInvalid, HasSubstr("pose")));
  v1::Vector2 place;
  place.set_x(std::numeric_limits<double>::infinity());
  EXPECT_THAT(FromProto("places[7]", place), StatusIs(kInvalid, HasSubstr("places[7]: (inf")));
}

TEST(TranslateGeometryTest, RefusesABoxTheWrongWayRound) {
  v1::Box2 box;
  box.mutable_min()->set_x(2);
  box.mutable_max()->set_x(1);
  EXPECT_THAT(FromProto("box", box), StatusIs(kInvalid, HasSubstr("min (2, 0) is above max (1")));
}

TEST(TranslateGeometryTest, TimesKeepTheirNanosecondsBeforeAndAfter1970) {
  for (const absl::Time time : {absl::FromUnixNanos(-1),
                                absl::UnixEpoch(),
                                absl::FromUnixNanos(1'353'801'601'123'456'789)}) {
    EXPECT_THAT(FromProto("time", ToProto(time)), strata::testing::IsOkAndHolds(time));
  }
}

TEST(TranslateGeometryTest, RefusesTimesOutOfRange) {
  google::protobuf::Timestamp time;
  time.set_nanos(1'000'000'000);
  EXPECT_THAT(FromProto("time", time), StatusIs(kInvalid, HasSubstr("1000000000 ns")));
  time.set_nanos(0);
  time.set_seconds(std::numeric_limits<std::int64_t>::max());
  EXPECT_THAT(FromProto("time", time), StatusIs(kInvalid, HasSubstr("years 1 to 9999")));
}

}  // namespace
}  // namespace strata::translate
