#include "core/classification/validation.h"

#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/classification/classifier_codec.h"
#include "core/classification/regions.h"
#include "core/common/random.h"
#include "core/common/status.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::strata::testing::StatusIs;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

const std::vector<ClassName> kClasses = {{4, "floor"}, {6, "wall"}};

const std::vector<std::size_t> kEach = {0, 1, 2};  // every cloud a group

absl::Status NoProgress(double) { return absl::OkStatus(); }

// A floor, and a wall where there is to be one; a few points are unlabelled.
PointCloud Room(std::uint64_t seed, bool wall) {
  SplitMix64 random(seed);
  const auto in = [&random](double high) { return high * random.Below(1U << 20) / (1 << 20); };
  PointCloud cloud;
  for (int k = 0; k < 800; ++k) {
    const bool upright = wall && k % 2 == 0;
    cloud.points.emplace_back(
        upright ? 0.02 * in(1) : in(4), in(4), upright ? in(2) : 0.02 * in(1));
    cloud.label.push_back(k % 20 == 0 ? 0 : upright ? 6 : 4);
  }
  return cloud;
}

TrainingOptions Quick() {
  TrainingOptions options;
  options.method = ClassifierMethod::kBayes;
  options.features.scales = 1;
  return options;
}

absl::StatusOr<ConfusionMatrix> Validated(const std::vector<PointCloud>& clouds,
                                          const std::vector<std::size_t>& groups,
                                          const std::vector<ClassName>& classes,
                                          std::size_t folds,
                                          const Stop& stop = Stop()) {
  STRATA_ASSIGN_OR_RETURN(
      const TrainingSet set,
      ReadTrainingSet(clouds.size(), SourceOf(clouds), classes, Quick(), NoProgress, Stop()));
  return CrossValidate(set, groups, SourceOf(clouds), folds, NoProgress, stop);
}

TEST(ValidationTest, CountsLabelledPointsByTruthAndClassGiven) {
  STRATA_ASSERT_OK_AND_ASSIGN(
      const Classifier classifier,
      TrainClassifier({Room(1, true)}, kClasses, Quick(), NoProgress, Stop()));
  // One more class than the classifier knows, in front of its own.
  const std::vector<ClassName> classes = {{9, "sky"}, {4, "floor"}, {6, "wall"}};
  PointCloud room = Room(2, true);
  room.label[1] = 9;
  STRATA_ASSERT_OK_AND_ASSIGN(const ConfusionMatrix confusion,
                              EvaluateClassifier(classifier, room, classes, Stop()));
  EXPECT_EQ(confusion.total(), 800U - 40U);
  EXPECT_EQ(confusion.Recall(0), 0.0);
  STRATA_ASSERT_OK_AND_ASSIGN(const ClassifiedCloud given, Classify(classifier, room, Stop()));
  ConfusionMatrix by_hand(3);
  for (std::size_t i = 0; i < room.size(); ++i) {
    if (room.label[i] == 0) continue;
    const ClassIndex truth = room.label[i] == 9 ? 0 : room.label[i] == 4 ? 1 : 2;
    by_hand.Add(truth, static_cast<ClassIndex>(given.labels[i] + 1));
  }
  for (std::size_t truth = 0; truth < 3; ++truth) {
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_EQ(confusion.count(truth, k), by_hand.count(truth, k));
  }
}

TEST(ValidationTest, EveryCloudIsLabelledOnceByAClassifierThatNeverSawIt) {
  const std::vector<PointCloud> clouds = {Room(1, true), Room(2, true), Room(3, true)};
  STRATA_ASSERT_OK_AND_ASSIGN(const ConfusionMatrix confusion,
                              Validated(clouds, kEach, kClasses, 3));
  ConfusionMatrix by_hand(2);
  for (std::size_t i = 0; i < 3; ++i) {
    STRATA_ASSERT_OK_AND_ASSIGN(const Classifier classifier,
                                TrainClassifier({clouds[(i == 0) ? 1 : 0], clouds[i == 2 ? 1 : 2]},
                                                kClasses,
                                                Quick(),
                                                NoProgress,
                                                Stop()));
    STRATA_ASSERT_OK_AND_ASSIGN(const ConfusionMatrix one,
                                EvaluateClassifier(classifier, clouds[i], kClasses, Stop()));
    by_hand.Add(one);
  }
  EXPECT_EQ(confusion.total(), 3U * 760U);
  EXPECT_EQ(confusion.Accuracy(), by_hand.Accuracy());
}

TEST(ValidationTest, CloudsAreGoneThroughOnceToLearnAndOnceToJudge) {
  std::vector<PointCloud> clouds = {Room(1, true), Room(2, true), Room(3, true)};
  clouds[1].label.clear();
  std::vector<int> visits(3, 0);
  const auto counted = [&](std::size_t k, absl::FunctionRef<absl::Status(const PointCloud&)> use) {
    ++visits[k];
    return use(clouds[k]);
  };
  STRATA_ASSERT_OK_AND_ASSIGN(const TrainingSet set,
                              ReadTrainingSet(3, counted, kClasses, Quick(), NoProgress, Stop()));
  EXPECT_THAT(visits, ElementsAre(1, 1, 1));
  STRATA_ASSERT_OK_AND_ASSIGN(const ConfusionMatrix confusion,
                              CrossValidate(set, kEach, counted, 3, NoProgress, Stop()));
  EXPECT_THAT(visits, ElementsAre(2, 2, 2));
  EXPECT_EQ(confusion.total(), 2U * 760U);
  STRATA_ASSERT_OK_AND_ASSIGN(const Classifier learned, LearnClassifier(set, Stop()));
  STRATA_ASSERT_OK_AND_ASSIGN(const Classifier trained,
                              TrainClassifier(clouds, kClasses, Quick(), NoProgress, Stop()));
  EXPECT_EQ(EncodeClassifier(learned), EncodeClassifier(trained));
}

// Where points are drawn, those of all clouds together are bounded.
TEST(ValidationTest, OfManyCloudsFewerPointsEachAreKept) {
  std::vector<PointCloud> clouds(400, Room(1, true));
  TrainingOptions options = Quick();
  const auto kept = [&](std::size_t count) -> std::size_t {
    const auto set =
        ReadTrainingSet(count, SourceOf(clouds), kClasses, options, NoProgress, Stop());
    STRATA_EXPECT_OK(set);
    return set.ok() ? set->clouds[0].data.size() : 0;
  };
  EXPECT_EQ(kept(1), 760U);
  EXPECT_LE(kept(400), 100'000U / 400U + 2U);
  options.reduction.kind = ReductionKind::kNone;
  EXPECT_EQ(kept(3), 760U);
}

TEST(ValidationTest, AClassOfOneCloudAloneCountsAsMissed) {
  const std::vector<ClassName> classes = {{8, "pond"}, {4, "floor"}, {6, "wall"}};
  std::vector<PointCloud> clouds = {Room(1, true), Room(2, true), Room(3, true)};
  for (std::size_t i = 1; i < 800; i += 4) clouds[1].label[i] = 8;
  STRATA_ASSERT_OK_AND_ASSIGN(const ConfusionMatrix confusion,
                              Validated(clouds, kEach, classes, 3));
  EXPECT_EQ(confusion.Recall(0), 0.0);
  EXPECT_GT(confusion.Recall(1), 0.8);
  EXPECT_GT(confusion.Recall(2), 0.8);
  EXPECT_THAT(Validated(clouds, kEach, classes, 4),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("folds 4 is not in [2, 3]")));
  EXPECT_THAT(Validated(clouds, kEach, classes, 1),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("folds 1 is not in")));
  Stop stop;
  stop.Request();
  EXPECT_THAT(Validated(clouds, kEach, classes, 3, stop),
              StatusIs(absl::StatusCode::kCancelled, HasSubstr("")));
}

TEST(ValidationTest, CloudsOfOneGroupAreLeftOutTogether) {
  const std::vector<PointCloud> clouds = {Room(1, true), Room(2, true), Room(3, true)};
  STRATA_ASSERT_OK_AND_ASSIGN(const ConfusionMatrix confusion,
                              Validated(clouds, {0, 1, 0}, kClasses, 2));
  STRATA_ASSERT_OK_AND_ASSIGN(const Classifier of_second,
                              TrainClassifier({clouds[1]}, kClasses, Quick(), NoProgress, Stop()));
  STRATA_ASSERT_OK_AND_ASSIGN(
      const Classifier of_others,
      TrainClassifier({clouds[0], clouds[2]}, kClasses, Quick(), NoProgress, Stop()));
  ConfusionMatrix by_hand(2);
  for (std::size_t i = 0; i < 3; ++i) {
    STRATA_ASSERT_OK_AND_ASSIGN(
        const ConfusionMatrix one,
        EvaluateClassifier(i == 1 ? of_others : of_second, clouds[i], kClasses, Stop()));
    by_hand.Add(one);
  }
  for (std::size_t truth = 0; truth < 2; ++truth) {
    for (std::size_t k = 0; k < 2; ++k)
      EXPECT_EQ(confusion.count(truth, k), by_hand.count(truth, k));
  }
  EXPECT_THAT(Validated(clouds, {0, 0, 0}, kClasses, 2),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("folds 2 is not in [2, 1]")));
}

// Parts of a cloud have networks of their own, and leaves those of the points they stand for.
TEST(TrainingSetTest, NetworksOfPartsAreApartAndThoseOfLeavesKeepEveryEdge) {
  TrainingOptions options = Quick();
  options.reduction.kind = ReductionKind::kPure;
  const std::vector<PointCloud> rooms = {Room(1, true), Room(2, true)};
  const std::vector<PointCloud> alone = {rooms[0]};
  const auto in_parts = [&](std::size_t, absl::FunctionRef<absl::Status(const PointCloud&)> use) {
    STRATA_RETURN_IF_ERROR(use(rooms[0]));
    return use(rooms[1]);
  };
  STRATA_ASSERT_OK_AND_ASSIGN(const TrainingSet set,
                              ReadTrainingSet(1, in_parts, kClasses, options, NoProgress, Stop()));
  STRATA_ASSERT_OK_AND_ASSIGN(
      const TrainingSet first,
      ReadTrainingSet(1, SourceOf(alone), kClasses, options, NoProgress, Stop()));
  const TrainingCloud& both = set.clouds[0];
  const std::size_t rows = first.clouds[0].data.size();
  ASSERT_GT(both.data.size(), rows);
  EXPECT_EQ(std::accumulate(both.counts.begin(), both.counts.end(), 0U), 2U * 760U);
  std::size_t edges = both.edges.size();
  edges += std::accumulate(both.inner_edges.begin(), both.inner_edges.end(), 0U);
  std::size_t of_points = 0;
  for (const PointCloud& room : rooms) {
    std::vector<Eigen::Vector3f> labelled;
    for (std::size_t i = 0; i < room.size(); ++i) {
      if (room.label[i] != 0) labelled.push_back(room.points[i]);
    }
    of_points += DrawNetwork(labelled, options.network).size();
  }
  EXPECT_EQ(edges, of_points);
  bool second_has_edges = false;
  for (const NetworkEdge& edge : both.edges) {
    EXPECT_EQ(edge.i < rows, edge.j < rows);
    second_has_edges = second_has_edges || edge.i >= rows;
  }
  EXPECT_TRUE(second_has_edges);
}

TEST(RegionsTest, CloudsAreCutAlongTheSquaresOfTheirCommonFrame) {
  PointCloud first;
  first.origin = {100.0, 0.0, 0.0};
  first.points = {{0.5F, 0.5F, 0.0F}, {-0.5F, 0.5F, 1.0F}, {1.5F, 0.5F, 2.0F}};
  first.label = {1, 2, 3};
  PointCloud second;
  second.origin = {0.0, 0.0, 5.0};
  const float nan = std::numeric_limits<float>::quiet_NaN();
  second.points = {{nan, 0.0F, 0.0F}, {99.0F, 1.0F, 0.0F}};
  second.label = {4, 5};
  const RegionClouds cut = CutIntoRegions({first, second}, 2.0);
  EXPECT_THAT(cut.regions, ElementsAre(0, 1, 1));
  ASSERT_EQ(cut.clouds.size(), 3U);
  EXPECT_THAT(cut.clouds[0].label, ElementsAre(1, 3));
  EXPECT_THAT(cut.clouds[1].label, ElementsAre(2));
  EXPECT_THAT(cut.clouds[2].label, ElementsAre(5));
  EXPECT_EQ(cut.clouds[0].points[1], first.points[2]);
  EXPECT_EQ(cut.clouds[2].origin, second.origin);
}

}  // namespace
}  // namespace strata
