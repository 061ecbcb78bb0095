// A disk that is full or fails: errors are values, what was acknowledged stays, and once the disk
// is well again so is the map.
#include <cstdint>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "absl/base/config.h"
#include "absl/status/status.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/core/engine/engine_fixture.h"
#include "tests/support/faults/faulty_disk.h"
#include "tests/support/patience.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::AnyOf;
using Code = absl::StatusCode;

struct Trouble {
  std::string name;
  DiskFault fault;
};
void PrintTo(const Trouble& trouble, std::ostream* out) { *out << trouble.name; }

class DiskFaultTest : public EngineTest, public ::testing::WithParamInterface<Trouble> {
 protected:
  void SetUp() override { MakeMap(); }
  ~DiskFaultTest() override { Close(); }  // before the disk goes

  absl::Status Put(std::uint64_t sequence) {
    const PointCloud cloud = MakeRoom(sequence);
    const Pose T_map_scan = PoseAt(static_cast<double>(sequence % 20), 0.0);
    return Upload(db(), HeaderOf({"run", sequence}, cloud, T_map_scan), cloud).status();
  }
  // Uploads scans `first` to `last`; those that are acknowledged join acknowledged_.
  int PutAll(std::uint64_t first, std::uint64_t last) {
    int failed = 0;
    for (std::uint64_t sequence = first; sequence <= last; ++sequence) {
      const absl::Status put = Put(sequence);
      if (put.ok()) {
        acknowledged_.insert(sequence);
        continue;
      }
      ++failed;
      EXPECT_THAT(put.code(), AnyOf(Code::kResourceExhausted, Code::kUnavailable)) << put;
    }
    return failed;
  }
  void ExpectAcknowledgedAreThere() {
    for (const std::uint64_t sequence : acknowledged_) {
      PointCloud back;
      STRATA_EXPECT_OK(db().scans().GetPoints({}, kMapName, {"run", sequence}, [&](const auto& p) {
        back.points.insert(back.points.end(), p.points.begin(), p.points.end());
        return absl::OkStatus();
      }));
      EXPECT_EQ(back.points, MakeRoom(sequence).points) << sequence;
    }
  }

  FaultyDisk disk_;
  std::set<std::uint64_t> acknowledged_;
};

TEST_P(DiskFaultTest, NothingAcknowledgedIsLostAndTheMapGoesOn) {
  EXPECT_EQ(PutAll(1, 5), 0);
  std::uint64_t next = 6;
  int failed = 0;
  for (const int sound : {0, 1, 2, 3, 5, 8, 13, 21, 34}) {
    SCOPED_TRACE(sound);
    disk_.Fail(GetParam().fault, sound);
    failed += PutAll(next, next + 2);
    disk_.Mend();
    EXPECT_EQ(PutAll(next, next + 2), 0);  // again, those that failed among them
    ExpectAcknowledgedAreThere();
    next += 3;
  }
  EXPECT_GT(failed, 5);
  EXPECT_GT(disk_.failed(), 5);
  EXPECT_EQ(WaitIntegrated(db()).scans, acknowledged_.size());
  ExpectSound();
  Reopen();
  ExpectAcknowledgedAreThere();
  ExpectSound();
}

TEST_P(DiskFaultTest, AMapThatIsClosedOnAFailingDiskOpensAgain) {
  for (const int sound : {0, 1, 4, 9, 20}) {
    SCOPED_TRACE(sound);
    const std::uint64_t first = acknowledged_.empty() ? 1 : *acknowledged_.rbegin() + 10;
    EXPECT_EQ(PutAll(first, first + 3), 0);
    disk_.Fail(GetParam().fault, sound);
    PutAll(first + 4, first + 6);
    Close();
    disk_.Mend();
    Reopen();
    ExpectAcknowledgedAreThere();
    EXPECT_GE(WaitIntegrated(db()).scans, acknowledged_.size());
    ExpectSound();
  }
}

TEST_P(DiskFaultTest, CallsThatChangeTheMapSaySoAndChangeNothing) {
  EXPECT_EQ(PutAll(1, 4), 0);
  const std::string digest = WaitIntegrated(db()).content_digest;
  disk_.Fail(GetParam().fault, 0);
  const auto trouble = AnyOf(StatusIs(Code::kResourceExhausted, ::testing::_),
                             StatusIs(Code::kUnavailable, ::testing::_));
  EXPECT_THAT(db().scans().Delete({}, kMapName, {"run", 2}), trouble);
  EXPECT_THAT(db().posegraph().SetPose({}, kMapName, {"run", 3}, PoseAt(5, 5)), trouble);
  RobotProfile profile;
  profile.radius_m = 0.7;
  EXPECT_THAT(db().planning().SetProfile({}, kMapName, "cart", profile), trouble);
  EXPECT_THAT(db().planning().SetProfile({}, kMapName, api::kDefaultProfile, profile), trouble);
  EXPECT_THAT(db().jobs().Start({}, kMapName, "verify", {}), trouble);
  EXPECT_THAT(db().maps().Create({}, "other", SmallMap()), trouble);
  EXPECT_EQ(db().maps().Stats({}, kMapName)->content_digest, digest);
  disk_.Mend();
  EXPECT_EQ(WaitIntegrated(db()).content_digest, digest);
  STRATA_ASSERT_OK_AND_ASSIGN(const auto profiles, db().planning().ListProfiles({}, kMapName));
  EXPECT_EQ(profiles.size(), 1U);
  EXPECT_EQ(profiles.begin()->second, RobotProfile());
  ExpectSound();
  STRATA_EXPECT_OK(db().maps().Create({}, "other", SmallMap()));
  STRATA_EXPECT_OK(db().scans().Delete({}, kMapName, {"run", 2}));
  ExpectSound();
}

// It is made under another name: nothing of it may be left behind there.
TEST_P(DiskFaultTest, AMapIsMadeAsAWholeOrNotAtAll) {
  std::int64_t failed = -1;
  int refused = 0;
  for (int n = 0; disk_.failed() > failed; n += 1 + n / 16) {
    const std::string name = "made" + std::to_string(n);
    failed = disk_.failed();
    disk_.Fail(GetParam().fault, n, 1);
    const absl::Status made = db().maps().Create({}, name, SmallMap()).status();
    disk_.Mend();
    if (!made.ok()) {
      ++refused;
      EXPECT_THAT(made.code(), AnyOf(Code::kResourceExhausted, Code::kUnavailable)) << made;
      EXPECT_THAT(db().maps().Get({}, name), StatusIs(Code::kNotFound, ::testing::_));
      STRATA_EXPECT_OK(db().maps().Create({}, name, SmallMap()));
    }
    UploadRoom(1, RoomPose(1), name);
  }
  EXPECT_GT(refused, 2);
  Reopen();
  STRATA_ASSERT_OK_AND_ASSIGN(const std::vector<MapInfo> maps, db().maps().List({}));
  for (const MapInfo& map : maps) {
    if (map.name == kMapName) continue;
    EXPECT_EQ(WaitIntegrated(db(), map.name).scans, 1U) << map.name;
  }
}

// Its tiles were put into the store beside the current ones, and could not be discarded either.
TEST_P(DiskFaultTest, NothingOfAMoveThatFailedIsTakenForAnother) {
  EXPECT_EQ(PutAll(1, 4), 0);
  WaitIntegrated(db());
  std::uint64_t next = 5;
  for (int sound = 0; sound < 400; sound += 1 + sound / 4) {
    SCOPED_TRACE(sound);
    const Pose T_map_scan = PoseAt(3.0, 0.1 * sound, 0.2);
    disk_.Fail(GetParam().fault, sound);
    const absl::Status moved = db().posegraph().SetPose({}, kMapName, {"run", 2}, T_map_scan);
    disk_.Mend();
    if (sound % 2 == 0) {
      EXPECT_EQ(PutAll(next, next), 0);
      ++next;
    } else {
      STRATA_EXPECT_OK(db().posegraph().SetPose({}, kMapName, {"run", 2}, T_map_scan));
    }
    WaitIntegrated(db());
    ExpectSound();
    if (moved.ok()) break;
  }
}

// The end of a job is stored before anybody sees it.
TEST_P(DiskFaultTest, AJobWhoseEndCannotBeStoredRunsAgain) {
  EXPECT_EQ(PutAll(1, 30), 0);
  WaitIntegrated(db());
  STRATA_ASSERT_OK_AND_ASSIGN(JobInfo job, db().jobs().Start({}, kMapName, "verify", {}));
  disk_.Fail(GetParam().fault, 0);
  while (disk_.failed() == 0) {
    STRATA_ASSERT_OK_AND_ASSIGN(job, db().jobs().Get({}, kMapName, job.id));
    ASSERT_FALSE(IsFinal(job.state)) << job.message;
  }
  disk_.Mend();
  STRATA_ASSERT_OK(db().jobs().Watch({}, kMapName, job.id, [&job](const JobInfo& info) {
    job = info;
    return absl::OkStatus();
  }));
  EXPECT_EQ(job.state, JobState::kSucceeded) << job.message;
}

// Whichever way a write fails, the same code tidies up after it: the address sanitizer, many times
// slower, sees it once.
std::vector<Trouble> Troubles() {
#ifdef ABSL_HAVE_ADDRESS_SANITIZER
  return {{"WriteError", DiskFault::kWrite}};
#else
  return {{"Full", DiskFault::kFull},
          {"WriteError", DiskFault::kWrite},
          {"SyncError", DiskFault::kSync}};
#endif
}

INSTANTIATE_TEST_SUITE_P(Disk,
                         DiskFaultTest,
                         ::testing::ValuesIn(Troubles()),
                         [](const auto& trouble) { return trouble.param.name; });

class DiskMendedTest : public EngineTest {
 protected:
  ~DiskMendedTest() override { Close(); }  // before the disk goes

  // Files beside those of the map.
  std::vector<std::string> Leftovers() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(directory_.path())) {
      const std::string name = entry.path().filename().string();
      if (absl::StartsWith(name, ".making-") || absl::StartsWith(name, ".copy-")) {
        names.push_back(name);
      }
    }
    return names;
  }

  FaultyDisk disk_;
};

TEST_F(DiskMendedTest, AMapThatCouldNotBeOpenedIsOpenedOnceTheDiskIsWell) {
  for (const DiskFault fault : {DiskFault::kOpen, DiskFault::kRead}) {
    SCOPED_TRACE(static_cast<int>(fault));
    const std::string map = absl::StrCat("map", static_cast<int>(fault));
    MakeMap(SmallMap(), map);
    UploadRoom(1, PoseAt(0, 0), map);
    WaitIntegrated(db(), map);
    Close();
    disk_.Fail(fault, 0);
    Reopen();
    EXPECT_THAT(db().maps().Get({}, map).status().code(),
                AnyOf(Code::kResourceExhausted, Code::kUnavailable));
    disk_.Mend();
    // It is tried once a second.
    const absl::Time deadline = absl::Now() + kPatience;
    while (!db().maps().Get({}, map).ok() && absl::Now() < deadline) {
      absl::SleepFor(absl::Milliseconds(20));
    }
    EXPECT_EQ(WaitIntegrated(db(), map).scans, 1U);
    UploadRoom(2, PoseAt(0, 0), map);
  }
}

TEST_F(DiskMendedTest, WhatCouldNotBeMadeLeavesNoFiles) {
  MakeMap();
  UploadRoom(1, PoseAt(0, 0));
  WaitIntegrated(db());
  const auto ignore = [](const api::BackupPiece&) { return absl::OkStatus(); };
  for (std::int64_t sound = 0; sound < 40; sound += 3) {
    SCOPED_TRACE(sound);
    disk_.Fail(DiskFault::kFull, sound);
    if (db().maps().Create({}, "other", SmallMap()).ok()) {
      STRATA_EXPECT_OK(db().maps().Delete({}, "other"));
    }
    EXPECT_THAT(Leftovers(), ::testing::IsEmpty());
    disk_.Fail(DiskFault::kFull, sound);
    db().maps().Backup({}, kMapName, ignore).IgnoreError();
    EXPECT_THAT(Leftovers(), ::testing::IsEmpty());
  }
  disk_.Mend();
  STRATA_EXPECT_OK(db().maps().Create({}, "other", SmallMap()));
  STRATA_EXPECT_OK(db().maps().Backup({}, kMapName, ignore));
  EXPECT_THAT(Leftovers(), ::testing::IsEmpty());
}

}  // namespace
}  // namespace strata::testing
