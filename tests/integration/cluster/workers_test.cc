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

// A person's word of where the later scan is, seen from the earlier one.
absl::Status HoldApart(api::Database& db, std::uint64_t i, std::uint64_t j, double x_m) {
  Constraint constraint;
  constraint.i = {"run", i};
  constraint.j = {"run", j};
  constraint.T_i_j.translation().x() = x_m;
  constraint.information = Matrix6d::Identity() * 1e8;
  return db.posegraph().AddConstraint({}, kShared, constraint).status();
}

double XOf(api::Database& db, std::uint64_t sequence) {
  const auto found = db.posegraph().LookupPose({}, kShared, {"run", sequence});
  STRATA_EXPECT_OK(found);
  return found.ok() ? found->T_map_scan.translation().x() : -1.0;
}

// A block as of a kind that a map has twice, which nobody saw from above.
PointCloud BlockAt(float x_m) {
  PointCloud cloud;
  for (int i = 0; i <= 16; ++i) {
    for (int k = 2; k <= 20; ++k) {
      const float along = 0.05F * static_cast<float>(i);
      const float z = 0.05F * static_cast<float>(k);
      cloud.points.emplace_back(x_m + along, 0.0F, z);
      cloud.points.emplace_back(x_m + along, 0.6F, z);
      if (i > 12) continue;
      cloud.points.emplace_back(x_m, along, z);
      cloud.points.emplace_back(x_m + 0.8F, along, z);
    }
  }
  cloud.label.assign(cloud.size(), kThing);
  return cloud;
}

absl::Status PutBlock(api::Database& db, std::uint64_t sequence) {
  const PointCloud cloud = BlockAt(3.0F * static_cast<float>(sequence));
  STRATA_ASSIGN_OR_RETURN(const auto upload,
                          db.scans().Upload({}, kShared, NumberedHeader(sequence, cloud)));
  STRATA_RETURN_IF_ERROR(upload->Write(cloud));
  return upload->Finish().status();
}

// What one is told who was told `since` before, at once.
api::MapUpdate Since(api::Database& db, std::uint64_t since) {
  api::WatchOptions options;
  options.since = since;
  options.once = true;
  api::MapUpdate told;
  STRATA_EXPECT_OK(db.maps().Watch({}, kShared, options, [&](const api::MapUpdate& update) {
    told = update;
    return absl::OkStatus();
  }));
  return told;
}

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

// Once the job has ended, by every server: also where the owner had a later number by then.
TEST_F(WorkersTest, WhatAWorkerInfersIsToldByAll) {
  STRATA_ASSERT_OK(db(0).maps().Create({}, kShared, MapParameters()));
  Add("b", "integrator");
  Add("c", "worker");
  for (const std::uint64_t scan : {1, 2}) STRATA_ASSERT_OK(PutBlock(db(0), scan));
  STRATA_ASSERT_OK(AtRest(db(0), kShared));
  STRATA_ASSERT_OK(RunJobOf(db(0), "objects"));
  for (int round = 1; round <= 2; ++round) {
    const std::uint64_t before = Since(db(1), 0).commit_sequence;
    std::thread robot([&] {
      for (std::uint64_t scan = 1; scan <= 5; ++scan) {
        STRATA_EXPECT_OK(PutNumbered(*servers_[0]->db(), kShared, 10 * (round + 1) + scan));
        absl::SleepFor(absl::Milliseconds(200));
      }
    });
    STRATA_EXPECT_OK(RunJobOf(db(0), "complete"));
    for (const std::size_t server : {1U, 0U, 2U}) {
      EXPECT_TRUE(Since(db(server), before).inferred) << server;
      std::uint64_t parts = 0;
      STRATA_EXPECT_OK(db(server)
                           .objects()
                           .ListInferred({},
                                         kShared,
                                         {},
                                         [&](const InferredPart&) {
                                           ++parts;
                                           return absl::OkStatus();
                                         })
                           .status());
      EXPECT_EQ(parts, 2U) << server;
    }
    robot.join();
    STRATA_ASSERT_OK(AtRest(db(0), kShared));
  }
  EXPECT_EQ(Owner(), "b");
  EXPECT_EQ(Ask("SELECT count(*)::text FROM map_edit"), "0");
}

// As an epoch of the owner's: with scans that came in since, once, also where he dies before.
TEST_F(WorkersTest, WhatAWorkerProposesIsAppliedByTheOwner) {
  STRATA_ASSERT_OK(db(0).maps().Create({}, kShared, MapParameters()));
  Add("b", "integrator");
  Add("c", "worker");
  for (const std::uint64_t scan : {1, 2}) STRATA_ASSERT_OK(PutNumbered(db(0), kShared, scan));
  STRATA_ASSERT_OK(AtRest(db(0), kShared));
  STRATA_ASSERT_OK(HoldApart(db(0), 1, 2, 0.2));
  JobParameters given = {{"closures", "0"}, {"planes", "0"}, {"dry_run", "1"}};
  const JobInfo proposed = Ended(Started("optimize", given).id);
  ASSERT_EQ(proposed.state, JobState::kProposed) << proposed.message;
  EXPECT_EQ(db(1).maps().Stats({}, kShared)->epoch, 1U);
  STRATA_ASSERT_OK(PutNumbered(db(0), kShared, 3));
  STRATA_ASSERT_OK(AtRest(db(0), kShared));
  STRATA_ASSERT_OK(HoldApart(db(0), 2, 3, 0.0));
  STRATA_ASSERT_OK(db(0).jobs().Accept({}, kShared, proposed.id));
  const JobInfo applied = Ended(proposed.id);
  ASSERT_EQ(applied.state, JobState::kSucceeded) << applied.message;
  EXPECT_EQ(applied.metrics.at("scans_carried"), 1.0);
  EXPECT_NEAR(XOf(db(1), 2) - XOf(db(1), 1), 0.2, 1e-3);
  EXPECT_NEAR(XOf(db(1), 3), XOf(db(1), 2), 1e-3);
  given.erase("dry_run");
  for (const bool owner_dies : {false, true}) {
    STRATA_ASSERT_OK(Insist([&] { return SetX(*servers_[0]->db(), 2, 5.0); }));
    const JobInfo job = Started("optimize", given);
    if (owner_dies) {
      STRATA_EXPECT_OK(Insist([&] {
        const bool handed = Ask("SELECT value FROM truth_job_parameter WHERE name = 'accepted' AND "
                                "job = (SELECT max(id) FROM truth_job)") == "1";
        return handed ? absl::OkStatus() : absl::UnavailableError("it is not proposed yet");
      }));
      servers_[1]->Kill();
      Add("d", "integrator");
    }
    const JobInfo ended = Ended(job.id);
    EXPECT_EQ(ended.state, JobState::kSucceeded) << ended.message;
    EXPECT_NEAR(XOf(db(0), 2) - XOf(db(0), 1), 0.2, 1e-3);
    STRATA_ASSERT_OK_AND_ASSIGN(const auto epochs, db(0).maps().History({}, kShared));
    EXPECT_EQ(std::ranges::count(epochs, job.id, &EpochInfo::job), 1);
    EXPECT_EQ(epochs[0].job, job.id);
  }
  EXPECT_EQ(Owner(), "d");
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

// What they keep and propose is kept once, by the one that has the job.
TEST_F(WorkersTest, JobsThatPublishOutliveTheirWorker) {
  STRATA_ASSERT_OK(db(0).maps().Create({}, kShared, MapParameters()));
  Add("b", "integrator");
  Add("c", "worker");
  Add("d", "worker");
  PutLargeScans(10'000);
  for (const char* kind : {"objects", "optimize"}) {
    const JobInfo job = Started(kind);
    const std::string first = AwaitRun();
    const bool at_c =
        Ask("SELECT holder FROM map_server WHERE server = 'c'") == first.substr(0, first.find('/'));
    SharingServer& frozen = *servers_[at_c ? 2 : 3];
    frozen.Signal(SIGSTOP);
    EXPECT_NE(AwaitRun(first), first);
    frozen.Signal(SIGCONT);
    const JobInfo ended = Ended(job.id);
    EXPECT_EQ(ended.state, JobState::kSucceeded) << kind << ": " << ended.message;
    EXPECT_EQ(RunBy(), "");
  }
  EXPECT_EQ(Ask("SELECT string_agg(DISTINCT job::text, ' ') FROM derived_entity"), "1");
  EXPECT_LE(db(0).maps().History({}, kShared)->size(), 2U);
  EXPECT_EQ(Owner(), "b");
}

}  // namespace
}  // namespace strata::testing
