#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/classification/classifier_codec.h"
#include "core/classification/training.h"
#include "core/codec/blob.h"
#include "tests/core/classification/amn/random_networks.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

const std::vector<ClassName> kClasses = {{10, "ground"}, {20, "pole"}, {30, "bush"}};

absl::Status NoProgress(double) { return absl::OkStatus(); }

// A noisy floor with poles and bushes on it, every point labelled.
PointCloud Park(std::uint64_t seed) {
  SplitMix64 random(seed);
  PointCloud cloud;
  const auto add = [&cloud](double x, double y, double z, std::uint16_t label) {
    cloud.points.emplace_back(Eigen::Vector3d(x, y, z).cast<float>());
    cloud.label.push_back(label);
  };
  const auto noise = [&random](double sigma) { return testing::RandomIn(-sigma, sigma, random); };
  for (int k = 0; k < 6000; ++k) {
    add(testing::RandomIn(0, 12, random), testing::RandomIn(0, 12, random), noise(0.02), 10);
  }
  for (int thing = 0; thing < 6; ++thing) {
    const double x = testing::RandomIn(1, 11, random);
    const double y = testing::RandomIn(1, 11, random);
    const bool pole = thing % 2 == 0;
    for (int k = 0; k < 400; ++k) {
      if (pole) {
        add(x + noise(0.03), y + noise(0.03), testing::RandomIn(0.2, 4.0, random), 20);
      } else {
        add(x + noise(0.7), y + noise(0.7), testing::RandomIn(0.3, 1.7, random), 30);
      }
    }
  }
  return cloud;
}

double Accuracy(const PointCloud& cloud, const ClassifiedCloud& classified) {
  std::size_t right = 0;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    right += kClasses[classified.labels[i]].id == cloud.label[i] ? 1 : 0;
  }
  return static_cast<double>(right) / static_cast<double>(cloud.size());
}

class ClassifierTest : public ::testing::TestWithParam<ClassifierMethod> {};

TEST_P(ClassifierTest, LearnsOneParkAndKnowsAnother) {
  TrainingOptions options;
  options.method = GetParam();
  options.features.scales = 2;
  options.reduction.count = 1000;
  STRATA_ASSERT_OK_AND_ASSIGN(
      const Classifier classifier,
      TrainClassifier({Park(1), Park(2)}, kClasses, options, NoProgress, Stop()));
  EXPECT_EQ(classifier.points_seen, 2U * 8400U);
  EXPECT_LT(classifier.points_kept, classifier.points_seen / 4);
  const PointCloud other = Park(3);
  STRATA_ASSERT_OK_AND_ASSIGN(const ClassifiedCloud classified,
                              Classify(classifier, other, Stop()));
  EXPECT_GT(Accuracy(other, classified), 0.9);
  RecordProperty("accuracy_percent", static_cast<int>(100 * Accuracy(other, classified)));
  // Points that are none are labelled somehow and change nothing else.
  PointCloud with = other;
  with.points.push_back(Eigen::Vector3f::Constant(std::nanf("")));
  with.label.push_back(0);
  STRATA_ASSERT_OK_AND_ASSIGN(ClassifiedCloud again, Classify(classifier, with, Stop()));
  ASSERT_EQ(again.labels.size(), with.size());
  again.labels.pop_back();
  EXPECT_EQ(again.labels, classified.labels);
}

TEST_P(ClassifierTest, BytesAreTheSameClassifier) {
  TrainingOptions options;
  options.method = GetParam();
  options.features.scales = 1;
  options.reduction.count = 500;
  options.rounds = 5;
  STRATA_ASSERT_OK_AND_ASSIGN(const Classifier classifier,
                              TrainClassifier({Park(1)}, kClasses, options, NoProgress, Stop()));
  const std::string bytes = EncodeClassifier(classifier);
  STRATA_ASSERT_OK_AND_ASSIGN(const Classifier read, DecodeClassifier(bytes));
  EXPECT_EQ(EncodeClassifier(read), bytes);
  EXPECT_EQ(read.classes, classifier.classes);
  const PointCloud other = Park(4);
  STRATA_ASSERT_OK_AND_ASSIGN(const ClassifiedCloud before, Classify(classifier, other, Stop()));
  STRATA_ASSERT_OK_AND_ASSIGN(const ClassifiedCloud after, Classify(read, other, Stop()));
  EXPECT_EQ(before.labels, after.labels);
  EXPECT_EQ(before.score, after.score);
}

// Bytes that were made to look intact: refused, or a classifier that can be used.
TEST_P(ClassifierTest, HostileBytesAreRefusedOrHarmless) {
  TrainingOptions options;
  options.method = GetParam();
  options.features.scales = 1;
  options.rounds = 3;
  options.reduction = {.kind = ReductionKind::kDepth, .depth = 7};
  STRATA_ASSERT_OK_AND_ASSIGN(const Classifier classifier,
                              TrainClassifier({Park(1)}, kClasses, options, NoProgress, Stop()));
  const std::string bytes = EncodeClassifier(classifier);
  for (std::size_t size = 0; size < bytes.size(); size += 1 + size / 16) {
    EXPECT_FALSE(DecodeClassifier(bytes.substr(0, size)).ok()) << size;
  }
  const std::string body = bytes.substr(kBlobOverheadBytes - 8, bytes.size() - kBlobOverheadBytes);
  STRATA_ASSERT_OK(DecodeClassifier(SealBlob(BlobKind::kClassifier, 1, body)).status());
  PointCloud small;
  for (int k = 0; k < 40; ++k) {
    small.points.emplace_back(0.1F * static_cast<float>(k % 7), 0.1F * static_cast<float>(k), 0.0F);
  }
  constexpr std::uint64_t kSeed = 12;
  SplitMix64 random(kSeed);
  for (int run = 0; run < 2000; ++run) {
    std::string changed = body;
    // Where sizes stand rather than numbers, mostly.
    const std::size_t reach = run % 2 == 0 ? std::min<std::size_t>(body.size(), 150) : body.size();
    changed[random.Below(static_cast<std::uint32_t>(reach))] = static_cast<char>(random.Next());
    const auto read = DecodeClassifier(SealBlob(BlobKind::kClassifier, 1, changed));
    if (!read.ok()) continue;
    const absl::StatusOr<ClassifiedCloud> labels = Classify(*read, small, Stop());
    if (!labels.ok()) continue;
    for (const ClassIndex label : labels->labels) ASSERT_LT(label, read->classes.size());
  }
}

INSTANTIATE_TEST_SUITE_P(Methods,
                         ClassifierTest,
                         ::testing::Values(ClassifierMethod::kBayes,
                                           ClassifierMethod::kNearest,
                                           ClassifierMethod::kAdaBoost,
                                           ClassifierMethod::kAmn,
                                           ClassifierMethod::kInstanceAmn),
                         [](const auto& test) { return std::string(ToString(test.param)); });

// Without it weights would have to pass through the mean of all points.
TEST(TrainClassifierTest, TheConstantFeatureStaysOne) {
  TrainingOptions options;
  options.method = ClassifierMethod::kBayes;
  options.features.scales = 1;
  STRATA_ASSERT_OK_AND_ASSIGN(const Classifier classifier,
                              TrainClassifier({Park(1)}, kClasses, options, NoProgress, Stop()));
  STRATA_ASSERT_OK_AND_ASSIGN(FeatureMatrix features,
                              ComputeFeatures(Park(2), options.features, Stop()));
  const FeatureMatrix seen = Standardised(classifier, std::move(features));
  EXPECT_TRUE((seen.rightCols(1).array() == 1.0F).all());
  EXPECT_NEAR(seen.col(0).mean(), 0.0F, 0.5F);
}

TEST(TrainClassifierTest, RefusesWhatItCannotLearn) {
  using ::testing::HasSubstr;
  std::vector<ClassName> classes = kClasses;
  classes.push_back({40, "water"});
  EXPECT_THAT(TrainClassifier({Park(1)}, classes, {}, NoProgress, Stop()),
              testing::StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("water")));
  TrainingOptions options;
  options.neighbours = 0;
  EXPECT_THAT(TrainClassifier({Park(1)}, kClasses, options, NoProgress, Stop()),
              testing::StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("neighbours")));
  EXPECT_THAT(ClassifierMethodFromName("forest"),
              testing::StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("iamn")));
  STRATA_ASSERT_OK_AND_ASSIGN(const ClassifierMethod method, ClassifierMethodFromName("knn"));
  EXPECT_EQ(method, ClassifierMethod::kNearest);
}

}  // namespace
}  // namespace strata
