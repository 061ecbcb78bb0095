// Scans that the process died of, as the next starts see them.
#include "core/engine/map/quarantine.h"

#include <cstdint>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/engine/map/numbers.h"
#include "core/engine/map/quarantine_file.h"
#include "tests/core/engine/engine_fixture.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr std::uint64_t kRooms = 5;

class QuarantineTest : public EngineTest {
 protected:
  void SetUp() override {
    MakeMap();
    UploadRooms(kRooms);
    digest_ = Digest();
    Close();
  }
  // As a process leaves the map that died while it integrated all rooms for the first time.
  void ForgetIntegration() {
    Sql("UPDATE truth_scan SET state = 1, message = ''; DELETE FROM truth_pose; DELETE FROM "
        "truth_constraint; DROP TABLE derived_state; UPDATE truth_map SET epoch = 1");
  }
  // `deaths` before this one.
  void PutUnderWay(std::uint64_t room, int deaths) {
    Sql(absl::StrCat("INSERT OR REPLACE INTO attempt SELECT 1, number, ",
                     deaths,
                     ", 1 FROM truth_scan WHERE sequence = ",
                     room));
  }
  ScanInfo Info(std::uint64_t room) {
    for (const ScanInfo& scan : Scans()) {
      if (scan.header.id.sequence == room) return scan;
    }
    ADD_FAILURE() << "no room " << room;
    return {};
  }
  std::vector<ScanInfo> Scans() {
    std::vector<ScanInfo> scans;
    STRATA_EXPECT_OK(db().scans().List({}, kMapName, {}, [&](const ScanInfo& scan) {
      scans.push_back(scan);
      return absl::OkStatus();
    }));
    return scans;
  }
  std::string NameOf(std::uint64_t room) {
    return absl::StrCat("scan ", Info(room).header.id.ToString());
  }
  std::vector<QuarantineEntry> Listed() {
    const auto listed = ListQuarantine({directory_.path()}, kMapName);
    STRATA_EXPECT_OK(listed);
    return listed.value_or(std::vector<QuarantineEntry>());
  }

  std::string digest_;
};

TEST_F(QuarantineTest, ABatchThatDiedOnceIsTakenScanByScan) {
  ForgetIntegration();
  for (std::uint64_t room = 1; room <= kRooms; ++room) PutUnderWay(room, 0);
  EXPECT_THAT(Listed(), SizeIs(kRooms));
  for (const QuarantineEntry& entry : Listed()) {
    EXPECT_FALSE(entry.held) << entry.name;
    EXPECT_EQ(entry.attempt.deaths, 1U);
  }
  Reopen();
  const MapStats stats = WaitIntegrated(db());
  EXPECT_EQ(stats.scans_failed, 0U);
  EXPECT_EQ(stats.content_digest, digest_);
  ExpectSound();
  Close();
  EXPECT_THAT(Listed(), IsEmpty());
}

TEST_F(QuarantineTest, AScanThatDiedTwiceIsNamedAndTheOthersGoOn) {
  ForgetIntegration();
  PutUnderWay(3, 1);
  Reopen();
  const std::string name = NameOf(3);
  EXPECT_EQ(WaitIntegrated(db()).scans_failed, 1U);
  EXPECT_EQ(Info(3).state, ScanState::kFailed);
  EXPECT_THAT(Info(3).message,
              HasSubstr("quarantined: the server died 2 times while integrating it"));
  for (const std::uint64_t room : {1, 2, 4, 5}) {
    EXPECT_EQ(Info(room).state, ScanState::kIntegrated) << room;
  }
  ExpectSound();
  EXPECT_THAT(AddToQuarantine({directory_.path()}, kMapName, name),
              StatusIs(absl::StatusCode::kFailedPrecondition, HasSubstr("in use")));
  // Every further start leaves it there.
  Reopen();
  EXPECT_EQ(WaitIntegrated(db()).scans_failed, 1U);
  Close();
  ASSERT_THAT(Listed(), SizeIs(1));
  EXPECT_EQ(Listed()[0].name, name);
  EXPECT_TRUE(Listed()[0].held);

  STRATA_ASSERT_OK(ReleaseFromQuarantine({directory_.path()}, kMapName, name));
  EXPECT_THAT(ReleaseFromQuarantine({directory_.path()}, kMapName, name),
              StatusIs(absl::StatusCode::kFailedPrecondition, HasSubstr("not in quarantine")));
  EXPECT_THAT(Listed(), IsEmpty());
  Reopen();
  EXPECT_EQ(WaitIntegrated(db()).content_digest, digest_);
  ExpectSound();
}

TEST_F(QuarantineTest, AScanThatWaitsIsPutAsideByHand) {
  Reopen();
  const std::string name = NameOf(2);
  Close();
  EXPECT_THAT(AddToQuarantine({directory_.path()}, kMapName, name),
              StatusIs(absl::StatusCode::kFailedPrecondition, HasSubstr("does not wait")));
  ForgetIntegration();
  STRATA_ASSERT_OK(AddToQuarantine({directory_.path()}, kMapName, name));
  Reopen();
  EXPECT_EQ(WaitIntegrated(db()).scans_failed, 1U);
  EXPECT_THAT(Info(2).message, HasSubstr("quarantined: put aside by hand"));
  // It can be deleted, too, and nothing is left of it then.
  STRATA_ASSERT_OK(db().scans().Delete({}, kMapName, Info(2).header.id));
  Close();
  EXPECT_THAT(Listed(), IsEmpty());
  EXPECT_THAT(AddToQuarantine({directory_.path()}, kMapName, "scan nobody/1"),
              StatusIs(absl::StatusCode::kNotFound, HasSubstr("nobody/1")));
  EXPECT_THAT(AddToQuarantine({directory_.path()}, kMapName, "dog 1"),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("dog 1")));
  EXPECT_THAT(AddToQuarantine({directory_.path()}, "nomap", "job 1"),
              StatusIs(absl::StatusCode::kNotFound, HasSubstr("nomap")));
}

// The worker takes nothing until the rebuild is released.
TEST_F(QuarantineTest, WhoWatchesSeesForHowLongTheOldestScanWaits) {
  const auto age = [this] { return NumbersOf(db()).maps.at(0).pending_age; };
  Reopen();
  WaitIntegrated(db());
  EXPECT_EQ(age(), absl::ZeroDuration());
  Close();
  Sql("DROP TABLE derived_state; INSERT INTO attempt VALUES (3, 0, 1, 1)");
  Reopen();
  EXPECT_EQ(age(), absl::ZeroDuration());
  UploadRoom(77, PoseAt(0, 0));
  absl::SleepFor(absl::Milliseconds(2));
  const absl::Duration first = age();
  EXPECT_GT(first, absl::ZeroDuration());
  absl::SleepFor(absl::Milliseconds(2));
  EXPECT_GT(age(), first);
}

TEST_F(QuarantineTest, ARebuildThatDiedTwiceIsNotBegun) {
  Sql("DROP TABLE derived_state; INSERT INTO attempt VALUES (3, 0, 1, 1)");
  Reopen();
  EXPECT_THAT(db().scans().Delete({}, kMapName, Info(1).header.id),
              StatusIs(absl::StatusCode::kFailedPrecondition, HasSubstr("quarantined")));
  EXPECT_THAT(db().planning().SampleSurfaces({}, kMapName, {{0.0, 0.0}}),
              StatusIs(absl::StatusCode::kFailedPrecondition, HasSubstr("quarantined")));
  STRATA_EXPECT_OK(db().maps().Stats({}, kMapName));
  Close();
  STRATA_ASSERT_OK(ReleaseFromQuarantine({directory_.path()}, kMapName, "rebuild"));
  Reopen();
  ExpectSound();
  EXPECT_EQ(Digest(), digest_);
}

}  // namespace
}  // namespace strata::testing
