#include "core/engine/ingest/pose_change.h"

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/common/status.h"
#include "core/storage/sqlite/sqlite_storage.h"
#include "tests/core/engine/engine_fixture.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata::testing {
namespace {

using ::testing::IsEmpty;
using ::testing::SizeIs;

// A map of scans without points.
class PoseChangeTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const std::filesystem::path file = directory_.path() / "map.strata";
    STRATA_ASSERT_OK(CreateSqliteMap(file, MapParameters(), absl::FromUnixSeconds(1000)));
    STRATA_ASSERT_OK_AND_ASSIGN(storage_, OpenSqliteStorage(file, {}));
    STRATA_ASSERT_OK_AND_ASSIGN(reader_, storage_->NewReader());
  }

  absl::Status Commit(absl::FunctionRef<absl::Status(StorageWriter&)> body) {
    return storage_->writer().Commit(Durability::kFull, [&] { return body(storage_->writer()); });
  }

  ScanNumber Put(const ScanId& id, const Pose& T_map_scan, bool integrated = true) {
    ScanRecord scan;
    scan.header.id = id;
    scan.content_hash = "hash";
    STRATA_EXPECT_OK(Commit([&](StorageWriter& writer) -> absl::Status {
      STRATA_ASSIGN_OR_RETURN(scan.number, writer.NextCommitSequence());
      scan.upload = scan.number;
      STRATA_RETURN_IF_ERROR(writer.PutScan(scan));
      if (!integrated) return absl::OkStatus();
      STRATA_RETURN_IF_ERROR(writer.SetScanState(scan.number, ScanState::kIntegrated, ""));
      return writer.PutPose({scan.number, epoch_, T_map_scan, PoseOrigin::kIngest, {}});
    }));
    before_[scan.number] = T_map_scan;
    return scan.number;
  }

  void Hold(ScanNumber i, ScanNumber j) {
    ConstraintRecord record;
    record.scan_i = i;
    record.scan_j = j;
    STRATA_EXPECT_OK(
        Commit([&](StorageWriter& writer) { return writer.PutConstraint(record).status(); }));
  }

  PoseChange Read(std::uint64_t epoch = 1) {
    absl::StatusOr<PoseChange> change = PoseChange::Read(*reader_, epoch);
    EXPECT_THAT(change, IsOk());
    return change.ok() ? *std::move(change) : PoseChange();
  }

  // Where scans come to; those that do not move are left out.
  static std::map<ScanNumber, Pose> Moves(const PoseChange& change,
                                          const MoveTolerance& tolerance = {}) {
    std::map<ScanNumber, Pose> moves;
    for (const ProposedPose& pose : change.Resolve(tolerance).moves) {
      moves[pose.scan] = pose.T_map_scan;
    }
    return moves;
  }

  // That `scan` is where it was relative to `partner`.
  void ExpectCarried(const std::map<ScanNumber, Pose>& moves, ScanNumber scan, ScanNumber partner) {
    ASSERT_TRUE(moves.contains(scan));
    ASSERT_TRUE(moves.contains(partner));
    const Pose was = before_[partner].inverse() * before_[scan];
    const Pose is = moves.at(partner).inverse() * moves.at(scan);
    EXPECT_TRUE(is.isApprox(was, 1e-12));
  }

  TempDir directory_;
  std::unique_ptr<MapStorage> storage_;
  std::unique_ptr<StorageReader> reader_;
  std::uint64_t epoch_ = 1;
  std::map<ScanNumber, Pose> before_;
};

TEST_F(PoseChangeTest, KnowsTheIntegratedScansWithTheirPoses) {
  const ScanNumber first = Put({"b", 7}, PoseAt(1, 2, 0.3));
  Put({"a", 1}, PoseAt(5, 5), false);
  const ScanNumber second = Put({"a", 2}, PoseAt(3, 4));
  const PoseChange change = Read();
  ASSERT_THAT(change.scans(), SizeIs(2));
  EXPECT_EQ(change.scans()[0].scan.number, first);
  EXPECT_EQ(change.scans()[1].scan.number, second);
  EXPECT_TRUE(change.scans()[0].pose->T_map_scan.isApprox(PoseAt(1, 2, 0.3), 0.0));
  EXPECT_THAT(Moves(change), IsEmpty());
}

TEST_F(PoseChangeTest, ScansFollowTheOneBeforeOnTheirTrajectory) {
  const ScanNumber first = Put({"run", 10}, PoseAt(1, 0, 0.1));
  const ScanNumber second = Put({"run", 20}, PoseAt(2, 1, 0.5));
  const ScanNumber third = Put({"run", 21}, PoseAt(4, 1, 1.5));
  const ScanNumber other = Put({"other", 11}, PoseAt(2, 1, 0.5));
  PoseChange change = Read();
  change.Decide(first, PoseAt(10, 5, 2.0));
  const auto moves = Moves(change);
  EXPECT_THAT(moves, SizeIs(3));
  ExpectCarried(moves, second, first);
  ExpectCarried(moves, third, first);
  EXPECT_FALSE(moves.contains(other));
  EXPECT_EQ(change.Resolve({}).carried, 2U);  // nothing leads to the other trajectory
}

TEST_F(PoseChangeTest, WhatAScanWasHeldAgainstComesFirst) {
  const ScanNumber near = Put({"other", 1}, PoseAt(2, 1, 0.5));
  const ScanNumber far = Put({"other", 2}, PoseAt(9, 1, 0.5));
  const ScanNumber before = Put({"run", 1}, PoseAt(1, 0, 0.1));
  const ScanNumber scan = Put({"run", 2}, PoseAt(2, 0, 0.2));
  Hold(near, scan);  // recorded nearest first
  Hold(scan, far);   // either way round
  PoseChange change = Read();
  change.Decide(near, PoseAt(-3, 0, 0.7));
  change.Decide(far, PoseAt(4, -5, 0.9));
  change.Decide(before, PoseAt(7, 7, 1.9));
  ExpectCarried(Moves(change), scan, near);
}

// Scans that came in late, and the first of a trajectory.
TEST_F(PoseChangeTest, YoungerScansCarryToo) {
  const ScanNumber first = Put({"run", 1}, PoseAt(1, 0, 0.1));
  const ScanNumber second = Put({"run", 2}, PoseAt(2, 1, 0.4));
  const ScanNumber held = Put({"other", 1}, PoseAt(8, 1, 2.5));
  const ScanNumber last = Put({"run", 3}, PoseAt(4, 1, 1.1));
  Hold(held, last);
  PoseChange change = Read();
  change.Decide(last, PoseAt(-2, 3, 0.3));
  const auto moves = Moves(change);
  EXPECT_THAT(moves, SizeIs(4));
  ExpectCarried(moves, second, last);
  ExpectCarried(moves, first, second);  // by one that is carried itself
  ExpectCarried(moves, held, last);
  EXPECT_EQ(change.Resolve({}).carried, 3U);
}

TEST_F(PoseChangeTest, TheNearestOfThoseDecidedCarries) {
  const ScanNumber far = Put({"a", 1}, PoseAt(0, 0));
  const ScanNumber scan = Put({"run", 7}, PoseAt(10, 0, 0.7));
  const ScanNumber near = Put({"b", 1}, PoseAt(9, 0, 0.2));
  const ScanNumber undecided = Put({"c", 1}, PoseAt(10, 0));
  const ScanNumber beside = Put({"run", 8}, PoseAt(10, 0.1));
  for (const ScanNumber partner : {far, near, undecided}) Hold(partner, scan);
  PoseChange change = Read();
  change.Decide(far, PoseAt(1, 1, 0.1));
  change.Decide(near, PoseAt(9, 3, 0.4));
  change.Decide(beside, PoseAt(5, 5, 0.4));
  const auto moves = Moves(change);
  ExpectCarried(moves, scan, near);
  ExpectCarried(moves, undecided, scan);
}

// Every third scan of a bent way is decided as the whole way is turned: the others turn with it,
// whatever the order in which they came in.
TEST_F(PoseChangeTest, ARigidMotionOfSomeIsOneOfAll) {
  const Pose turn = PoseAt(3, -7, 0.8);
  std::vector<std::uint64_t> order = {5, 9, 1, 8, 2, 12, 3, 7, 11, 4, 10, 6};
  std::map<std::uint64_t, ScanNumber> scans;
  for (const std::uint64_t k : order) {
    const auto n = static_cast<double>(k);
    scans[k] = Put({"run", k}, PoseAt(2 * n, 0.3 * n * n, 0.2 * n));
  }
  PoseChange change = Read();
  for (std::uint64_t k = 2; k <= 12; k += 3) change.Decide(scans[k], turn * before_[scans[k]]);
  const auto moves = Moves(change);
  ASSERT_THAT(moves, SizeIs(12));
  for (const auto& [scan, pose] : moves) {
    EXPECT_TRUE(pose.isApprox(turn * before_[scan], 1e-9)) << scan;
  }
}

TEST_F(PoseChangeTest, WhatIsDecidedStays) {
  const ScanNumber first = Put({"run", 1}, PoseAt(1, 0));
  const ScanNumber second = Put({"run", 2}, PoseAt(2, 0));
  const ScanNumber third = Put({"run", 3}, PoseAt(3, 0));
  PoseChange change = Read();
  change.Decide(first, PoseAt(1, 5));
  change.Decide(second, PoseAt(2, 0));
  change.Decide(999, PoseAt(2, 0));  // not in the map
  const auto moves = Moves(change);
  EXPECT_THAT(moves, SizeIs(1));
  EXPECT_TRUE(moves.contains(first));
  EXPECT_FALSE(moves.contains(third));  // its predecessor stays, so does it
  EXPECT_EQ(change.Resolve({}).carried, 1U);
}

TEST_F(PoseChangeTest, SmallChangesAreNone) {
  const ScanNumber shifted = Put({"a", 1}, PoseAt(1, 0, 0.3));
  const ScanNumber turned = Put({"b", 1}, PoseAt(2, 0, 0.3));
  PoseChange change = Read();
  change.Decide(shifted, PoseAt(1.004, 0, 0.3));
  change.Decide(turned, PoseAt(2, 0, 0.3004));
  EXPECT_THAT(Moves(change), IsEmpty());
  EXPECT_THAT(Moves(change, {.translation_m = 0.003, .rotation_rad = 1.0}), SizeIs(1));
  EXPECT_THAT(Moves(change, {.translation_m = 1.0, .rotation_rad = 0.0003}), SizeIs(1));
  EXPECT_THAT(Moves(change, {.translation_m = 0.0, .rotation_rad = 0.0}), SizeIs(2));
}

TEST_F(PoseChangeTest, AnOldEpochIsReadAsItWas) {
  const ScanNumber scan = Put({"run", 1}, PoseAt(1, 0));
  STRATA_ASSERT_OK(Commit([&](StorageWriter& writer) -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(epoch_, writer.BeginEpoch("test", 0));
    return writer.PutPose({scan, epoch_, PoseAt(3, 0), PoseOrigin::kPerson, {}});
  }));
  const ScanNumber younger = Put({"run", 2}, PoseAt(4, 0));
  ASSERT_EQ(epoch_, 2U);
  PoseChange now = Read(2);
  ASSERT_THAT(now.scans(), SizeIs(2));
  const PoseChange then = Read(1);
  ASSERT_THAT(then.scans(), SizeIs(1));
  EXPECT_TRUE(then.scans()[0].pose->T_map_scan.isApprox(PoseAt(1, 0)));
  // Going back takes along what came after.
  now.Decide(scan, then.scans()[0].pose->T_map_scan);
  const auto moves = Moves(now);
  EXPECT_TRUE(moves.at(younger).isApprox(PoseAt(2, 0), 1e-12));
}

}  // namespace
}  // namespace strata::testing
