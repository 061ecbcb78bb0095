// Jobs of maps that other servers have, run by workers.
#include <algorithm>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>
#include <thread>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/common/status.h"
#include "tests/integration/cluster/roles.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::HasSubstr;

class WorkersTest : public RolesTest {};

// Of a map that another server has.
TEST_F(WorkersTest, JobsAreRunByWorkers) {
  STRATA_ASSERT_OK(db(0).maps().Create({}, kShared, MapParameters()));
  Add("b", "integrator");
  PutLargeScans();
  EXPECT_THAT(RunJobOf(db(0), "planes"),
              StatusIs(absl::StatusCode::kUnavailable, HasSubstr("start one with --role worker")));
  EXPECT_THAT(RunJobOf(db(1), "verify"),
              StatusIs(absl::StatusCode::kUnavailable, HasSubstr("worker")));
  STRATA_EXPECT_OK(RunJobOf(db(0), "rebuild"));
  Add("c", "worker");
  const JobInfo planes = Started("planes");
  EXPECT_NE(AwaitRun(), "");
  EXPECT_EQ(db(1).jobs().Get({}, kShared, planes.id)->state, JobState::kRunning);
  // One at a time.
  const JobInfo rebuild = Started("rebuild");
  EXPECT_EQ(db(1).jobs().Get({}, kShared, rebuild.id)->state, JobState::kQueued);
  EXPECT_EQ(Ended(planes.id).state, JobState::kSucceeded) << Ended(planes.id).message;
  for (const std::size_t server : {0U, 1U, 2U}) {
    EXPECT_EQ(db(server).jobs().Get({}, kShared, planes.id)->state, JobState::kSucceeded) << server;
  }
  EXPECT_EQ(Ended(rebuild.id).state, JobState::kSucceeded);
  STRATA_EXPECT_OK(RunJobOf(db(1), "verify"));
  STRATA_EXPECT_OK(RunJobOf(db(2), "verify"));
  EXPECT_EQ(Owner(), "b");
  EXPECT_EQ(RunBy(), "");
}

TEST_F(WorkersTest, AJobIsCancelledWhereverItRuns) {
  STRATA_ASSERT_OK(db(0).maps().Create({}, kShared, MapParameters()));
  Add("b", "integrator");
  Add("c", "worker");
  PutLargeScans();
  int cancelled = 0;
  for (const std::size_t server : {0U, 1U, 2U}) {
    const JobInfo job = Started("planes");
    AwaitRun();
    STRATA_EXPECT_OK(db(server).jobs().Cancel({}, kShared, job.id));
    // On a fast machine it may end before its server looks whether it was told to.
    const JobInfo ended = Ended(job.id);
    EXPECT_NE(ended.state, JobState::kFailed) << server << ": " << ended.message;
    cancelled += ended.state == JobState::kCancelled ? 1 : 0;
    EXPECT_EQ(RunBy(), "");
  }
  std::printf("%d of 3 were cancelled\n", cancelled);
}

// In a run before, whose engine died.
TEST_F(WorkersTest, AJobThatWasToldToEndIsNotBegunAgain) {
  STRATA_ASSERT_OK(db(0).maps().Create({}, kShared, MapParameters()));
  Add("b", "integrator");
  Add("c", "worker");
  STRATA_ASSERT_OK(PutNumbered(db(0), kShared, 1));
  STRATA_ASSERT_OK(AtRest(db(0), kShared));
  servers_[2]->Signal(SIGSTOP);
  const JobInfo job = Started("verify");
  EXPECT_EQ(Ask("INSERT INTO truth_job_parameter (map, job, name, value) SELECT map, id, "
                "'told_to_end', '1' FROM truth_job RETURNING value"),
            "1");
  servers_[2]->Signal(SIGCONT);
  EXPECT_EQ(Ended(job.id).state, JobState::kCancelled) << Ended(job.id).message;
}

// One that is frozen writes nothing when it wakes up.
TEST_F(WorkersTest, AJobOutlivesItsWorker) {
  STRATA_ASSERT_OK(db(0).maps().Create({}, kShared, MapParameters()));
  Add("b", "integrator");
  Add("c", "worker");
  PutLargeScans();
  const JobInfo frozen = Started("planes");
  const std::string first = AwaitRun();
  servers_[2]->Signal(SIGSTOP);
  Add("d", "worker");
  EXPECT_NE(AwaitRun(first), first);
  servers_[2]->Signal(SIGCONT);
  EXPECT_EQ(Ended(frozen.id).state, JobState::kSucceeded) << Ended(frozen.id).message;
  // Killed, and gone by a clean end.
  for (const int how : {SIGKILL, SIGTERM}) {
    const JobInfo job = Started("planes");
    const std::string by = AwaitRun();
    const bool at_c = by.substr(0, by.find('/')) == first.substr(0, first.find('/'));
    SharingServer& runs = *servers_[at_c ? 2 : 3];
    runs.Signal(how);
    runs.Await();
    EXPECT_EQ(Ended(job.id).state, JobState::kSucceeded) << Ended(job.id).message;
    runs.Start();
  }
  // The owner dies, and its successor does not begin it again.
  const JobInfo job = Started("planes");
  const std::string by = AwaitRun();
  servers_[1]->Kill();
  Add("e", "integrator");
  STRATA_EXPECT_OK(Insist([&] { return SetX(*servers_[0]->db(), 1, 0.5); }));
  const std::string then = RunBy();
  EXPECT_TRUE(then == by || then.empty()) << then;
  EXPECT_EQ(Ended(job.id).state, JobState::kSucceeded) << Ended(job.id).message;
  EXPECT_EQ(Ask("SELECT count(*)::text FROM attempt WHERE under_way = 1"), "0");
}

}  // namespace
}  // namespace strata::testing
