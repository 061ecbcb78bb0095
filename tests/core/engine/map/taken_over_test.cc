// A map that was another server's, which does not answer: what that one was at may be no fault of
// it.
#include <memory>
#include <string>

#include "absl/strings/str_cat.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/engine/engine.h"
#include "core/storage/postgresql/connection.h"
#include "tests/core/engine/engine_fixture.h"
#include "tests/support/postgres_cluster.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata::testing {
namespace {

using ::testing::StartsWith;

constexpr std::uint64_t kDeathsToHold = 10;

class TakenOverTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto cluster = SharedPostgresCluster();
    if (absl::IsFailedPrecondition(cluster.status())) GTEST_SKIP() << cluster.status().message();
    STRATA_ASSERT_OK(cluster);
    options_.directory = directory_.path();
    options_.store = (*cluster)->AddressOfOwn(directory_.path().string());
    const auto database = OpenEngine(options_);
    STRATA_ASSERT_OK(database);
    STRATA_ASSERT_OK((*database)->maps().Create({}, kMapName, SmallMap()));
    const PointCloud room = MakeRoom(1);
    STRATA_ASSERT_OK(Upload(**database, HeaderOf(id_, room, RoomPose(1)), room));
    WaitIntegrated(**database);
  }
  void Sql(const std::string& sql) const {
    STRATA_ASSERT_OK_AND_ASSIGN(const auto connection, Connection::Open(options_.store));
    STRATA_ASSERT_OK(connection->Execute(sql.c_str()));
  }
  // The scan waits, was under way, and whoever was at it was `deaths` times thought to have died.
  void PutUnderWay(std::uint64_t deaths) const {
    Sql("UPDATE truth_scan SET state = 1; DELETE FROM truth_pose; UPDATE derived_state SET "
        "complete = 0; DELETE FROM attempt");
    Sql(absl::StrCat(
        "INSERT INTO attempt (map, kind, id, deaths, under_way) SELECT map, 1, number, ",
        deaths,
        ", 1 FROM truth_scan"));
  }
  void LetLeaseOfAnotherLapse() const {
    Sql("INSERT INTO map_lease (map, token, holder, server, expires) SELECT map, 7, 'another', "
        "'another', clock_timestamp() - interval '1 second' FROM truth_map");
  }
  // As a server finds the scan that takes the map over now.
  ScanInfo TakeOver() const {
    const auto database = OpenEngine(options_);
    STRATA_EXPECT_OK(database);
    if (!database.ok()) return {};
    WaitIntegrated(**database);
    const auto found = (*database)->scans().Get({}, kMapName, id_);
    STRATA_EXPECT_OK(found);
    return found.value_or(ScanInfo());
  }

  const TempDir directory_;
  const ScanId id_ = {"run", 1};
  EngineOptions options_;
};

TEST_F(TakenOverTest, AScanIsNotPutAsideWhoseServersWereFrozenOrCutOff) {
  PutUnderWay(kDeathsToHold - 2);
  LetLeaseOfAnotherLapse();
  const ScanInfo found = TakeOver();
  EXPECT_EQ(found.state, ScanState::kIntegrated) << found.message;
}

TEST_F(TakenOverTest, ButIfTooManyDiedOfIt) {
  PutUnderWay(kDeathsToHold - 1);
  LetLeaseOfAnotherLapse();
  const ScanInfo found = TakeOver();
  EXPECT_EQ(found.state, ScanState::kFailed);
  EXPECT_THAT(found.message, StartsWith("quarantined: the server died 10 times"));
}

TEST_F(TakenOverTest, WhoeverGaveTheMapUpHasNotDied) {
  PutUnderWay(kDeathsToHold - 1);
  const ScanInfo found = TakeOver();
  EXPECT_EQ(found.state, ScanState::kIntegrated) << found.message;
}

}  // namespace
}  // namespace strata::testing
