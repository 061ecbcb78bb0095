#include "client/cli/job/job_runner.h"

#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/mock_database.h"
#include "tests/support/status_matchers.h"

namespace strata::cli {
namespace {

using ::testing::_;
using ::testing::Return;

class FollowJobTest : public ::testing::Test {
 protected:
  static JobInfo JobIn(JobState state) {
    JobInfo job;
    job.id = 7;
    job.kind = "rebuild";
    job.state = state;
    return job;
  }

  testing::MockDatabase database_;
  std::ostringstream data_, talk_;
  Output output_{OutputFormat::kText, data_, talk_};
  Context context_{.database = database_, .call = {}, .output = output_};
};

TEST_F(FollowJobTest, WatchesAgainWhenTheServerComesBack) {
  auto& jobs = database_.jobs();
  ON_CALL(jobs, Get).WillByDefault(Return(JobIn(JobState::kRunning)));
  EXPECT_CALL(jobs, Watch)
      .WillOnce(Return(absl::UnavailableError("Socket closed")))
      .WillOnce([](const auto&, auto, auto, const auto& sink) {
        EXPECT_THAT(sink(JobIn(JobState::kRunning)), testing::IsOk());
        return absl::UnavailableError("gone again");
      })
      .WillOnce([](const auto&, auto, auto, const auto& sink) {
        return sink(JobIn(JobState::kSucceeded));
      });
  STRATA_ASSERT_OK_AND_ASSIGN(const JobInfo job, FollowJob(context_, "m", 7));
  EXPECT_EQ(job.state, JobState::kSucceeded);
}

TEST_F(FollowJobTest, InterruptedItSaysThatTheJobGoesOn) {
  auto& jobs = database_.jobs();
  ON_CALL(jobs, Get).WillByDefault(Return(JobIn(JobState::kRunning)));
  EXPECT_CALL(jobs, Watch).WillOnce([](const api::Call& call, auto, auto, const auto&) {
    call.stop.Request();
    return absl::CancelledError("cancelled by the caller");
  });
  EXPECT_THAT(FollowJob(context_, "m", 7).status(),
              testing::StatusIs(absl::StatusCode::kCancelled,
                                ::testing::HasSubstr("'strata job watch m 7' comes back to it")));
}

TEST_F(FollowJobTest, OtherErrorsEndIt) {
  auto& jobs = database_.jobs();
  ON_CALL(jobs, Get).WillByDefault(Return(JobIn(JobState::kRunning)));
  EXPECT_CALL(jobs, Watch).WillOnce(Return(absl::NotFoundError("job 7 does not exist")));
  EXPECT_THAT(FollowJob(context_, "m", 7).status(),
              testing::StatusIs(absl::StatusCode::kNotFound, ::testing::HasSubstr("job 7")));
}

}  // namespace
}  // namespace strata::cli
