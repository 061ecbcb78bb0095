// Conformance: jobs.
#include <algorithm>
#include <cstdint>

#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/database_suite/database_suite.h"
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

// Upright, `x_m` in front of the sensor, a point every 5 cm.
PointCloud Wall(float x_m, float half_width_m, float bottom_m, float top_m) {
  PointCloud cloud;
  for (float y = -half_width_m; y <= half_width_m; y += 0.05F) {
    for (float z = bottom_m; z <= top_m; z += 0.05F) cloud.points.emplace_back(x_m, y, z);
  }
  return cloud;
}

TEST_P(DatabaseSuite, WhatFadesIsNamedWithItsEvidence) {
  // A door that is open from the second scan on.
  for (std::uint64_t i = 1; i <= 5; ++i) {
    const PointCloud cloud = i == 1 ? Wall(5.0F, 0.5F, 0.2F, 1.6F) : Wall(10.0F, 1.5F, -1.0F, 2.5F);
    STRATA_ASSERT_OK(UploadScan(db(), kMap, FloorHeader({"run", i}, cloud), cloud));
  }
  AwaitIntegration(db(), kMap);
  STRATA_ASSERT_OK_AND_ASSIGN(auto faded, db().scans().GetFaded({}, kMap, {"run", 1}));
  EXPECT_THAT(faded, SizeIs(0));
  STRATA_ASSERT_OK_AND_ASSIGN(const JobInfo job, db().jobs().Start({}, kMap, "fade", {}));
  JobInfo last;
  STRATA_ASSERT_OK(db().jobs().Watch({}, kMap, job.id, [&last](const JobInfo& now) {
    last = now;
    return absl::OkStatus();
  }));
  EXPECT_EQ(last.state, JobState::kSucceeded) << last.message;

  STRATA_ASSERT_OK_AND_ASSIGN(const ScanInfo door, db().scans().Get({}, kMap, {"run", 1}));
  STRATA_ASSERT_OK_AND_ASSIGN(faded, db().scans().GetFaded({}, kMap, {"run", 1}));
  ASSERT_THAT(faded, SizeIs(door.header.point_count));
  EXPECT_EQ(door.faded_points,
            static_cast<std::uint64_t>(
                std::count_if(faded.begin(), faded.end(), [](auto scans) { return scans != 0; })));
  EXPECT_GT(door.faded_points, door.header.point_count / 2);
  EXPECT_THAT(faded, ::testing::Each(::testing::AnyOf(0, 3, 4)));
  STRATA_ASSERT_OK_AND_ASSIGN(faded, db().scans().GetFaded({}, kMap, {"run", 2}));
  EXPECT_THAT(faded, SizeIs(0));
  EXPECT_THAT(db().scans().GetFaded({}, kMap, {"run", 9}), StatusIs(Code::kNotFound, _));
  EXPECT_THAT(db().jobs().Start({}, kMap, "fade", {{"rays", "0"}}),
              StatusIs(Code::kInvalidArgument, HasSubstr("rays")));
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
