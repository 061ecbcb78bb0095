// What every store of a map must do; run against each implementation.
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
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
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class StorageContractTest : public ::testing::Test {
 protected:
  void SetUp() override {
    STRATA_ASSERT_OK(CreateSqliteMap(file(), MapParameters(), absl::FromUnixSeconds(1000)));
    Reopen();
  }
  void Reopen(const SqliteOptions& options = {}) {
    reader_.reset();
    storage_.reset();
    auto opened = OpenSqliteStorage(file(), options);
    ASSERT_THAT(opened, IsOk());
    storage_ = *std::move(opened);
    auto reader = storage_->NewReader();
    ASSERT_THAT(reader, IsOk());
    reader_ = *std::move(reader);
  }
  std::filesystem::path file() const { return directory_.path() / "map.strata"; }
  StorageWriter& writer() { return storage_->writer(); }
  StorageReader& reader() { return *reader_; }

  absl::Status Commit(absl::FunctionRef<absl::Status()> body) {
    return writer().Commit(Durability::kFull, body);
  }
  ScanRecord Scan(std::uint64_t sequence) {
    ScanRecord scan;
    scan.header.id = {"run", sequence};
    scan.header.T_map_scan =
        MakePose(Eigen::Quaterniond(0.1, 0.2, 0.3, 0.9), {0.1 + sequence, 2.0 / 3.0, -1e7});
    scan.header.point_count = 10 * sequence;
    scan.header.sensor = SensorModel{.sigma_m = 0.0123};
    scan.upload = sequence;
    scan.chunks = 1;
    scan.point_bytes = 5;
    scan.box_scan.extend(Eigen::Vector3f(-1, -2, -3));
    scan.box_scan.extend(Eigen::Vector3f(1, 2, 3));
    scan.content_hash = "hash";
    return scan;
  }
  ScanNumber Put(std::uint64_t sequence) {
    ScanRecord scan = Scan(sequence);
    STRATA_EXPECT_OK(Commit([&]() -> absl::Status {
      STRATA_ASSIGN_OR_RETURN(scan.number, writer().NextCommitSequence());
      STRATA_RETURN_IF_ERROR(writer().PutChunk(scan.upload, 0, "bytes"));
      return writer().PutScan(scan);
    }));
    return scan.number;
  }
  absl::Status PutTile(const TileKey& key, std::uint64_t version, bool gone, std::string bytes) {
    return Commit([&] {
      SurfaceTileRow row;
      row.key = key;
      row.version = version;
      row.gone = gone;
      row.bytes = std::move(bytes);
      return writer().PutSurfaceTile(row);
    });
  }

  TempDir directory_;
  std::unique_ptr<MapStorage> storage_;
  std::unique_ptr<StorageReader> reader_;
};

TEST_F(StorageContractTest, ScanComesBackToTheBit) {
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

TEST_F(StorageContractTest, ACopyIsAStoreOfItsOwnAndCommitsGoOn) {
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

// Or a nightly copy of a large map would be a whole one each night.
TEST_F(StorageContractTest, CopiesShareThePagesThatDidNotChange) {
  for (std::uint64_t i = 1; i <= 20; ++i) {
    STRATA_ASSERT_OK(Commit([&] { return writer().PutChunk(i, 0, std::string(50'000, 'a')); }));
  }
  const auto pages_of = [&](const char* name) {
    const std::filesystem::path file = directory_.path() / name;
    EXPECT_THAT(reader().CopyTo(file, Stop()), IsOk());
    std::ifstream stream(file, std::ios::binary);
    std::vector<std::string> pages;
    for (std::string page(8192, ' '); stream.read(page.data(), 8192);) pages.push_back(page);
    return pages;
  };
  const std::vector<std::string> before = pages_of("before.strata");
  STRATA_ASSERT_OK(Commit([&] { return writer().PutChunk(10, 1, std::string(50'000, 'b')); }));
  const std::vector<std::string> after = pages_of("after.strata");
  ASSERT_GT(before.size(), 20 * 50'000 / 8192);
  ASSERT_GE(after.size(), before.size());
  std::size_t changed = 0;
  for (std::size_t i = 0; i < before.size(); ++i) changed += before[i] == after[i] ? 0 : 1;
  EXPECT_LE(changed, 10U);
}

TEST_F(StorageContractTest, ACopyStopsWhenAsked) {
  const ScanNumber number = Put(1);
  const Stop stop;
  stop.Request();
  EXPECT_THAT(reader().CopyTo(directory_.path() / "copy.strata", stop),
              StatusIs(absl::StatusCode::kCancelled, ::testing::_));
  EXPECT_THAT(reader().ListScanNumbers(), IsOkAndHolds(ElementsAre(number)));
}

TEST_F(StorageContractTest, FailedCommitLeavesNothingAndFailedPartOnlyItself) {
  const absl::Status failed = Commit([&]() -> absl::Status {
    STRATA_RETURN_IF_ERROR(writer().PutChunk(1, 0, "a"));
    return absl::AbortedError("no");
  });
  EXPECT_THAT(failed, StatusIs(absl::StatusCode::kAborted, HasSubstr("no")));
  EXPECT_THAT(reader().LastUpload(), IsOkAndHolds(0U));
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
  EXPECT_THAT(reader().LastUpload(), IsOkAndHolds(1U));
}

TEST_F(StorageContractTest, SameScanIdTwiceIsRefused) {
  Put(1);
  ScanRecord again = Scan(1);
  again.number = 99;
  again.upload = 99;
  EXPECT_THAT(Commit([&] { return writer().PutScan(again); }),
              StatusIs(absl::StatusCode::kAlreadyExists, HasSubstr("run/1")));
}

TEST_F(StorageContractTest, OrphansGoAndScansStay) {
  Put(1);
  STRATA_ASSERT_OK(Commit([&] { return writer().PutChunk(50, 0, "orphan"); }));
  STRATA_ASSERT_OK(Commit([&] { return writer().AbandonOrphans(); }));
  EXPECT_THAT(reader().GetChunk(50, 0),
              StatusIs(absl::StatusCode::kDataLoss, HasSubstr("piece 0")));
  EXPECT_THAT(reader().GetChunk(1, 0), IsOk());
}

TEST_F(StorageContractTest, KeptUploadsStayUntilTheyAreScansOrAbandoned) {
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
  EXPECT_THAT(reader().LastUpload(), IsOkAndHolds(60U));

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

TEST_F(StorageContractTest, PoseOfAnEpochIsTheNewestUpToIt) {
  const ScanNumber number = Put(1);
  const auto put = [&](std::uint64_t epoch, double x) {
    PoseRecord pose;
    pose.scan = number;
    pose.epoch = epoch;
    pose.T_map_scan.translation().x() = x;
    STRATA_EXPECT_OK(Commit([&] { return writer().PutPose(pose); }));
  };
  put(1, 10.0);
  put(4, 40.0);
  for (const auto& [epoch, x] :
       std::vector<std::pair<int, double>>{{1, 10}, {3, 10}, {4, 40}, {9, 40}}) {
    STRATA_ASSERT_OK_AND_ASSIGN(const PosedScan scan, reader().GetScan(number, epoch));
    ASSERT_TRUE(scan.pose.has_value());
    EXPECT_EQ(scan.pose->T_map_scan.translation().x(), x) << epoch;
  }
  EXPECT_FALSE(reader().GetScan(number, 0)->pose.has_value());
  EXPECT_EQ(reader().GetScan(number, 9)->scan.header.T_map_scan.translation().x(), 1.1);
}

TEST_F(StorageContractTest, ReaderOfAVersionSeesTheNewestTileUpToIt) {
  const TileKey key{0, -3, 5};
  STRATA_ASSERT_OK(PutTile(key, 10, false, "ten"));
  STRATA_ASSERT_OK(PutTile(key, 20, false, "twenty"));
  STRATA_ASSERT_OK(PutTile(key, 30, true, ""));
  STRATA_ASSERT_OK(PutTile({1, -2, 2}, 20, false, "up"));
  EXPECT_FALSE(reader().FindSurfaceTile(key, 9)->has_value());
  EXPECT_EQ(reader().FindSurfaceTile(key, 19)->value().bytes, "ten");
  EXPECT_EQ(reader().FindSurfaceTile(key, 29)->value().bytes, "twenty");
  EXPECT_FALSE(reader().FindSurfaceTile(key, 30)->has_value());
  EXPECT_EQ(reader().ListSurfaceTiles({}, 25)->size(), 1U);
  EXPECT_EQ(reader().ListSurfaceTiles({}, 30)->size(), 0U);
  EXPECT_EQ(reader().ListSurfaceTiles({.level = 1}, 30)->size(), 1U);
  STRATA_ASSERT_OK(Commit([&] { return writer().CollectSurfaceTile(key, 25); }));
  EXPECT_FALSE(reader().FindSurfaceTile(key, 19)->has_value());
  EXPECT_EQ(reader().FindSurfaceTile(key, 25)->value().bytes, "twenty");
  STRATA_ASSERT_OK(Commit([&]() -> absl::Status {
    STRATA_RETURN_IF_ERROR(writer().PublishTiles(20, true));
    return writer().DiscardUnpublished();
  }));
  EXPECT_EQ(reader().FindSurfaceTile(key, 99)->value().bytes, "twenty");
}

TEST_F(StorageContractTest, BoxQueryMeetsFootprintsExactly) {
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

ConstraintRecord Between(ScanNumber i, ScanNumber j, ConstraintOrigin origin) {
  ConstraintRecord record;
  record.scan_i = i;
  record.scan_j = j;
  record.constraint.origin = origin;
  return record;
}

PlaneRecord PlaneOf(const std::vector<ScanNumber>& scans) {
  PlaneRecord record;
  record.plane.plane.distance = 2.5;
  record.scans = scans;
  record.plane.supports.assign(scans.size(), {{}, 4.0, 0.01});
  return record;
}

TEST_F(StorageContractTest, ConstraintsAndPlanesShareTheirIds) {
  const ScanNumber a = Put(1);
  const ScanNumber b = Put(2);
  std::uint64_t first = 0;
  STRATA_ASSERT_OK(Commit([&]() -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(first,
                            writer().PutConstraint(Between(a, b, ConstraintOrigin::kIngest)));
    STRATA_RETURN_IF_ERROR(writer().ProposePlane(7, PlaneOf({a, b})));
    STRATA_RETURN_IF_ERROR(writer().AdoptProposal(7));
    return writer().PutConstraint(Between(0, b, ConstraintOrigin::kPerson)).status();
  }));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto constraints, reader().ListConstraints(1));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto planes, reader().ListPlanes(1));
  ASSERT_EQ(constraints.size(), 2U);
  ASSERT_EQ(planes.size(), 1U);
  EXPECT_EQ(constraints[0].constraint.id, first);
  EXPECT_EQ(planes[0].plane.id, first + 1);
  EXPECT_EQ(constraints[1].constraint.id, first + 2);
  EXPECT_TRUE(constraints[1].constraint.is_prior());
  EXPECT_EQ(planes[0].plane.plane.distance, 2.5);
  EXPECT_THAT(planes[0].scans, ElementsAre(a, b));
  EXPECT_EQ(planes[0].plane.supports[1].scan.sequence, 2U);
  for (const std::uint64_t id : {first, first + 1}) {
    STRATA_EXPECT_OK(Commit([&] { return writer().EnableConstraint(id, false); }));
  }
  EXPECT_FALSE(reader().ListConstraints(1)->at(0).constraint.enabled);
  EXPECT_FALSE(reader().ListPlanes(1)->at(0).plane.enabled);
  EXPECT_THAT(Commit([&] { return writer().EnableConstraint(first + 3, false); }),
              StatusIs(absl::StatusCode::kNotFound, HasSubstr("constraint")));
  EXPECT_THAT(Commit([&] { return writer().DeleteConstraint(first + 3); }),
              StatusIs(absl::StatusCode::kNotFound, HasSubstr("constraint")));
  STRATA_EXPECT_OK(Commit([&] { return writer().DeleteConstraint(first); }));
  EXPECT_EQ(reader().ListConstraints(1)->size(), 1U);
}

TEST_F(StorageContractTest, ProposalsAreSeenOnceAdoptedAndGoneOnceDiscarded) {
  const ScanNumber a = Put(1);
  const ScanNumber b = Put(2);
  const auto propose = [&](std::uint64_t job) {
    return Commit([&]() -> absl::Status {
      Pose pose = Pose::Identity();
      pose.translation().x() = static_cast<double>(job);
      STRATA_RETURN_IF_ERROR(writer().ProposePose(job, {a, pose}));
      STRATA_RETURN_IF_ERROR(
          writer().ProposeConstraint(job, Between(a, b, ConstraintOrigin::kOptimize)));
      return writer().ProposePlane(job, PlaneOf({a, b}));
    });
  };
  STRATA_ASSERT_OK(propose(3));
  STRATA_ASSERT_OK(propose(4));
  EXPECT_TRUE(reader().ListConstraints(1)->empty());
  EXPECT_TRUE(reader().ListPlanes(1)->empty());
  ASSERT_EQ(reader().ListProposedPoses(3)->size(), 1U);
  EXPECT_EQ(reader().ListProposedPoses(3)->at(0).T_map_scan.translation().x(), 3.0);
  STRATA_ASSERT_OK(Commit([&] { return writer().DiscardProposal(4); }));
  EXPECT_TRUE(reader().ListProposedPoses(4)->empty());
  const auto adopt = [&](std::uint64_t job) {
    return Commit([&]() -> absl::Status {
      STRATA_RETURN_IF_ERROR(writer().BeginEpoch("better", job).status());
      return writer().AdoptProposal(job);
    });
  };
  STRATA_ASSERT_OK(adopt(3));
  EXPECT_TRUE(reader().ListConstraints(1)->empty());
  EXPECT_EQ(reader().ListConstraints(2)->size(), 1U);
  EXPECT_EQ(reader().ListPlanes(2)->size(), 1U);
  EXPECT_TRUE(reader().ListProposedPoses(3)->empty());
  // The next one's planes replace them, its constraints come on top.
  STRATA_ASSERT_OK(propose(5));
  STRATA_ASSERT_OK(adopt(5));
  EXPECT_EQ(reader().ListConstraints(3)->size(), 2U);
  EXPECT_EQ(reader().ListPlanes(3)->size(), 1U);
  EXPECT_NE(reader().ListPlanes(3)->at(0).plane.id, reader().ListPlanes(2)->at(0).plane.id);
}

TEST_F(StorageContractTest, AnEpochComesBackWithItsConstraints) {
  const ScanNumber a = Put(1);
  const ScanNumber b = Put(2);
  const auto epoch = [&](std::uint64_t job) {
    return Commit([&]() -> absl::Status {
      STRATA_RETURN_IF_ERROR(
          writer().ProposeConstraint(job, Between(a, b, ConstraintOrigin::kOptimize)));
      STRATA_RETURN_IF_ERROR(writer().ProposePlane(job, PlaneOf({a, b})));
      STRATA_RETURN_IF_ERROR(writer().BeginEpoch("better", job).status());
      return writer().AdoptProposal(job);
    });
  };
  const auto back_to = [&](std::uint64_t old) {
    return Commit([&]() -> absl::Status {
      STRATA_RETURN_IF_ERROR(writer().BeginEpoch("back", 0).status());
      return writer().RestoreConstraints(old);
    });
  };
  STRATA_ASSERT_OK(epoch(1));  // 2: one closure
  STRATA_ASSERT_OK(epoch(2));  // 3: two
  ConstraintRecord doubtful = Between(a, b, ConstraintOrigin::kPerson);
  doubtful.constraint.may_be_false = true;
  STRATA_ASSERT_OK(Commit([&] { return writer().PutConstraint(doubtful).status(); }));
  STRATA_ASSERT_OK(back_to(1));  // 4: the person's only
  STRATA_ASSERT_OK(back_to(3));  // 5: all three
  STRATA_ASSERT_OK(back_to(2));  // 6: one closure, the person's
  const std::vector<std::size_t> expected = {0, 1, 3, 1, 3, 2};
  for (std::size_t e = 1; e <= 6; ++e) {
    EXPECT_EQ(reader().ListConstraints(e)->size(), expected[e - 1]) << "epoch " << e;
    EXPECT_EQ(reader().ListPlanes(e)->size(), e == 1 || e == 4 ? 0U : 1U) << "epoch " << e;
    STRATA_ASSERT_OK_AND_ASSIGN(const auto constraints, reader().ListConstraints(e));
    for (const ConstraintRecord& record : constraints) {
      EXPECT_EQ(record.constraint.may_be_false,
                record.constraint.origin == ConstraintOrigin::kPerson)
          << "epoch " << e;
    }
  }
  STRATA_ASSERT_OK_AND_ASSIGN(const auto epochs, reader().ListEpochs());
  ASSERT_EQ(epochs.size(), 6U);
  EXPECT_TRUE(epochs.front().current);
  EXPECT_EQ(epochs.front().epoch, 6U);
  EXPECT_EQ(epochs[3].job, 2U);
  STRATA_ASSERT_OK(Commit([&] { return writer().ForgetEpochsBefore(5); }));
  EXPECT_EQ(reader().ListConstraints(6)->size(), 2U);
  EXPECT_EQ(reader().ListConstraints(5)->size(), 3U);
  EXPECT_FALSE(reader().ListEpochs()->at(2).kept);
  EXPECT_TRUE(reader().ListEpochs()->at(1).kept);
}

TEST_F(StorageContractTest, ForgottenEpochsKeepWhatLaterOnesUse) {
  const ScanNumber number = Put(1);
  for (const std::uint64_t epoch : {1, 3, 5}) {
    PoseRecord pose;
    pose.scan = number;
    pose.epoch = epoch;
    pose.T_map_scan.translation().x() = static_cast<double>(epoch);
    STRATA_ASSERT_OK(Commit([&] { return writer().PutPose(pose); }));
  }
  STRATA_ASSERT_OK(Commit([&] { return writer().ForgetEpochsBefore(4); }));
  EXPECT_FALSE(reader().GetScan(number, 2)->pose.has_value());
  EXPECT_EQ(reader().GetScan(number, 4)->pose->T_map_scan.translation().x(), 3.0);
  EXPECT_EQ(reader().GetScan(number, 5)->pose->T_map_scan.translation().x(), 5.0);
}

TEST_F(StorageContractTest, ScanViewsAreKeptWithTheirScan) {
  const ScanNumber number = Put(1);
  EXPECT_EQ(reader().FindScanView(number)->place, "");
  STRATA_ASSERT_OK(Commit([&] { return writer().PutScanView(number, {"place", "planes"}); }));
  EXPECT_EQ(reader().FindScanView(number)->place, "place");
  EXPECT_EQ(reader().FindScanView(number)->planes, "planes");
  STRATA_ASSERT_OK(Commit([&] { return writer().DeleteScan(number); }));
  EXPECT_EQ(reader().FindScanView(number)->planes, "");
}

TEST_F(StorageContractTest, LabelsAreReplacedByOriginAndGoWithTheirScan) {
  const ScanNumber number = Put(1);
  const auto labels = [&](LabelOrigin origin) {
    std::vector<std::string> pieces;
    for (std::uint32_t piece = 0;; ++piece) {
      const auto found = reader().FindLabels(number, origin, piece);
      STRATA_EXPECT_OK(found);
      if (!found.ok() || !found->has_value()) return pieces;
      pieces.push_back(**found);
    }
  };
  STRATA_ASSERT_OK(Commit([&]() -> absl::Status {
    STRATA_RETURN_IF_ERROR(writer().PutLabels(number, LabelOrigin::kPerson, 0, {"a", "b", "c"}));
    STRATA_RETURN_IF_ERROR(writer().PutLabels(number, LabelOrigin::kModel, 4, {"m"}));
    return writer().PutLabels(number, LabelOrigin::kPerson, 0, {"d"});
  }));
  EXPECT_THAT(labels(LabelOrigin::kPerson), ElementsAre("d"));
  EXPECT_THAT(labels(LabelOrigin::kModel), ElementsAre("m"));
  STRATA_ASSERT_OK_AND_ASSIGN(PosedScan scan, reader().GetScan(number, 1));
  EXPECT_TRUE(scan.scan.person_labels);
  EXPECT_EQ(scan.scan.label_model, 4U);
  STRATA_ASSERT_OK(Commit([&] { return writer().PutLabels(number, LabelOrigin::kPerson, 0, {}); }));
  EXPECT_THAT(labels(LabelOrigin::kPerson), ElementsAre());
  STRATA_ASSERT_OK_AND_ASSIGN(scan, reader().GetScan(number, 1));
  EXPECT_FALSE(scan.scan.person_labels);
  STRATA_ASSERT_OK(Commit([&] { return writer().DeleteScan(number); }));
  EXPECT_THAT(labels(LabelOrigin::kModel), ElementsAre());
}

TEST_F(StorageContractTest, ClassifiersComeBackToTheByteAndTheirIdsAreNotUsedAgain) {
  ClassifierInfo info;
  info.name = "street";
  info.created = absl::FromUnixMicros(123);
  info.job = 3;
  info.description = "learned";
  info.parameters = {{"method", "amn"}};
  info.scores = {{"accuracy", 0.1 + 0.2}};
  std::string bytes(3'000'000, 'x');
  bytes[2'500'000] = 'y';
  info.bytes = bytes.size();
  const auto put = [&] {
    return Commit([&]() -> absl::Status {
      STRATA_ASSIGN_OR_RETURN(info.id, writer().PutClassifier(info, bytes));
      return absl::OkStatus();
    });
  };
  STRATA_ASSERT_OK(put());
  const std::uint64_t first = info.id;
  EXPECT_THAT(put(), StatusIs(absl::StatusCode::kAlreadyExists, HasSubstr("street")));
  Reopen();
  EXPECT_THAT(reader().ListClassifiers(), IsOkAndHolds(ElementsAre(info)));
  EXPECT_THAT(reader().GetClassifier(first), IsOkAndHolds(bytes));
  STRATA_ASSERT_OK(Commit([&] { return writer().DeleteClassifier(first); }));
  EXPECT_THAT(reader().ListClassifiers(), IsOkAndHolds(ElementsAre()));
  STRATA_ASSERT_OK(put());
  EXPECT_GT(info.id, first);
}

TEST_F(StorageContractTest, DeletedScanTakesEverythingAlong) {
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

TEST_F(StorageContractTest, DropDerivedKeepsTruth) {
  Put(1);
  STRATA_ASSERT_OK(PutTile({0, 0, 0}, 1, false, "x"));
  STRATA_ASSERT_OK(Commit([&] { return writer().DropDerived(); }));
  EXPECT_FALSE(reader().GetClock()->derived_complete);
  EXPECT_FALSE(reader().FindSurfaceTile({0, 0, 0}, 99)->has_value());
  EXPECT_EQ(reader().GetScanTotals()->scans, 1U);
}

TEST_F(StorageContractTest, APreparedTileIsFoundOnlyByWhatItIsMadeOf) {
  const TileKey key{0, -3, 7};
  const std::string first("a\0b", 3);  // bytes, not text
  const auto put = [&](const TileKey& at, const std::string& made_of, const std::string& bytes) {
    return Commit([&] { return writer().PutPreparedTile({at, made_of, bytes}); });
  };
  STRATA_ASSERT_OK(put(key, first, "old"));
  STRATA_ASSERT_OK(put({0, -4, 9}, "c", "other"));
  EXPECT_THAT(reader().FindPreparedTile(key, first),
              IsOkAndHolds(::testing::Optional(std::string("old"))));
  EXPECT_THAT(reader().FindPreparedTile(key, "a"), IsOkAndHolds(::testing::Eq(std::nullopt)));
  EXPECT_THAT(reader().FindPreparedTile(key, "c"), IsOkAndHolds(::testing::Eq(std::nullopt)));
  STRATA_ASSERT_OK(put(key, "c", "new"));  // in place of the first
  EXPECT_THAT(reader().FindPreparedTile(key, first), IsOkAndHolds(::testing::Eq(std::nullopt)));
  EXPECT_THAT(reader().FindPreparedTile(key, "c"),
              IsOkAndHolds(::testing::Optional(std::string("new"))));
  Reopen();
  STRATA_ASSERT_OK_AND_ASSIGN(const std::vector<PreparedTileRow> rows,
                              reader().ListPreparedTiles());
  ASSERT_EQ(rows.size(), 2U);
  EXPECT_EQ(rows[0].key, (TileKey{0, -4, 9}));
  EXPECT_EQ(rows[1].key, key);
  EXPECT_EQ(rows[1].made_of, "c");
  EXPECT_TRUE(rows[1].bytes.empty());
  STRATA_ASSERT_OK(Commit([&] { return writer().DeletePreparedTile(key); }));
  EXPECT_THAT(reader().FindPreparedTile(key, "c"), IsOkAndHolds(::testing::Eq(std::nullopt)));
  EXPECT_EQ(reader().ListPreparedTiles()->size(), 1U);
  // Numbers of tiles begin anew then, as far as the store knows.
  STRATA_ASSERT_OK(Commit([&] { return writer().DropDerived(); }));
  EXPECT_TRUE(reader().ListPreparedTiles()->empty());
}

TEST_F(StorageContractTest, APlaneModelIsKeptUntilTheNextAndNoPartOfAnotherIsFound) {
  EXPECT_THAT(reader().JobOfPlaneModel(), IsOkAndHolds(0U));
  const std::string bytes("a\0b", 3);
  const auto put = [&](std::uint64_t job, const std::string& part) {
    return Commit([&]() -> absl::Status {
      STRATA_RETURN_IF_ERROR(writer().DeletePlaneModel());
      STRATA_RETURN_IF_ERROR(writer().PutPlaneModelPart(job, 0, bytes));
      return writer().PutPlaneModelPart(job, 1, part);
    });
  };
  STRATA_ASSERT_OK(put(7, "seven"));
  STRATA_ASSERT_OK(put(9, "nine"));
  Reopen();
  EXPECT_THAT(reader().JobOfPlaneModel(), IsOkAndHolds(9U));
  EXPECT_THAT(reader().FindPlaneModelPart(9, 0), IsOkAndHolds(::testing::Optional(bytes)));
  EXPECT_THAT(reader().FindPlaneModelPart(9, 1),
              IsOkAndHolds(::testing::Optional(std::string("nine"))));
  EXPECT_THAT(reader().FindPlaneModelPart(9, 2), IsOkAndHolds(::testing::Eq(std::nullopt)));
  EXPECT_THAT(reader().FindPlaneModelPart(7, 1), IsOkAndHolds(::testing::Eq(std::nullopt)));
  STRATA_ASSERT_OK(Commit([&] { return writer().DropDerived(); }));
  EXPECT_THAT(reader().JobOfPlaneModel(), IsOkAndHolds(0U));
}

TEST_F(StorageContractTest, AnEntityGoesWithTheLastScanThatSawIt) {
  EXPECT_THAT(reader().JobOfEntities(), IsOkAndHolds(0U));
  const ScanNumber one = Put(1);
  const ScanNumber two = Put(2);
  const auto put = [&](std::uint64_t job) {
    return Commit([&]() -> absl::Status {
      STRATA_RETURN_IF_ERROR(writer().DeleteEntities());
      STRATA_RETURN_IF_ERROR(writer().PutEntityPart(job, {0, "head"}, {}));
      STRATA_RETURN_IF_ERROR(writer().PutEntityPart(job, {1, "both"}, {one, two}));
      return writer().PutEntityPart(job, {2, "first"}, {one});
    });
  };
  STRATA_ASSERT_OK(put(7));
  STRATA_ASSERT_OK(put(9));
  Reopen();
  EXPECT_THAT(reader().JobOfEntities(), IsOkAndHolds(9U));
  EXPECT_FALSE(reader().FindEntityPart(7, std::nullopt)->has_value());
  EXPECT_EQ((*reader().FindEntityPart(9, std::nullopt))->bytes, "head");
  EXPECT_EQ((*reader().FindEntityPart(9, 0))->bytes, "both");
  EXPECT_EQ((*reader().FindEntityPart(9, 1))->bytes, "first");
  EXPECT_FALSE(reader().FindEntityPart(9, 2)->has_value());
  STRATA_ASSERT_OK(Commit([&] { return writer().DeleteScan(one); }));
  EXPECT_EQ((*reader().FindEntityPart(9, std::nullopt))->bytes, "head");
  EXPECT_EQ((*reader().FindEntityPart(9, 0))->bytes, "both");
  EXPECT_FALSE(reader().FindEntityPart(9, 1)->has_value());
  STRATA_ASSERT_OK(Commit([&] { return writer().DeleteScan(two); }));
  EXPECT_FALSE(reader().FindEntityPart(9, 0)->has_value());
  EXPECT_THAT(reader().JobOfEntities(), IsOkAndHolds(9U));
}

TEST_F(StorageContractTest, WhatWasInferredGoesWithAnyScanThatItsKindWasSeenBy) {
  EXPECT_THAT(reader().JobOfInferred(), IsOkAndHolds(0U));
  const ScanNumber one = Put(1);
  const ScanNumber two = Put(2);
  const auto put = [&]() -> absl::Status {
    STRATA_RETURN_IF_ERROR(writer().DeleteInferred());
    STRATA_RETURN_IF_ERROR(writer().PutInferredPart(9, 0, {0, "head"}));
    STRATA_RETURN_IF_ERROR(writer().PutInferredPart(9, 70, {4, "car"}));
    STRATA_RETURN_IF_ERROR(writer().PutInferredPart(9, 71, {5, "bench"}));
    STRATA_RETURN_IF_ERROR(writer().PutInferredScan(70, one));
    STRATA_RETURN_IF_ERROR(writer().PutInferredScan(70, two));
    return writer().PutInferredScan(71, two);
  };
  STRATA_ASSERT_OK(Commit(put));
  STRATA_ASSERT_OK(Commit(put));
  Reopen();
  EXPECT_THAT(reader().JobOfInferred(), IsOkAndHolds(9U));
  EXPECT_EQ((*reader().FindInferredPart(9, std::nullopt))->bytes, "head");
  EXPECT_EQ((*reader().FindInferredPart(9, 0))->bytes, "car");
  EXPECT_EQ((*reader().FindInferredPart(9, 4))->bytes, "bench");
  EXPECT_FALSE(reader().FindInferredPart(9, 5)->has_value());
  STRATA_ASSERT_OK(Commit([&] { return writer().DeleteScan(one); }));
  EXPECT_EQ((*reader().FindInferredPart(9, std::nullopt))->bytes, "head");
  EXPECT_EQ((*reader().FindInferredPart(9, 0))->bytes, "bench");
  STRATA_ASSERT_OK(Commit([&] { return writer().DeleteEntities(); }));
  EXPECT_THAT(reader().JobOfInferred(), IsOkAndHolds(0U));
}

TEST_F(StorageContractTest, KindsOfTheLibraryAreKeptAndFoundOnesGoWithTheEntities) {
  const auto ids = [&] {
    std::vector<std::string> names;
    const auto kinds = reader().ListKinds();
    STRATA_EXPECT_OK(kinds);
    if (!kinds.ok()) return names;
    for (const KindRow& row : *kinds) {
      names.push_back(absl::StrCat(row.id, row.in_library ? " " : " found", row.name, row.info));
    }
    return names;
  };
  EXPECT_THAT(ids(), ElementsAre());
  STRATA_ASSERT_OK(Commit([&]() -> absl::Status {
    STRATA_RETURN_IF_ERROR(writer().PutKind({9, "golf", true, "+"}, std::string("s\0h", 3)));
    STRATA_RETURN_IF_ERROR(writer().PutFoundKind({4, "", false, "-"}, "found"));
    return writer().PutFoundKind({9, "", false, "-"}, "hidden");
  }));
  Reopen();
  EXPECT_THAT(ids(), ElementsAre("9 golf+", "4 found-"));
  EXPECT_EQ(**reader().FindKindShape(9), std::string("s\0h", 3));
  EXPECT_EQ(**reader().FindKindShape(4), "found");
  EXPECT_FALSE(reader().FindKindShape(5)->has_value());
  const auto put = [&](std::uint64_t id, const std::string& name) {
    return Commit([&] { return writer().PutKind({id, name, true, "+"}, "x"); });
  };
  EXPECT_THAT(put(9, "other"), StatusIs(absl::StatusCode::kAlreadyExists, HasSubstr("other")));
  EXPECT_THAT(put(10, "golf"), StatusIs(absl::StatusCode::kAlreadyExists, HasSubstr("golf")));
  STRATA_ASSERT_OK(put(4, "van"));
  EXPECT_THAT(Commit([&] { return writer().RenameKind(4, "golf"); }),
              StatusIs(absl::StatusCode::kAlreadyExists, HasSubstr("golf")));
  STRATA_ASSERT_OK(Commit([&] { return writer().RenameKind(4, "bus"); }));
  EXPECT_THAT(ids(), ElementsAre("4 bus+", "9 golf+"));
  STRATA_ASSERT_OK(Commit([&] { return writer().DeleteKind(9); }));
  EXPECT_THAT(ids(), ElementsAre("4 bus+", "9 found-"));
  STRATA_ASSERT_OK(Commit([&] { return writer().DeleteEntities(); }));
  EXPECT_THAT(ids(), ElementsAre("4 bus+"));
  STRATA_ASSERT_OK(Commit([&] { return writer().PutFoundKind({5, "", false, "-"}, "found"); }));
  STRATA_ASSERT_OK(Commit([&] { return writer().DropDerived(); }));
  EXPECT_THAT(ids(), ElementsAre("4 bus+"));
  EXPECT_EQ(**reader().FindKindShape(4), "x");
}

TEST_F(StorageContractTest, FullStoreIsAnErrorAndLosesNothing) {
  Put(1);
  Reopen({.max_file_bytes = 400'000});
  const std::string large(300'000, 'x');
  EXPECT_THAT(Commit([&]() -> absl::Status {
                STRATA_RETURN_IF_ERROR(writer().PutChunk(8, 0, large));
                return writer().PutChunk(8, 1, large);
              }),
              StatusIs(absl::StatusCode::kResourceExhausted, HasSubstr("full")));
  EXPECT_EQ(reader().GetScanTotals()->scans, 1U);
  Put(2);
}

// A full store ends the whole transaction, not the part alone that met it.
TEST_F(StorageContractTest, FullStoreInOnePartEndsTheWholeCommit) {
  Put(1);
  Reopen();  // all of it is in the file
  Reopen({.max_file_bytes = std::filesystem::file_size(file()) + 150'000});
  const std::string large(60'000, 'x');
  const auto part = [&](std::uint64_t upload, int pieces) {
    return writer().Part([&]() -> absl::Status {
      for (int i = 0; i < pieces; ++i) {
        STRATA_RETURN_IF_ERROR(writer().PutChunk(upload, static_cast<std::uint32_t>(i), large));
      }
      return absl::OkStatus();
    });
  };
  const auto full = StatusIs(absl::StatusCode::kResourceExhausted, HasSubstr("full"));
  EXPECT_THAT(Commit([&]() -> absl::Status {
                STRATA_EXPECT_OK(part(8, 1));
                EXPECT_THAT(part(9, 9), full);
                EXPECT_THAT(part(10, 1), full);
                return absl::OkStatus();
              }),
              full);
  EXPECT_THAT(reader().LastUpload(), IsOkAndHolds(1U));
  Put(2);
}

TEST(ValueCodecTest, EveryFlippedBitIsFound) {
  ScanHeader header;
  header.id = {"run", 1};
  const std::string good = EncodeScanHeader(header);
  STRATA_ASSERT_OK(DecodeScanHeader(header.id, good));
  for (std::size_t bit = 0; bit < 8 * good.size(); ++bit) {
    std::string bad = good;
    bad[bit / 8] = static_cast<char>(bad[bit / 8] ^ (1 << (bit % 8)));
    EXPECT_THAT(DecodeScanHeader(header.id, bad),
                StatusIs(absl::StatusCode::kDataLoss, HasSubstr("scan header")));
  }
  EXPECT_THAT(DecodeScanHeader(header.id, good.substr(1)),
              StatusIs(absl::StatusCode::kDataLoss, HasSubstr("bytes instead of")));
}

}  // namespace
}  // namespace strata::testing
