// Conformance: classes, labels, classifiers.
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/codec/surface_tile_codec.h"
#include "tests/support/database_suite/database_suite.h"
#include "tests/support/simulator/park.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::_;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using Code = absl::StatusCode;

TEST_P(DatabaseSuite, ClassesAreNamedAndKeepTheirIds) {
  const MapClass facade{7, "facade", {200, 100, 50}};
  const MapClass ground{2, "ground", {1, 2, 3}};
  EXPECT_THAT(db().maps().ListClasses({}, kMap), IsOkAndHolds(IsEmpty()));
  STRATA_ASSERT_OK(db().maps().SetClass({}, kMap, facade));
  STRATA_ASSERT_OK(db().maps().SetClass({}, kMap, ground));
  STRATA_ASSERT_OK(db().maps().SetClass({}, kMap, ground));
  const MapClass renamed{7, "wall", {255, 255, 255}};
  STRATA_ASSERT_OK(db().maps().SetClass({}, kMap, renamed));
  EXPECT_THAT(db().maps().ListClasses({}, kMap), IsOkAndHolds(ElementsAre(ground, renamed)));
  Reopen();
  EXPECT_THAT(db().maps().ListClasses({}, kMap), IsOkAndHolds(ElementsAre(ground, renamed)));
}

TEST_P(DatabaseSuite, BadAndTakenClassesAreRefused) {
  STRATA_ASSERT_OK(db().maps().SetClass({}, kMap, {1, "ground", {}}));
  EXPECT_THAT(db().maps().SetClass({}, kMap, {2, "ground", {}}),
              StatusIs(Code::kAlreadyExists, HasSubstr("ground")));
  EXPECT_THAT(db().maps().SetClass({}, kMap, {0, "wall", {}}),
              StatusIs(Code::kInvalidArgument, HasSubstr("[1, 255]")));
  EXPECT_THAT(db().maps().SetClass({}, kMap, {256, "wall", {}}),
              StatusIs(Code::kInvalidArgument, HasSubstr("256")));
  EXPECT_THAT(db().maps().SetClass({}, kMap, {3, "a wall", {}}),
              StatusIs(Code::kInvalidArgument, HasSubstr("class name")));
  EXPECT_THAT(db().maps().ListClasses({}, kMap), IsOkAndHolds(ElementsAre(_)));
}

// The labels that count, as GetPoints gives them.
std::vector<std::uint16_t> LabelsOf(api::Database& db, const ScanId& id) {
  std::vector<std::uint16_t> labels;
  STRATA_EXPECT_OK(db.scans().GetPoints({}, kMap, id, [&](const PointCloud& piece) {
    labels.insert(labels.end(), piece.label.begin(), piece.label.end());
    return absl::OkStatus();
  }));
  return labels;
}

// How many surfaces of level 0 are of each class.
std::map<int, int> SurfaceClasses(api::Database& db) {
  std::map<int, int> classes;
  STRATA_EXPECT_OK(db.tiles().Fetch({}, kMap, {}, {}, [&](const api::TileUpdate& update) {
    const auto tile = DecodeSurfaceTile(update.tile.bytes);
    STRATA_EXPECT_OK(tile);
    if (!tile.ok()) return tile.status();
    for (const Surface& surface : tile->surfaces) {
      ++classes[surface.class_id];
      EXPECT_EQ(surface.class_id == 0, surface.confidence == 0);
    }
    return absl::OkStatus();
  }));
  return classes;
}

JobInfo RunJob(api::Database& db, const std::string& kind, const JobParameters& parameters) {
  const JobInfo job = EndOfJob(db, kind, parameters);
  EXPECT_EQ(job.state, JobState::kSucceeded) << job.message;
  return job;
}

void PutPark(api::Database& db, std::uint64_t sequence, bool labels) {
  PointCloud park = MakePark(sequence);
  if (!labels) park.label.clear();
  const ScanHeader header =
      FloorHeader({"run", sequence}, park, 10.0 * static_cast<double>(sequence));
  STRATA_ASSERT_OK(UploadScan(db, kMap, header, park));
  AwaitIntegration(db, kMap);
}

TEST_P(DatabaseSuite, LabelsOfAPersonCountMoreThanUploadedOnes) {
  PutPark(db(), 1, true);
  const ScanId id{"run", 1};
  std::vector<std::uint16_t> expected = MakePark(1).label;
  EXPECT_EQ(LabelsOf(db(), id), expected);
  const std::map<int, int> uploaded = SurfaceClasses(db());
  ASSERT_THAT(uploaded, ::testing::SizeIs(2));
  STRATA_ASSERT_OK_AND_ASSIGN(const MapStats before, db().maps().Stats({}, kMap));
  std::vector<std::uint16_t> said(expected.size(), 0);
  for (std::size_t i = 0; i < 1000; ++i) said[i] = expected[i] = 200;
  for (std::size_t i = 1000; i < 1200; ++i) said[i] = expected[i] = 9;
  STRATA_ASSERT_OK(db().scans().SetLabels({}, kMap, id, said, api::LabelMode::kReplace));
  EXPECT_EQ(LabelsOf(db(), id), expected);
  EXPECT_THAT(SurfaceClasses(db()), ::testing::Contains(::testing::Key(9)));
  STRATA_ASSERT_OK_AND_ASSIGN(const ScanInfo info, db().scans().Get({}, kMap, id));
  EXPECT_TRUE(info.person_labels);
  EXPECT_EQ(info.label_model, 0U);
  RunJob(db(), "verify", {});
  // An update adds to what was said; a replacement by nothing takes it all back.
  std::vector<std::uint16_t> more(expected.size(), 0);
  more[0] = expected[0] = 7;
  STRATA_ASSERT_OK(db().scans().SetLabels({}, kMap, id, more, api::LabelMode::kUpdate));
  EXPECT_EQ(LabelsOf(db(), id), expected);
  const std::vector<std::uint16_t> none(expected.size(), 0);
  STRATA_ASSERT_OK(db().scans().SetLabels({}, kMap, id, none, api::LabelMode::kReplace));
  EXPECT_EQ(LabelsOf(db(), id), MakePark(1).label);
  EXPECT_EQ(SurfaceClasses(db()), uploaded);
  STRATA_ASSERT_OK_AND_ASSIGN(const MapStats after, db().maps().Stats({}, kMap));
  EXPECT_EQ(after.content_digest, before.content_digest);
  EXPECT_GT(after.commit_sequence, before.commit_sequence);
}

TEST_P(DatabaseSuite, LabelsThatDoNotFitAreRefused) {
  PutPark(db(), 1, false);
  const std::size_t points = MakePark(1).size();
  const auto set = [&](const ScanId& id, std::size_t count, std::uint16_t label = 1) {
    return db().scans().SetLabels(
        {}, kMap, id, std::vector<std::uint16_t>(count, label), api::LabelMode::kReplace);
  };
  EXPECT_THAT(set({"run", 1}, points - 1), StatusIs(Code::kInvalidArgument, HasSubstr("points")));
  EXPECT_THAT(set({"run", 1}, points + 1), StatusIs(Code::kInvalidArgument, HasSubstr("points")));
  EXPECT_THAT(set({"run", 2}, points), StatusIs(Code::kNotFound, HasSubstr("run/2")));
  EXPECT_THAT(set({"run", 1}, points, 256), StatusIs(Code::kInvalidArgument, HasSubstr("256")));
  EXPECT_THAT(LabelsOf(db(), {"run", 1}), IsEmpty());
  PointCloud park = MakePark(2);
  park.label[70] = 1200;
  EXPECT_THAT(UploadScan(db(), kMap, FloorHeader({"run", 2}, park, 0.0), park),
              StatusIs(Code::kInvalidArgument, HasSubstr("label 1200 of point 70")));
}

TEST_P(DatabaseSuite, AClassifierIsTrainedLabelsScansAndIsScored) {
  STRATA_ASSERT_OK(db().maps().SetClass({}, kMap, {kParkGround, "ground", {}}));
  STRATA_ASSERT_OK(db().maps().SetClass({}, kMap, {kParkPole, "pole", {}}));
  PutPark(db(), 1, true);
  PutPark(db(), 2, true);
  PutPark(db(), 3, false);
  const JobInfo trained = RunJob(db(), "train", {{"name", "park"}, {"method", "bayes"}});
  EXPECT_GT(trained.metrics.at("accuracy"), 0.9);
  STRATA_ASSERT_OK_AND_ASSIGN(const ClassifierInfo info, db().classifiers().Get({}, kMap, "park"));
  EXPECT_EQ(info.job, trained.id);
  EXPECT_EQ(info.parameters.at("classes"), "1=ground,2=pole");
  EXPECT_EQ(info.scores.at("folds"), 2.0);
  EXPECT_THAT(db().classifiers().List({}, kMap), IsOkAndHolds(ElementsAre(info)));
  const JobInfo labelled = RunJob(db(), "classify", {{"model", "park"}});
  EXPECT_EQ(labelled.metrics.at("scans_labelled"), 3.0);
  const std::vector<std::uint16_t> given = LabelsOf(db(), {"run", 3});
  const std::vector<std::uint16_t> truth = MakePark(3).label;
  ASSERT_EQ(given.size(), truth.size());
  int right = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) right += given[i] == truth[i] ? 1 : 0;
  EXPECT_GT(right, 0.9 * static_cast<double>(truth.size()));
  EXPECT_EQ(LabelsOf(db(), {"run", 1}), MakePark(1).label);  // uploaded ones count more
  STRATA_ASSERT_OK_AND_ASSIGN(const ScanInfo scan, db().scans().Get({}, kMap, {"run", 3}));
  EXPECT_EQ(scan.label_model, info.id);
  EXPECT_FALSE(scan.person_labels);
  const JobInfo scored = RunJob(db(), "evaluate", {{"model", "park"}});
  EXPECT_GT(scored.metrics.at("accuracy"), 0.9);
  EXPECT_GT(scored.metrics.at("confusion.1.1"), 2000.0);
  RunJob(db(), "verify", {});
  EXPECT_EQ(RunJob(db(), "classify", {{"model", "park"}}).metrics.at("scans_labelled"), 0.0);
}

TEST_P(DatabaseSuite, ClassifiersGoFromMapToMapAndMatchClassesByName) {
  STRATA_ASSERT_OK(db().maps().SetClass({}, kMap, {kParkPole, "pole", {}}));
  PutPark(db(), 1, true);
  RunJob(db(), "train", {{"name", "park"}, {"method", "knn"}});
  std::string bytes;
  STRATA_ASSERT_OK(db().classifiers().Export({}, kMap, "park", [&](absl::string_view piece) {
    bytes.append(piece.data(), piece.size());
    return absl::OkStatus();
  }));
  STRATA_ASSERT_OK(db().maps().Create({}, "other", {}));
  STRATA_ASSERT_OK(db().maps().SetClass({}, "other", {1, "roof", {}}));
  STRATA_ASSERT_OK(db().maps().SetClass({}, "other", {5, "pole", {}}));
  STRATA_ASSERT_OK_AND_ASSIGN(const ClassifierInfo info,
                              db().classifiers().Import({}, "other", "mine", bytes));
  // "1" is no roof.
  EXPECT_EQ(info.parameters.at("classes"), "2=1,5=pole");
  EXPECT_EQ(info.job, 0U);
  STRATA_ASSERT_OK_AND_ASSIGN(const auto classes, db().maps().ListClasses({}, "other"));
  EXPECT_THAT(classes, ::testing::SizeIs(3));
  EXPECT_THAT(db().classifiers().Import({}, "other", "mine", bytes),
              StatusIs(Code::kAlreadyExists, HasSubstr("mine")));
  EXPECT_THAT(db().classifiers().Import({}, "other", "bad", bytes.substr(0, bytes.size() - 3)),
              StatusIs(Code::kInvalidArgument, HasSubstr("bad")));
  EXPECT_THAT(db().classifiers().Import({}, "other", "a name", bytes),
              StatusIs(Code::kInvalidArgument, HasSubstr("classifier name")));
  STRATA_EXPECT_OK(db().classifiers().Delete({}, "other", "mine"));
  const auto gone = StatusIs(Code::kNotFound, HasSubstr("mine"));
  EXPECT_THAT(db().classifiers().Delete({}, "other", "mine"), gone);
  EXPECT_THAT(db().classifiers().Get({}, "other", "mine"), gone);
  EXPECT_THAT(db().jobs().Start({}, "other", "classify", {{"model", "mine"}}), gone);
  EXPECT_THAT(db().jobs().Start({}, kMap, "train", {{"name", "park"}}),
              StatusIs(Code::kAlreadyExists, HasSubstr("park")));
  EXPECT_THAT(db().jobs().Start({}, kMap, "train", {{"method", "magic"}}),
              StatusIs(Code::kInvalidArgument, HasSubstr("amn, iamn")));
  EXPECT_THAT(db().jobs().Start({}, kMap, "classify", {}),
              StatusIs(Code::kInvalidArgument, HasSubstr("model")));
}

}  // namespace
}  // namespace strata::testing
