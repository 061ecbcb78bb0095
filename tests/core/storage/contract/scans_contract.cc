// Scans, their pieces, and transactions.
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/common/status.h"
#include "core/storage/sqlite/sqlite_storage.h"
#include "core/storage/storage.h"
#include "core/world/value_codec.h"
#include "tests/core/storage/contract/storage_contract.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class ScansContractTest : public StorageContractTest {};

TEST_F(ScansContractTest, ScanComesBackToTheBit) {
  const ScanNumber number = Put(7);
  Reopen();
  STRATA_ASSERT_OK_AND_ASSIGN(const std::optional<PosedScan> found,
                              reader().FindScan({"run", 7}, 1));
  ASSERT_TRUE(found.has_value());
  EXPECT_EQ(found->scan.number, number);
  EXPECT_EQ(EncodeScanHeader(found->scan.header), EncodeScanHeader(Scan(7).header));
  EXPECT_EQ(found->scan.box_scan.min(), Scan(7).box_scan.min());
  EXPECT_FALSE(found->pose.has_value());
  EXPECT_THAT(reader().GetChunk(7, 0), IsOkAndHolds(std::string("bytes")));
  EXPECT_THAT(reader().FindScan({"run", 8}, 1), IsOkAndHolds(::testing::Eq(std::nullopt)));
}

TEST_F(ScansContractTest, ACopyIsAStoreOfItsOwnAndCommitsGoOn) {
  const ScanNumber number = Put(7);
  const std::filesystem::path copy = directory_.path() / "it's a copy.strata";
  STRATA_ASSERT_OK(reader().CopyTo(copy, Stop()));
  Put(8);  // does not wait for anything
  EXPECT_THAT(reader().CopyTo(copy, Stop()),
              StatusIs(absl::StatusCode::kAlreadyExists, HasSubstr("a copy.strata")));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto opened, OpenSqliteStorage(copy, {}));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto copied, opened->NewReader());
  EXPECT_THAT(copied->ListScanNumbers(), IsOkAndHolds(ElementsAre(number)));
  EXPECT_THAT(copied->GetChunk(7, 0), IsOkAndHolds(std::string("bytes")));
  STRATA_ASSERT_OK_AND_ASSIGN(const MapClock clock, copied->GetClock());
  EXPECT_EQ(clock.commit_sequence, number);
}

TEST_F(ScansContractTest, ACopyStopsWhenAsked) {
  const ScanNumber number = Put(1);
  const Stop stop;
  stop.Request();
  EXPECT_THAT(reader().CopyTo(directory_.path() / "copy.strata", stop),
              StatusIs(absl::StatusCode::kCancelled, ::testing::_));
  EXPECT_THAT(reader().ListScanNumbers(), IsOkAndHolds(ElementsAre(number)));
}

TEST_F(ScansContractTest, FailedCommitLeavesNothingAndFailedPartOnlyItself) {
  const absl::Status failed = Commit([&]() -> absl::Status {
    STRATA_RETURN_IF_ERROR(writer().PutChunk(1, 0, "a"));
    return absl::AbortedError("no");
  });
  EXPECT_THAT(failed, StatusIs(absl::StatusCode::kAborted, HasSubstr("no")));
  EXPECT_FALSE(reader().GetChunk(1, 0).ok());
  STRATA_ASSERT_OK(Commit([&]() -> absl::Status {
    STRATA_RETURN_IF_ERROR(writer().PutChunk(1, 0, "a"));
    EXPECT_FALSE(writer()
                     .Part([&]() -> absl::Status {
                       STRATA_RETURN_IF_ERROR(writer().PutChunk(2, 0, "b"));
                       return absl::AbortedError("no");
                     })
                     .ok());
    return absl::OkStatus();
  }));
  EXPECT_THAT(reader().GetChunk(1, 0), IsOkAndHolds(std::string("a")));
  EXPECT_FALSE(reader().GetChunk(2, 0).ok());
}

TEST_F(ScansContractTest, SameScanIdTwiceIsRefused) {
  Put(1);
  ScanRecord again = Scan(1);
  again.number = 99;
  again.upload = 99;
  EXPECT_THAT(Commit([&] { return writer().PutScan(again); }),
              StatusIs(absl::StatusCode::kAlreadyExists, HasSubstr("run/1")));
}

TEST_F(ScansContractTest, OrphansGoAndScansStay) {
  Put(1);
  STRATA_ASSERT_OK(Commit([&] { return writer().PutChunk(50, 0, "orphan"); }));
  STRATA_ASSERT_OK(Commit([&] { return writer().AbandonOrphans(); }));
  EXPECT_THAT(reader().GetChunk(50, 0),
              StatusIs(absl::StatusCode::kDataLoss, HasSubstr("piece 0")));
  EXPECT_THAT(reader().GetChunk(1, 0), IsOk());
}

TEST_F(ScansContractTest, KeptUploadsStayUntilTheyAreScansOrAbandoned) {
  const auto keep =
      [&](std::uint64_t upload, std::uint32_t ordinal, const char* bytes, int second) {
        UnfinishedUpload unfinished;
        unfinished.upload = upload;
        unfinished.id = {"run", upload};
        unfinished.content_hash = "hash";
        unfinished.touched = absl::FromUnixSeconds(second);
        return Commit([&]() -> absl::Status {
          STRATA_RETURN_IF_ERROR(writer().PutChunk(upload, ordinal, bytes));
          return writer().KeepUpload(unfinished);
        });
      };
  STRATA_ASSERT_OK(keep(50, 0, "12345", 10));
  STRATA_ASSERT_OK(keep(60, 0, "12345", 20));
  STRATA_ASSERT_OK(keep(50, 1, "678", 30));
  STRATA_ASSERT_OK(Commit([&] { return writer().AbandonOrphans(); }));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto found, reader().ListUnfinishedUploads());
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].upload, 50U);
  EXPECT_EQ(found[0].id, (ScanId{"run", 50}));
  EXPECT_EQ(found[0].content_hash, "hash");
  EXPECT_EQ(found[0].touched, absl::FromUnixSeconds(30));
  EXPECT_EQ(found[0].chunks, 2U);
  EXPECT_EQ(found[0].bytes, 8U);

  ScanRecord scan = Scan(50);
  STRATA_ASSERT_OK(Commit([&]() -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(scan.number, writer().NextCommitSequence());
    return writer().PutScan(scan);
  }));
  STRATA_ASSERT_OK(Commit([&] { return writer().AbandonUpload(60); }));
  STRATA_ASSERT_OK(Commit([&] { return writer().AbandonOrphans(); }));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto left, reader().ListUnfinishedUploads());
  EXPECT_TRUE(left.empty());
  EXPECT_THAT(reader().GetChunk(50, 1), IsOkAndHolds(std::string("678")));
  EXPECT_FALSE(reader().GetChunk(60, 0).ok());
}

TEST_F(ScansContractTest, BoxQueryMeetsFootprintsExactly) {
  const ScanNumber number = Put(1);
  const Eigen::AlignedBox2d footprint(Eigen::Vector2d(1e6 + 0.01, 0), Eigen::Vector2d(1e6 + 1, 1));
  STRATA_ASSERT_OK(Commit([&] { return writer().SetFootprint(number, footprint); }));
  const auto count = [&](double x0, double x1) {
    ScanQuery query;
    query.box = Eigen::AlignedBox2d(Eigen::Vector2d(x0, 0.5), Eigen::Vector2d(x1, 0.6));
    return reader().ListScans(query, 1)->size();
  };
  EXPECT_EQ(count(1e6 - 5, 1e6 + 0.009), 0U);
  EXPECT_EQ(count(1e6 - 5, 1e6 + 0.011), 1U);
  EXPECT_EQ(count(1e6 + 1.001, 1e6 + 9), 0U);
}

TEST_F(ScansContractTest, DeletedScanTakesEverythingAlong) {
  const ScanNumber a = Put(1);
  const ScanNumber b = Put(2);
  STRATA_ASSERT_OK(Commit([&]() -> absl::Status {
    ConstraintRecord constraint;
    constraint.scan_i = a;
    constraint.scan_j = b;
    STRATA_RETURN_IF_ERROR(writer().PutConstraint(constraint).status());
    return writer().SetTilesOfScan(a, {{0, 1, 2}});
  }));
  EXPECT_THAT(reader().ScansOfTile({0, 1, 2}), IsOkAndHolds(ElementsAre(a)));
  EXPECT_EQ(reader().ListConstraints(9)->at(0).constraint.j.sequence, 2U);
  STRATA_ASSERT_OK(Commit([&] { return writer().DeleteScan(a); }));
  EXPECT_THAT(reader().ScansOfTile({0, 1, 2}), IsOkAndHolds(ElementsAre()));
  EXPECT_TRUE(reader().ListConstraints(9)->empty());
  EXPECT_EQ(reader().GetScanTotals()->scans, 1U);
  EXPECT_FALSE(reader().GetChunk(1, 0).ok());
}

TEST_F(ScansContractTest, ScansAreFoundByEveryConditionAndInOrder) {
  for (std::uint64_t i = 1; i <= 5; ++i) {
    ScanRecord scan = Scan(i);
    scan.header.id.trajectory = i <= 3 ? "run" : "walk";
    scan.header.time = absl::FromUnixSeconds(static_cast<std::int64_t>(100 * i));
    STRATA_ASSERT_OK(Commit([&]() -> absl::Status {
      STRATA_ASSIGN_OR_RETURN(scan.number, writer().NextCommitSequence());
      return writer().PutScan(scan);
    }));
  }
  STRATA_ASSERT_OK(
      Commit([&] { return writer().SetScanState(2, ScanState::kIntegrated, "left out: 3"); }));
  STRATA_ASSERT_OK(Commit([&] { return writer().SetScanState(4, ScanState::kFailed, "why"); }));
  EXPECT_THAT(NumbersOf(ScanQuery()), ElementsAre(1, 2, 3, 4, 5));
  ScanQuery query;
  query.limit = 0;
  EXPECT_THAT(NumbersOf(query), ElementsAre());
  query.after = 2;
  query.limit = 2;
  EXPECT_THAT(NumbersOf(query), ElementsAre(3, 4));
  query = {};
  query.trajectory = "walk";
  EXPECT_THAT(NumbersOf(query), ElementsAre(4, 5));
  query = {};
  query.state = ScanState::kPending;
  EXPECT_THAT(NumbersOf(query), ElementsAre(1, 3, 5));
  query = {};
  query.from = absl::FromUnixSeconds(200);
  query.until = absl::FromUnixSeconds(400);
  EXPECT_THAT(NumbersOf(query), ElementsAre(2, 3));
  EXPECT_EQ(reader().GetScan(2, 1)->scan.message, "left out: 3");
  EXPECT_THAT(reader().GetScan(9, 1), StatusIs(absl::StatusCode::kNotFound, HasSubstr("9")));
  STRATA_ASSERT_OK_AND_ASSIGN(const ScanTotals totals, reader().GetScanTotals());
  EXPECT_EQ(totals.scans, 5U);
  EXPECT_EQ(totals.pending, 3U);
  EXPECT_EQ(totals.failed, 1U);
  EXPECT_EQ(totals.points, 150U);
  EXPECT_EQ(totals.point_bytes, 25U);
  STRATA_ASSERT_OK_AND_ASSIGN(const UploadState walk, reader().GetUploadState("walk"));
  EXPECT_TRUE(walk.exists);
  EXPECT_EQ(walk.last_sequence, 5U);
  EXPECT_EQ(walk.scans, 2U);
  EXPECT_FALSE(reader().GetUploadState("swim")->exists);
}

TEST_F(ScansContractTest, ALocalMapComesInPlaceOfThePoints) {
  const ScanNumber number = Put(1);
  EXPECT_THAT(reader().GetLocalMap(number),
              StatusIs(absl::StatusCode::kDataLoss, HasSubstr("local map of scan")));
  STRATA_ASSERT_OK(Commit([&]() -> absl::Status {
    STRATA_RETURN_IF_ERROR(writer().PutLabels(number, LabelOrigin::kPerson, 0, {"a"}));
    STRATA_RETURN_IF_ERROR(writer().DropPoints(number, "old"));
    return writer().DropPoints(number, "local");
  }));
  EXPECT_THAT(reader().GetLocalMap(number), IsOkAndHolds(std::string("local")));
  EXPECT_FALSE(reader().GetChunk(1, 0).ok());
  EXPECT_FALSE(reader().FindLabels(number, LabelOrigin::kPerson, 0)->has_value());
  STRATA_ASSERT_OK_AND_ASSIGN(const PosedScan scan, reader().GetScan(number, 1));
  EXPECT_FALSE(scan.scan.has_points);
  EXPECT_EQ(scan.scan.chunks, 0U);
  EXPECT_EQ(scan.scan.point_bytes, 0U);
}

TEST_F(ScansContractTest, DamagedRowsAreNamedOrLeftOut) {
  const ScanNumber number = Put(1);
  PoseRecord pose;
  pose.scan = number;
  pose.epoch = 1;
  STRATA_ASSERT_OK(Commit([&] { return writer().PutPose(pose); }));
  STRATA_EXPECT_OK(reader().CheckScanRow(number));
  EXPECT_THAT(reader().CheckScanRow(99), StatusIs(absl::StatusCode::kNotFound, HasSubstr("99")));
  STRATA_ASSERT_OK(store().DamagePoses("no pose"));
  Put(2);
  Put(3);
  const auto damaged = StatusIs(absl::StatusCode::kDataLoss, HasSubstr("run/1"));
  EXPECT_THAT(reader().GetScan(number, 1), damaged);
  EXPECT_THAT(reader().FindScan({"run", 1}, 1), damaged);
  EXPECT_THAT(reader().ListScans({}, 1), damaged);
  EXPECT_THAT(reader().CheckScanRow(number),
              StatusIs(absl::StatusCode::kDataLoss, HasSubstr("in epoch 1")));
  ScanQuery sound;
  sound.skip_damaged = true;
  for (const std::uint32_t limit : {2, 1}) {
    sound.limit = limit;
    EXPECT_EQ(NumbersOf(sound).size(), limit);
  }
  EXPECT_EQ(reader().ListScanNumbers()->size(), 3U);
  STRATA_ASSERT_OK(store().DamageHeaders(""));
  EXPECT_THAT(reader().CheckScanRow(2),
              StatusIs(absl::StatusCode::kDataLoss, HasSubstr("scan header")));
  EXPECT_TRUE(NumbersOf(sound).empty());
}

TEST_F(ScansContractTest, FootprintsOfAnySizeAreMetWhereTheyAre) {
  const auto box = [](double x0, double y0, double x1, double y1) {
    return Eigen::AlignedBox2d(Eigen::Vector2d(x0, y0), Eigen::Vector2d(x1, y1));
  };
  const std::vector<Eigen::AlignedBox2d> boxes = {box(-1, -1, 1, 1),
                                                  box(63.9, -64.1, 64.1, -63.9),
                                                  box(-1e9, -1e9, 1e9, 1e9),
                                                  box(500, 0, 900, 3000),
                                                  box(1e30, 1e30, 2e30, 2e30)};
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const ScanNumber number = Put(i + 1);
    STRATA_ASSERT_OK(Commit([&] { return writer().SetFootprint(number, boxes[i]); }));
    EXPECT_EQ(reader().FootprintOfScan(number)->value().min(), boxes[i].min());
    EXPECT_EQ(reader().FootprintOfScan(number)->value().max(), boxes[i].max());
  }
  EXPECT_FALSE(reader().FootprintOfScan(99)->has_value());
  const auto met = [&](const Eigen::AlignedBox2d& asked) {
    ScanQuery query;
    query.box = asked;
    return NumbersOf(query);
  };
  for (const Eigen::AlignedBox2d& asked : {box(0, 0, 0, 0),
                                           box(64, -64, 64, -64),
                                           box(64.2, -64, 65, -64),
                                           box(600, 2999, 601, 5000),
                                           box(-1e12, -1e12, 1e12, 1e12),
                                           box(1.5e30, 1.5e30, 1.6e30, 1.6e30),
                                           box(-2000, -2000, 2000, 2000)}) {
    std::vector<ScanNumber> expected;  // by looking at each
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      if (boxes[i].intersects(asked)) expected.push_back(i + 1);
    }
    EXPECT_EQ(met(asked), expected) << asked.min().transpose() << " to " << asked.max().transpose();
  }
  EXPECT_TRUE(met(Eigen::AlignedBox2d()).empty());
  STRATA_ASSERT_OK(Commit([&] { return writer().SetFootprint(1, box(700, 700, 701, 701)); }));
  EXPECT_THAT(met(box(0, 0, 0, 0)), ElementsAre(3));
  EXPECT_THAT(met(box(700, 700, 700, 700)), ElementsAre(1, 3, 4));
  STRATA_ASSERT_OK(Commit([&] { return writer().SetFootprint(1, Eigen::AlignedBox2d()); }));
  EXPECT_FALSE(reader().FootprintOfScan(1)->has_value());
  STRATA_ASSERT_OK(Commit([&] { return writer().DeleteScan(3); }));
  EXPECT_THAT(met(box(700, 700, 700, 700)), ElementsAre(4));
}

}  // namespace
}  // namespace strata::testing
