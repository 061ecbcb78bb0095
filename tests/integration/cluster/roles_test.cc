// Servers of one database that take maps and servers that do not, and maps that are deleted by
// servers that have not got them.
#include <algorithm>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/common/map_owner.h"
#include "core/common/status.h"
#include "core/common/steady_time.h"
#include "core/common/stop.h"
#include "core/storage/postgresql/connection.h"
#include "tests/integration/cluster/sharing_servers.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::HasSubstr;

api::Call Within(absl::Duration patience) {
  api::Call call;
  call.stop = Stop(SteadyNow() + patience);
  return call;
}

absl::Status SetX(api::Database& db, std::uint64_t sequence, double x_m) {
  Pose pose = Pose::Identity();
  pose.translation().x() = x_m;
  return db.posegraph().SetPose(Within(kPatience), kShared, {"run", sequence}, pose);
}

absl::Status RunJobOf(api::Database& db, const char* kind) {
  STRATA_ASSIGN_OR_RETURN(const JobInfo job, db.jobs().Start({}, kShared, kind, {}));
  JobInfo last;
  STRATA_RETURN_IF_ERROR(
      db.jobs().Watch(Within(kPatience), kShared, job.id, [&last](const JobInfo& now) {
        last = now;
        return absl::OkStatus();
      }));
  return last.state == JobState::kSucceeded ? absl::OkStatus() : absl::InternalError(last.message);
}

// In pieces.
absl::Status Write(api::ScanUpload& upload,
                   const PointCloud& cloud,
                   std::size_t begin,
                   std::size_t end) {
  constexpr std::size_t kPiece = 40'000;
  for (; begin < end; begin += kPiece) {
    PointCloud piece;
    const auto at = [&](std::size_t point) {
      return cloud.points.begin() + static_cast<std::ptrdiff_t>(std::min(point, end));
    };
    piece.points.assign(at(begin), at(begin + kPiece));
    STRATA_RETURN_IF_ERROR(upload.Write(piece));
  }
  return absl::OkStatus();
}

class DeletionsElsewhereTest : public SharingServersTest {
 protected:
  // Of requests that nobody has taken away.
  std::int64_t RowsOf(const char* table) {
    const auto connection = Connection::Open(store_);
    if (!connection.ok()) return -1;
    const std::string sql = std::string("SELECT count(*) FROM ") + table;
    auto row = (*connection)->Query(sql.c_str());
    return row.ok() && row->Next() ? row->Int(0) : -1;
  }
};

TEST_F(DeletionsElsewhereTest, AreTrueAtBothServersAtOnce) {
  STRATA_ASSERT_OK(PutNumbered(db(0), kShared, 1));
  STRATA_ASSERT_OK(AtRest(db(0), kShared));
  std::vector<std::thread> watchers;
  for (const auto& server : servers_) {
    watchers.emplace_back([&server] {
      const absl::Status ended = server->db()->maps().Watch(
          Within(kPatience), kShared, {}, [](const auto&) { return absl::OkStatus(); });
      EXPECT_FALSE(ended.ok() || absl::IsDeadlineExceeded(ended)) << ended;
    });
  }
  absl::SleepFor(absl::Milliseconds(300));
  EXPECT_EQ(MapOwnerOf(AskTheOwner(db(1), kShared)), "a");
  STRATA_ASSERT_OK(db(1).maps().Delete({}, kShared));
  for (const std::size_t server : {0U, 1U}) {
    EXPECT_TRUE(absl::IsNotFound(db(server).maps().Stats({}, kShared).status())) << server;
    EXPECT_EQ(db(server).maps().List({})->size(), 0U) << server;
  }
  EXPECT_TRUE(absl::IsNotFound(db(1).maps().Delete({}, kShared)));
  for (std::thread& watcher : watchers) watcher.join();
  for (const char* table : {"map_place", "map_edit", "map_lease", "truth_map", "truth_scan"}) {
    EXPECT_EQ(RowsOf(table), 0) << table;
  }
  // The name is free, at both.
  STRATA_ASSERT_OK(db(1).maps().Create({}, kShared, MapParameters()));
  EXPECT_EQ(db(0).maps().Stats({}, kShared)->scans, 0U);
  STRATA_ASSERT_OK(db(0).maps().Delete({}, kShared));
  STRATA_ASSERT_OK(db(1).maps().Create({}, kShared, MapParameters()));
  EXPECT_EQ(MapOwnerOf(AskTheOwner(db(0), kShared)), "b");
}

// Of those who wait for the map.
TEST_F(DeletionsElsewhereTest, EndWhatWasAskedOfTheMap) {
  STRATA_ASSERT_OK(PutNumbered(db(0), kShared, 1));
  STRATA_ASSERT_OK(AtRest(db(0), kShared));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto connection, Connection::Open(store_));
  servers_[0]->Signal(SIGSTOP);
  std::thread person([&] {
    const absl::Status told = SetX(*servers_[1]->db(), 1, 5.0);
    EXPECT_TRUE(absl::IsNotFound(told) || told.ok()) << told;
  });
  while (RowsOf("map_edit") == 0) absl::SleepFor(absl::Milliseconds(5));
  servers_[0]->Signal(SIGCONT);
  STRATA_EXPECT_OK(Insist([&] { return db(1).maps().Delete({}, kShared); }));
  person.join();
}

TEST_F(DeletionsElsewhereTest, OutliveTheOwner) {
  STRATA_ASSERT_OK(PutNumbered(db(0), kShared, 1));
  servers_[0]->Signal(SIGSTOP);
  STRATA_EXPECT_OK(Insist([&] {
    const absl::Status done = db(1).maps().Delete({}, kShared);
    return absl::IsNotFound(done) ? absl::OkStatus() : done;
  }));
  const absl::Status gone = db(1).maps().Stats({}, kShared).status();
  EXPECT_TRUE(absl::IsNotFound(gone)) << gone;
  servers_[0]->Signal(SIGCONT);
  const absl::Status woken = Insist([&] { return db(0).maps().Stats({}, kShared).status(); });
  EXPECT_TRUE(absl::IsNotFound(woken)) << woken;
}

TEST_F(DeletionsElsewhereTest, ThatSomebodyGivesUpHaveDeletedNothing) {
  STRATA_ASSERT_OK(PutNumbered(db(0), kShared, 1));
  servers_[0]->Signal(SIGSTOP);
  const absl::Status told = db(1).maps().Delete(Within(absl::Milliseconds(200)), kShared);
  EXPECT_TRUE(absl::IsDeadlineExceeded(told)) << told;
  STRATA_EXPECT_OK(Insist(
      [&] { return RowsOf("map_edit") == 0 ? absl::OkStatus() : absl::UnavailableError("left"); }));
  servers_[0]->Signal(SIGCONT);
  absl::SleepFor(absl::Milliseconds(1500));
  STRATA_EXPECT_OK(Insist([&] { return db(0).maps().Stats({}, kShared).status(); }));
  EXPECT_EQ(db(1).maps().Stats({}, kShared)->scans, 1U);
}

// An announced scan whose stream breaks off at one server is sent from its beginning to the other,
// by itself.
TEST_F(DeletionsElsewhereTest, AnUploadThatBreaksOffIsBegunAnewElsewhere) {
  const PointCloud cloud = NumberedCloud(1, 400'000);
  const ScanHeader header = NumberedHeader(1, cloud);
  {
    STRATA_ASSERT_OK_AND_ASSIGN(const auto upload, db(0).scans().Upload({}, kShared, header));
    STRATA_ASSERT_OK(Write(*upload, cloud, 0, cloud.size() / 2));
  }
  const auto send = [&](api::Database& there) -> absl::StatusOr<ScanAck> {
    STRATA_ASSIGN_OR_RETURN(const auto upload, there.scans().Upload({}, kShared, header));
    STRATA_RETURN_IF_ERROR(Write(*upload, cloud, upload->points_held(), cloud.size()));
    return upload->Finish();
  };
  STRATA_ASSERT_OK_AND_ASSIGN(const ScanAck ack, send(db(1)));
  EXPECT_FALSE(ack.already_present);
  EXPECT_TRUE(send(db(0))->already_present);
  STRATA_EXPECT_OK(AtRest(db(0), kShared));
}

// Server a is a gateway, b, c … are started by the tests.
class RolesTest : public SharingServersTest {
 protected:
  void SetUp() override {
    const auto cluster = SharedPostgresCluster();
    if (absl::IsFailedPrecondition(cluster.status())) GTEST_SKIP() << cluster.status().message();
    STRATA_ASSERT_OK(cluster);
    store_ =
        (*cluster)->AddressOfOwn(::testing::UnitTest::GetInstance()->current_test_info()->name());
    Add("a", "gateway");
  }
  void Add(const char* name, const char* roles) {
    servers_.push_back(
        std::make_unique<SharingServer>(name, store_, std::vector<std::string>{"--role", roles}));
    servers_.back()->Start();
  }
  // As the database has it: "SELECT ….", one value.
  std::string Ask(const char* sql) {
    const auto connection = Connection::Open(store_);
    if (!connection.ok()) return "";
    auto row = (*connection)->Query(sql);
    return row.ok() && row->Next() ? row->Text(0) : "";
  }
  // Who runs a job of a map that another has.
  std::string RunBy() { return Ask("SELECT value FROM truth_job_parameter WHERE name = 'run_by'"); }
  // Scans that a job has seconds of work with.
  void PutLargeScans() {
    for (std::uint64_t scan = 1; scan <= 2; ++scan) {
      const PointCloud cloud = NumberedCloud(scan, 200'000);
      STRATA_ASSERT_OK_AND_ASSIGN(const auto upload,
                                  db(0).scans().Upload({}, kShared, NumberedHeader(scan, cloud)));
      STRATA_ASSERT_OK(Write(*upload, cloud, 0, cloud.size()));
      STRATA_ASSERT_OK(upload->Finish());
    }
    STRATA_ASSERT_OK(AtRest(db(0), kShared));
  }
  JobInfo Started(const char* kind) {
    const auto job = db(0).jobs().Start({}, kShared, kind, {});
    STRATA_EXPECT_OK(job);
    return job.value_or(JobInfo());
  }
  JobInfo Ended(std::uint64_t id) {
    JobInfo last;
    STRATA_EXPECT_OK(
        db(0).jobs().Watch(Within(kPatience), kShared, id, [&last](const JobInfo& now) {
          last = now;
          return absl::OkStatus();
        }));
    return last;
  }
  // Until somebody else than `before` runs one.
  std::string AwaitRun(const std::string& before = "") {
    std::string now;
    STRATA_EXPECT_OK(Insist([&] {
      now = RunBy();
      return now.empty() || now == before ? absl::UnavailableError("nobody") : absl::OkStatus();
    }));
    return now;
  }
  // Of the map kShared, if anybody.
  std::string Owner() {
    return Ask("SELECT server FROM map_lease WHERE expires > clock_timestamp()");
  }
};

TEST_F(RolesTest, AGatewayAloneAnswersWhatNeedsNoOwner) {
  STRATA_ASSERT_OK(db(0).maps().Create({}, kShared, MapParameters()));
  STRATA_ASSERT_OK(PutNumbered(db(0), kShared, 1));
  EXPECT_EQ(db(0).maps().Stats({}, kShared)->scans_pending, 1U);
  STRATA_EXPECT_OK(db(0).tiles().List({}, kShared, api::TileArea()).status());
  STRATA_EXPECT_OK(db(0).maps().SetOrigin({}, kShared, {0.1, 0.2, 300.0}));
  STRATA_EXPECT_OK(db(0).jobs().Start({}, kShared, "rebuild", {}).status());
  const auto says_so =
      StatusIs(absl::StatusCode::kUnavailable, HasSubstr("start one with --role integrator"));
  EXPECT_THAT(SetX(db(0), 1, 1.0), says_so);
  EXPECT_THAT(db(0).maps().Delete(Within(kPatience), kShared), says_so);
  EXPECT_THAT(AskTheOwner(db(0), kShared), says_so);
  EXPECT_EQ(Owner(), "");
  EXPECT_EQ(db(0).maps().Stats({}, kShared)->scans_pending, 1U);
}

// Nobody asks the other for anything.
TEST_F(RolesTest, WhatComesToAGatewayIsDoneByThoseThatTakeMaps) {
  STRATA_ASSERT_OK(db(0).maps().Create({}, kShared, MapParameters()));
  STRATA_ASSERT_OK(PutNumbered(db(0), kShared, 1));
  Add("b", "gateway,integrator,worker");
  STRATA_EXPECT_OK(AtRest(db(0), kShared));
  EXPECT_EQ(Owner(), "b");
  STRATA_EXPECT_OK(SetX(db(0), 1, 1.0));
  STRATA_EXPECT_OK(RunJobOf(db(0), "verify"));
  STRATA_EXPECT_OK(RunJobOf(db(0), "rebuild"));
  EXPECT_EQ(MapOwnerOf(AskTheOwner(db(0), kShared)), "b");
  servers_[1]->Kill();
  STRATA_EXPECT_OK(PutNumbered(db(0), kShared, 2));
  EXPECT_EQ(db(0).maps().Stats({}, kShared)->scans, 2U);
  absl::SleepFor(absl::Milliseconds(2500));  // its lease ends
  STRATA_EXPECT_OK(PutNumbered(db(0), kShared, 3));
  EXPECT_THAT(SetX(db(0), 2, 1.0), StatusIs(absl::StatusCode::kUnavailable, HasSubstr("--role")));
  EXPECT_EQ(Owner(), "");
  Add("c", "integrator");
  STRATA_EXPECT_OK(Insist([&] { return SetX(*servers_[0]->db(), 2, 1.0); }));
  EXPECT_EQ(AtRest(db(0), kShared)->scans, 3U);
  EXPECT_EQ(Owner(), "c");
  // A clean end leaves nobody; what is asked for then brings the next.
  servers_[2]->Signal(SIGTERM);
  servers_[2]->Await();
  STRATA_EXPECT_OK(PutNumbered(db(0), kShared, 4));
  servers_[1]->Start();
  EXPECT_EQ(AtRest(db(0), kShared)->scans, 4U);
  STRATA_EXPECT_OK(db(0).maps().Delete({}, kShared));
  EXPECT_TRUE(absl::IsNotFound(db(1).maps().Stats({}, kShared).status()));
}

// Of a map that another server has.
TEST_F(RolesTest, JobsAreRunByWorkers) {
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

TEST_F(RolesTest, AJobIsCancelledWhereverItRuns) {
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

// One that is frozen writes nothing when it wakes up.
TEST_F(RolesTest, AJobOutlivesItsWorker) {
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
