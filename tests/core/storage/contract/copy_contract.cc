// A copy holds all that its map holds.
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
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

using ::testing::Not;

class CopyContractTest : public StorageContractTest {
 protected:
  absl::Status FillTruth();
  absl::Status FillDerived();
  // Has `lines` to say, and goes on as the map would.
  void CheckCopy(MapStorage& copy, const std::vector<std::string>& lines);
};

absl::Status CopyContractTest::FillTruth() {
  StorageWriter& w = writer();
  PoseRecord pose;
  pose.scan = 1;
  pose.epoch = 1;
  pose.T_map_scan.translation().x() = 1.0 / 3.0;
  pose.origin = PoseOrigin::kPerson;
  pose.report = {true, "aligned", 0.5, 0.25, 7};
  STRATA_RETURN_IF_ERROR(w.PutPose(pose));
  STRATA_RETURN_IF_ERROR(w.SetScanState(1, ScanState::kIntegrated, "it's in"));
  STRATA_RETURN_IF_ERROR(w.PutLabels(1, LabelOrigin::kPerson, 0, {std::string("l\0l", 3), "m"}));
  STRATA_RETURN_IF_ERROR(w.PutLabels(1, LabelOrigin::kFaded, 12, {"f"}));
  STRATA_RETURN_IF_ERROR(w.DropPoints(2, "local map"));
  ConstraintRecord constraint;
  constraint.scan_i = 1;
  constraint.scan_j = 2;
  constraint.constraint.may_be_false = true;
  constraint.constraint.note = "Größe";
  STRATA_RETURN_IF_ERROR(w.PutConstraint(constraint).status());
  STRATA_RETURN_IF_ERROR(w.ProposeConstraint(5, constraint));
  PlaneRecord plane;
  plane.plane.plane.normal = {0.6, 0.0, 0.8};
  plane.scans = {1, 2};
  plane.plane.supports = {{{}, 4.0, 0.01}, {{}, 2.0, 0.02}};
  STRATA_RETURN_IF_ERROR(w.ProposePlane(4, plane));
  STRATA_RETURN_IF_ERROR(w.ProposePose(5, {2, pose.T_map_scan}));
  STRATA_RETURN_IF_ERROR(w.BeginEpoch("job 4", 4).status());
  STRATA_RETURN_IF_ERROR(w.AdoptProposal(4));
  STRATA_RETURN_IF_ERROR(w.PutProfile("cart", RobotProfile{.radius_m = 0.1}));
  STRATA_RETURN_IF_ERROR(w.PutOrigin({0.1, 0.2, 0.3}));
  STRATA_RETURN_IF_ERROR(w.PutClass({3, "wall", {1, 2, 3}}));
  ClassifierInfo classifier;
  classifier.name = "street";
  classifier.parameters = {{"a", "b"}};
  classifier.scores = {{"accuracy", 0.1}};
  STRATA_RETURN_IF_ERROR(w.PutClassifier(classifier, std::string(1'500'000, 'c')).status());
  STRATA_RETURN_IF_ERROR(w.PutKind({9, "golf", true, "+"}, std::string("s\0h", 3)));
  JobInfo job;
  job.id = 4;
  job.kind = "optimize";
  job.parameters = {{"x", "y"}};
  job.metrics = {{"scans", 2.5}};
  STRATA_RETURN_IF_ERROR(w.PutJob(job));
  STRATA_RETURN_IF_ERROR(w.PutAttempt({{WorkKind::kJob, 4}, 1, true}));
  UnfinishedUpload upload;
  upload.upload = 70;
  upload.id = {"run", 70};
  upload.content_hash = "h";
  upload.touched = absl::FromUnixMicros(99);
  STRATA_RETURN_IF_ERROR(w.PutChunk(70, 0, "unfinished"));
  return w.KeepUpload(upload);
}

absl::Status CopyContractTest::FillDerived() {
  StorageWriter& w = writer();
  MlsTileRow mls;
  mls.key = {0, -1, 2};
  mls.version = 3;
  mls.box.extend(Eigen::Vector3d(0.1, 0.2, 0.3));
  mls.spread_sum = 0.7;
  mls.digest = "d";
  mls.bytes = std::string("t\0t", 3);
  STRATA_RETURN_IF_ERROR(w.PutMlsTile(mls));
  SurfaceTileRow surface;
  surface.key = {2, -1, 2};
  surface.version = 3;
  surface.patches = 8;
  surface.bytes = "surface";
  STRATA_RETURN_IF_ERROR(w.PutSurfaceTile(surface));
  STRATA_RETURN_IF_ERROR(w.PutPreparedTile({{0, -1, 2}, "m", "prepared"}));
  STRATA_RETURN_IF_ERROR(w.PutPlaneModelPart(6, 0, "model"));
  STRATA_RETURN_IF_ERROR(w.PutEntityPart(6, {0, "head"}, {}));
  STRATA_RETURN_IF_ERROR(w.PutEntityPart(6, {1, "entity"}, {1, 2}));
  STRATA_RETURN_IF_ERROR(w.PutInferredPart(6, 9, {1, "inferred"}));
  STRATA_RETURN_IF_ERROR(w.PutInferredScan(9, 1));
  STRATA_RETURN_IF_ERROR(w.PutFoundKind({4, "", false, "-"}, "found"));
  STRATA_RETURN_IF_ERROR(w.SetTilesOfScan(1, {{0, -1, 2}, {0, 0, 2}}));
  STRATA_RETURN_IF_ERROR(w.SetFootprint(
      1, Eigen::AlignedBox2d(Eigen::Vector2d(0.1, 0.2), Eigen::Vector2d(70.3, 0.4))));
  STRATA_RETURN_IF_ERROR(w.PutScanView(1, {"place", "planes"}));
  return w.PublishTiles(3, true);
}

template <typename Value>
Value ValueOf(absl::StatusOr<Value> value) {
  STRATA_EXPECT_OK(value);
  return value.ok() ? *std::move(value) : Value();
}

std::string BytesOf(const absl::StatusOr<std::optional<std::string>>& found) {
  return found.ok() && found->has_value() ? **found : "none";
}

void DescribeScans(StorageReader& r, std::vector<std::string>& lines) {
  ScanQuery all;
  for (const std::uint64_t epoch : {1, 2}) {
    const auto scans = r.ListScans(all, epoch);
    ASSERT_THAT(scans, IsOk());
    for (const PosedScan& posed : *scans) {
      const ScanRecord& s = posed.scan;
      lines.push_back(absl::StrCat("scan ",
                                   s.number,
                                   s.header.id.ToString(),
                                   " ",
                                   EncodeScanHeader(s.header),
                                   static_cast<int>(s.state),
                                   " ",
                                   s.upload,
                                   " ",
                                   s.chunks,
                                   s.has_points,
                                   s.point_bytes,
                                   " ",
                                   s.content_hash,
                                   s.message,
                                   s.person_labels,
                                   s.label_model));
      lines.push_back(absl::StrCat("faded ", s.faded_points, " box ", s.box_scan.min().sum()));
      if (posed.pose.has_value()) {
        lines.push_back(absl::StrCat("pose ",
                                     EncodePose(posed.pose->T_map_scan),
                                     static_cast<int>(posed.pose->origin),
                                     posed.pose->report.message,
                                     posed.pose->report.rms_m));
      }
      for (const LabelOrigin origin : {LabelOrigin::kPerson, LabelOrigin::kFaded}) {
        for (const std::uint32_t piece : {0, 1}) {
          lines.push_back(BytesOf(r.FindLabels(s.number, origin, piece)));
        }
      }
      lines.push_back(absl::StrCat(r.GetChunk(s.upload, 0).value_or("none"),
                                   " ",
                                   r.GetLocalMap(s.number).value_or("none"),
                                   " ",
                                   r.FindScanView(s.number)->place,
                                   r.TilesOfScan(s.number)->size()));
      const auto box = r.FootprintOfScan(s.number);
      if (box->has_value()) lines.push_back(absl::StrCat("to ", (*box)->max().x()));
    }
  }
}

void DescribeGraph(StorageReader& r, std::vector<std::string>& lines) {
  for (const std::uint64_t epoch : {1, 2}) {
    for (const ConstraintRecord& c : ValueOf(r.ListConstraints(epoch))) {
      lines.push_back(absl::StrCat("constraint ",
                                   c.constraint.id,
                                   " ",
                                   c.scan_i,
                                   c.constraint.note,
                                   c.constraint.may_be_false));
    }
    for (const PlaneRecord& p : ValueOf(r.ListPlanes(epoch))) {
      lines.push_back(absl::StrCat(
          "plane ", p.plane.id, " ", p.plane.plane.normal.z(), p.plane.supports.at(1).rms_m));
    }
  }
  for (const EpochInfo& e : ValueOf(r.ListEpochs())) {
    lines.push_back(absl::StrCat("epoch ", e.epoch, e.reason, e.job, e.decided, e.current, e.kept));
  }
  lines.push_back(absl::StrCat("proposed ", r.ListProposedPoses(5)->size()));
}

void DescribeMeaning(StorageReader& r, std::vector<std::string>& lines) {
  for (const MapClass& c : ValueOf(r.ListClasses()))
    lines.push_back(absl::StrCat(c.id, c.name, c.colour.g));
  for (const ClassifierInfo& c : ValueOf(r.ListClassifiers())) {
    lines.push_back(absl::StrCat(c.id, c.name, c.parameters.at("a"), c.scores.at("accuracy")));
    lines.push_back(*r.GetClassifier(c.id));
  }
  for (const KindRow& k : ValueOf(r.ListKinds())) {
    lines.push_back(absl::StrCat("kind ", k.id, k.name, k.in_library, k.info));
    lines.push_back(BytesOf(r.FindKindShape(k.id)));
  }
  for (const JobInfo& j : ValueOf(r.ListJobs())) {
    lines.push_back(absl::StrCat(j.id, j.kind, j.parameters.at("x"), j.metrics.at("scans")));
  }
  for (const Attempt& a : ValueOf(r.ListAttempts()))
    lines.push_back(absl::StrCat(a.work.id, a.deaths));
  for (const auto& [name, profile] : ValueOf(r.ListProfiles())) {
    lines.push_back(absl::StrCat("profile ", name, profile.radius_m));
  }
  for (const UnfinishedUpload& u : ValueOf(r.ListUnfinishedUploads())) {
    lines.push_back(
        absl::StrCat(u.upload, u.id.ToString(), u.chunks, absl::ToUnixMicros(u.touched)));
  }
}

void DescribeDerived(StorageReader& r, std::vector<std::string>& lines) {
  for (const MlsTileRow& t : ValueOf(r.ListMlsTiles(99))) {
    lines.push_back(
        absl::StrCat("mls ", t.key.x, t.version, t.box.min().z(), t.spread_sum, t.digest));
    lines.push_back(r.FindMlsTile(t.key, 99)->value().bytes);
  }
  TileRange range;
  range.level = 2;
  for (const SurfaceTileRow& t : ValueOf(r.ListSurfaceTiles(range, 99))) {
    lines.push_back(absl::StrCat("surface ", t.key.x, t.version, t.patches, t.size_bytes));
    lines.push_back(r.FindSurfaceTile(t.key, 99)->value().bytes);
  }
  lines.push_back(BytesOf(r.FindPreparedTile({0, -1, 2}, "m")));
  lines.push_back(absl::StrCat(*r.JobOfPlaneModel(), BytesOf(r.FindPlaneModelPart(6, 0))));
  lines.push_back(absl::StrCat(*r.JobOfEntities(), (*r.FindEntityPart(6, 0))->bytes));
  lines.push_back(absl::StrCat(*r.JobOfInferred(), (*r.FindInferredPart(6, std::nullopt))->bytes));
  lines.push_back(absl::StrCat("scans of a tile ", r.ScansOfTile({0, 0, 2})->size()));
  const MapClock clock = ValueOf(r.GetClock());
  lines.push_back(absl::StrCat(
      clock.commit_sequence, " ", clock.epoch, " ", clock.tile_version, clock.derived_complete));
}

std::vector<std::string> Describe(StorageReader& reader) {
  std::vector<std::string> lines;
  DescribeScans(reader, lines);
  DescribeGraph(reader, lines);
  DescribeMeaning(reader, lines);
  DescribeDerived(reader, lines);
  return lines;
}

void CopyContractTest::CheckCopy(MapStorage& copy, const std::vector<std::string>& lines) {
  STRATA_ASSERT_OK_AND_ASSIGN(const auto copied, copy.NewReader());
  EXPECT_EQ(Describe(*copied), lines);
  EXPECT_EQ(copied->GetMapInfo()->parameters, reader().GetMapInfo()->parameters);
  // Where scans lie is found again.
  ScanQuery there;
  there.box = Eigen::AlignedBox2d(Eigen::Vector2d(69.0, 0.0), Eigen::Vector2d(71.0, 1.0));
  STRATA_ASSERT_OK_AND_ASSIGN(const std::vector<PosedScan> found, copied->ListScans(there, 2));
  EXPECT_THAT(found, ::testing::SizeIs(1));
  // What a job has proposed, and ids that are not given again, come along.
  STRATA_ASSERT_OK(copy.writer().Commit(Durability::kFull, [&]() -> absl::Status {
    STRATA_RETURN_IF_ERROR(copy.writer().AdoptProposal(5));
    STRATA_RETURN_IF_ERROR(copy.writer().DeleteClassifier(1));
    ClassifierInfo info;
    info.name = "next";
    STRATA_ASSIGN_OR_RETURN(const std::uint64_t id, copy.writer().PutClassifier(info, "x"));
    EXPECT_EQ(id, 2U);
    return absl::OkStatus();
  }));
  EXPECT_EQ(copied->ListConstraints(2)->size(), reader().ListConstraints(2)->size() + 1);
  STRATA_ASSERT_OK(
      copy.writer().Commit(Durability::kFull, [&] { return copy.writer().DeleteScan(1); }));
  EXPECT_FALSE(copied->FindInferredPart(6, std::nullopt)->has_value());
  EXPECT_EQ((*copied->FindEntityPart(6, 0))->bytes, (*reader().FindEntityPart(6, 0))->bytes);
}

TEST_F(CopyContractTest, ACopyHoldsAllThatItsMapHolds) {
  Put(1);
  Put(2);
  STRATA_ASSERT_OK(Commit([&] { return FillTruth(); }));
  STRATA_ASSERT_OK(Commit([&] { return FillDerived(); }));
  const std::filesystem::path file = directory_.path() / "copy.strata";
  STRATA_ASSERT_OK(reader().CopyTo(file, Stop()));
  // The file as a map of the store, then the file itself: whatever is done to it afterwards.
  STRATA_ASSERT_OK_AND_ASSIGN(const auto imported, store().Import(file));
  const std::vector<std::string> lines = Describe(reader());
  EXPECT_GT(lines.size(), 40U);
  CheckCopy(*imported, lines);
  STRATA_ASSERT_OK_AND_ASSIGN(const auto copy, OpenSqliteStorage(file, {}));
  CheckCopy(*copy, lines);
  STRATA_ASSERT_OK(Commit([&] { return writer().DeleteScan(1); }));
  EXPECT_FALSE(reader().FindInferredPart(6, std::nullopt)->has_value());
}

TEST_F(CopyContractTest, WhatIsNoMapIsNotImported) {
  EXPECT_THAT(store().Import(directory_.path() / "nothing"), Not(IsOk()));
  const std::filesystem::path text = directory_.path() / "text";
  std::ofstream(text) << "not a map";
  EXPECT_THAT(store().Import(text), StatusIs(absl::StatusCode::kFailedPrecondition, ::testing::_));
  Put(1);
  const std::filesystem::path file = directory_.path() / "copy.strata";
  STRATA_ASSERT_OK(reader().CopyTo(file, Stop()));
  std::fstream damaged(file, std::ios::in | std::ios::out | std::ios::binary);
  for (int page = 1; page < 6; ++page) {
    damaged.seekp(8192 * page);
    damaged.write("\xff\xff\xff\xff\xff\xff\xff\xff", 8);
  }
  damaged.close();
  EXPECT_THAT(store().Import(file), StatusIs(absl::StatusCode::kDataLoss, ::testing::_));
}

}  // namespace
}  // namespace strata::testing
