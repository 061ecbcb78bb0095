#include "client/ros2/diagnosis.h"

#include "absl/status/status.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/common/steady_time.h"

namespace strata::ros2 {
namespace {

using ::testing::HasSubstr;
using Level = Diagnosis::Level;

FollowerStatus Answered(TrackState state, absl::Time when) {
  FollowerStatus status;
  status.last.emplace();
  status.last->state = state;
  status.last->message = "several places fit";
  status.when = when;
  return status;
}

TEST(DiagnosisTest, ATrackedRobotIsFine) {
  const absl::Time now = SteadyNow();
  FollowerStatus status = Answered(TrackState::kTracked, now);
  status.last->covariance.diagonal() << 0, 0, 4e-6, 9e-4, 0, 16e-4;
  const Diagnosis diagnosis = DiagnosisOf(status, false, true, now);
  EXPECT_EQ(diagnosis.level, Level::kOk);
  EXPECT_EQ(diagnosis.message, "tracked");
  EXPECT_THAT(diagnosis.values, ::testing::Contains(::testing::Pair("sigma [m]", "0.050")));
  EXPECT_THAT(diagnosis.values, ::testing::Contains(::testing::Pair("sigma [rad]", "0.0020")));
}

TEST(DiagnosisTest, ALostRobotIsAnErrorAndOneThatMapsGoesOnByItsOwnScans) {
  const absl::Time now = SteadyNow();
  const FollowerStatus status = Answered(TrackState::kLost, now);
  const Diagnosis lost = DiagnosisOf(status, false, true, now);
  EXPECT_EQ(lost.level, Level::kError);
  EXPECT_THAT(lost.message, HasSubstr("lost: several places fit; map -> odom stays as it was"));
  const Diagnosis maps = DiagnosisOf(status, true, true, now);
  EXPECT_EQ(maps.level, Level::kWarn);
  EXPECT_THAT(
      maps.message,
      HasSubstr("not tracked: several places fit; map -> odom is by the robot's own scans"));
  EXPECT_EQ(DiagnosisOf(status, true, false, now).level, Level::kError);  // nor does it map yet
}

// One cloud without an answer is no trouble.
TEST(DiagnosisTest, TroubleCountsWhenItLasts) {
  const absl::Time now = SteadyNow();
  FollowerStatus status = Answered(TrackState::kTracked, now - absl::Seconds(1));
  status.trouble = absl::UnavailableError("nobody answers");
  EXPECT_EQ(DiagnosisOf(status, false, true, now).level, Level::kOk);
  const Diagnosis later = DiagnosisOf(status, false, true, now + absl::Seconds(5));
  EXPECT_EQ(later.level, Level::kError);
  EXPECT_THAT(later.message, HasSubstr("nobody answers"));
  status.trouble = absl::OkStatus();
  EXPECT_THAT(DiagnosisOf(status, false, true, now + absl::Seconds(5)).message,
              HasSubstr("no cloud"));
}

}  // namespace
}  // namespace strata::ros2
