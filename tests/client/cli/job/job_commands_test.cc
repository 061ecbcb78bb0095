// strata job, on a database that the test decides on.

#include <cstdint>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/cli/terminal/command.h"
#include "tests/client/cli/commands_fixture.h"
#include "tests/support/mock_database.h"
#include "tests/support/status_matchers.h"

namespace strata::cli {
namespace {

using ::strata::testing::StatusIs;
using ::testing::_;
using ::testing::HasSubstr;
using ::testing::Return;
using Code = absl::StatusCode;

class JobCommandsTest : public CommandsTest {};

TEST_F(JobCommandsTest, AJobTakesItsParametersByPlaceByNameAndByFlag) {
  const ::strata::testing::StringMap expected = {
      {"rounds", "3"}, {"pool", "2"}, {"threads", "4"}, {"dry_run", "1"}};
  EXPECT_CALL(db_.jobs(), Start(_, absl::string_view("m"), absl::string_view("optimize"), expected))
      .WillOnce(Return(Job(7, JobState::kQueued)));
  EXPECT_EQ(RunJson({"job",
                     "start",
                     "m",
                     "optimize",
                     "rounds=3",
                     "pool=2",
                     "--param",
                     "threads=4",
                     "--dry-run"})["id"],
            7);
  EXPECT_THROW(Run({"job", "start", "m", "optimize", "fast"}).IgnoreError(), CLI::ParseError);
}

TEST_F(JobCommandsTest, ADryRunThatProposesHasDoneItsWork) {
  ON_CALL(db_.jobs(), Start(_, _, _, _)).WillByDefault(Return(Job(7, JobState::kQueued)));
  EveryWatchEndsWith(JobState::kProposed);
  EXPECT_EQ(RunJson({"job", "start", "m", "optimize", "--dry-run", "--wait"})["state"], "proposed");
  EveryWatchEndsWith(JobState::kFailed);
  EXPECT_THAT(Run({"job", "start", "m", "optimize", "--dry-run", "--wait"}),
              StatusIs(Code::kFailedPrecondition, HasSubstr("job 7 failed")));
}

TEST_F(JobCommandsTest, TheReportOfAJobHasALineANumber) {
  JobInfo job = Job(7, JobState::kProposed);
  job.metrics = {{"cost_before", 12.5}, {"cost_after", 3.25}};
  ON_CALL(db_.jobs(), Get(_, _, _)).WillByDefault(Return(job));
  EXPECT_THAT(RunText({"job", "show", "m", "7"}),
              HasSubstr("\n\ncost_after   3.25\ncost_before  12.5\n"));
  EXPECT_EQ(RunJson({"job", "show", "m", "7"})["metrics"]["cost_after"], 3.25);
}

TEST_F(JobCommandsTest, WhoWaitsGetsSentencesAndWhereTheNumbersAre) {
  ON_CALL(db_.jobs(), Start(_, _, _, _)).WillByDefault(Return(Job(7, JobState::kQueued)));
  JobInfo ended = Job(7, JobState::kSucceeded);
  ended.message = "settled";
  for (int i = 0; i < 9; ++i) ended.metrics["n" + std::to_string(i)] = i;
  ON_CALL(db_.jobs(), Get(_, _, _)).WillByDefault(Return(Job(7, JobState::kQueued)));
  ON_CALL(db_.jobs(), Watch(_, _, _, _)).WillByDefault([&](auto&, auto, std::uint64_t, auto sink) {
    return sink(ended);
  });
  const std::string brief = RunText({"job", "start", "m", "optimize", "--wait"});
  EXPECT_THAT(brief, HasSubstr("\nmessage     settled\n"));
  EXPECT_THAT(brief, HasSubstr("\nmetrics     9 numbers; see job show m 7\n"));
  EXPECT_EQ(RunJson({"job", "start", "m", "optimize", "--wait"})["metrics"]["n8"], 8);
}

TEST_F(JobCommandsTest, ProposalsAreAcceptedAndForgotten) {
  EXPECT_CALL(db_.jobs(), Accept(_, absl::string_view("m"), 7))
      .WillRepeatedly(Return(Job(7, JobState::kQueued)));
  EveryWatchEndsWith(JobState::kSucceeded);
  EXPECT_EQ(RunJson({"job", "accept", "m", "7"})["state"], "queued");
  EXPECT_EQ(RunJson({"job", "accept", "m", "7", "--wait"})["state"], "succeeded");
  // A forgotten proposal is cancelled, as asked: nothing to wait for, and no failure.
  EXPECT_CALL(db_.jobs(), Revert(_, absl::string_view("m"), 7))
      .WillOnce(Return(Job(7, JobState::kCancelled)))
      .WillOnce(Return(Job(8, JobState::kQueued)));
  EXPECT_EQ(RunJson({"job", "revert", "m", "7", "--wait"})["state"], "cancelled");
  const Json undone = RunJson({"job", "revert", "m", "7", "--wait"});
  EXPECT_EQ(undone["id"], 8);
  EXPECT_EQ(undone["state"], "succeeded");
}

}  // namespace
}  // namespace strata::cli
