// Conformance: jobs.
#include <cstdint>

#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/database_suite.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::_;
using ::testing::HasSubstr;
using ::testing::SizeIs;
using Code = absl::StatusCode;

TEST_P(DatabaseSuite, JobsRunToTheirEndAndAreWatched) {
  PutFloor(db(), {"run", 1});
  STRATA_ASSERT_OK_AND_ASSIGN(const MapStats before, db().maps().Stats({}, kMap));
  for (const char* kind : {"rebuild", "verify"}) {
    STRATA_ASSERT_OK_AND_ASSIGN(const JobInfo job, db().jobs().Start({}, kMap, kind, {}));
    JobInfo last;
    STRATA_ASSERT_OK(db().jobs().Watch({}, kMap, job.id, [&last](const JobInfo& now) {
      EXPECT_FALSE(IsFinal(last.state));
      last = now;
      return absl::OkStatus();
    }));
    EXPECT_EQ(last.id, job.id);
    EXPECT_EQ(last.state, JobState::kSucceeded) << kind << ": " << last.message;
    STRATA_ASSERT_OK_AND_ASSIGN(const JobInfo cancelled, db().jobs().Cancel({}, kMap, job.id));
    EXPECT_EQ(cancelled.state, JobState::kSucceeded);
  }
  STRATA_ASSERT_OK_AND_ASSIGN(const MapStats after, db().maps().Stats({}, kMap));
  EXPECT_EQ(after.content_digest, before.content_digest);
  STRATA_ASSERT_OK_AND_ASSIGN(const auto jobs, db().jobs().List({}, kMap));
  ASSERT_THAT(jobs, SizeIs(2));
  EXPECT_EQ(jobs[0].kind, "rebuild");
  EXPECT_THAT(db().jobs().Start({}, kMap, "dance", {}),
              StatusIs(Code::kInvalidArgument, HasSubstr("dance")));
  EXPECT_THAT(db().jobs().Get({}, kMap, 999), StatusIs(Code::kNotFound, _));
}

// A job that ends before it could be watched is no failure, so there are several tries.
TEST_P(DatabaseSuite, AWatchEndsWithItsCallAndTheJobGoesOn) {
  for (std::uint64_t i = 1; i <= 8; ++i) PutFloor(db(), {"run", i}, 2.0 * static_cast<double>(i));
  const auto watch = [&](const api::Call& call, auto sink) {
    for (int attempt = 0; attempt < 20; ++attempt) {
      const auto job = db().jobs().Start({}, kMap, "rebuild", {});
      STRATA_EXPECT_OK(job);
      JobInfo last = job.value_or(JobInfo());
      const absl::Status ended = db().jobs().Watch(call, kMap, last.id, [&](const JobInfo& now) {
        last = now;
        return sink(now);
      });
      if (IsFinal(last.state)) continue;
      STRATA_EXPECT_OK(db().jobs().Watch({}, kMap, last.id, [&last](const JobInfo& now) {
        last = now;
        return absl::OkStatus();
      }));
      EXPECT_EQ(last.state, JobState::kSucceeded) << last.message;
      return ended;
    }
    return absl::InternalError("every job ended too soon");
  };
  const api::Call cancelled;
  EXPECT_THAT(watch(cancelled,
                    [&](const JobInfo&) {
                      cancelled.stop.Request();
                      return absl::OkStatus();
                    }),
              StatusIs(Code::kCancelled, _));
  EXPECT_THAT(watch({}, [](const JobInfo&) { return absl::OutOfRangeError("enough"); }),
              StatusIs(Code::kOutOfRange, "enough"));
  const api::Call late{Stop(absl::UnixEpoch()), "", ""};
  EXPECT_THAT(watch(late, [](const JobInfo&) { return absl::OkStatus(); }),
              StatusIs(Code::kDeadlineExceeded, _));
}

TEST_P(DatabaseSuite, ACancelledJobEndsItsWatch) {
  for (std::uint64_t i = 1; i <= 8; ++i) PutFloor(db(), {"run", i}, 2.0 * static_cast<double>(i));
  JobInfo last;
  for (int attempt = 0; attempt < 20 && last.state != JobState::kCancelled; ++attempt) {
    STRATA_ASSERT_OK_AND_ASSIGN(last, db().jobs().Start({}, kMap, "rebuild", {}));
    STRATA_ASSERT_OK(db().jobs().Watch({}, kMap, last.id, [&](const JobInfo& now) {
      last = now;
      return db().jobs().Cancel({}, kMap, now.id).status();
    }));
    EXPECT_TRUE(IsFinal(last.state));
  }
  EXPECT_EQ(last.state, JobState::kCancelled);
}

}  // namespace
}  // namespace strata::testing
