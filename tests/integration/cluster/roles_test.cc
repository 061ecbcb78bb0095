// Servers of one database that take maps and servers that do not, and maps that are deleted by
// servers that have not got them.
#include "tests/integration/cluster/roles.h"

#include <csignal>
#include <cstddef>
#include <cstdint>
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
#include "core/storage/postgresql/connection.h"
#include "tests/integration/cluster/sharing_servers.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::HasSubstr;

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

}  // namespace
}  // namespace strata::testing
