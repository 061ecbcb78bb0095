// The classifiers that look at every point by itself.
#include <cmath>
#include <cstdint>
#include <vector>

#include <Eigen/LU>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/classification/evaluation.h"
#include "core/classification/features/instance_features.h"
#include "core/classification/learners/adaboost.h"
#include "core/classification/learners/instances.h"
#include "core/classification/learners/naive_bayes.h"
#include "tests/core/classification/amn/random_networks.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using testing::RandomIn;

// Sum of twelve uniform draws: nearly Gaussian.
double RandomGauss(SplitMix64& random) {
  double sum = -6.0;
  for (int k = 0; k < 12; ++k) sum += random.Uniform();
  return sum;
}

// Three clouds in two dimensions, of different width.
LabelledFeatures ThreeClouds(std::size_t count, std::uint64_t seed) {
  SplitMix64 random(seed);
  LabelledFeatures data;
  data.classes = 3;
  data.features.resize(static_cast<Eigen::Index>(count), 2);
  for (std::size_t i = 0; i < count; ++i) {
    const auto k = static_cast<ClassIndex>(i % 3);
    const auto row = static_cast<Eigen::Index>(i);
    data.features(row, 0) = static_cast<float>(4.0 * k + RandomGauss(random) * (1.0 + 0.3 * k));
    data.features(row, 1) = static_cast<float>((k == 1 ? 3.0 : 0.0) + RandomGauss(random));
    data.labels.push_back(k);
  }
  return data;
}

// A square of four fields, equal across: no line tells the classes apart (as in Fig. 9.5).
LabelledFeatures Checkers(std::size_t count, std::uint64_t seed) {
  SplitMix64 random(seed);
  LabelledFeatures data;
  data.classes = 2;
  data.features.resize(static_cast<Eigen::Index>(count), 2);
  for (std::size_t i = 0; i < count; ++i) {
    const double x = RandomIn(-1.0, 1.0, random);
    const double y = RandomIn(-1.0, 1.0, random);
    data.features.row(static_cast<Eigen::Index>(i)) << static_cast<float>(x), static_cast<float>(y);
    data.labels.push_back(x * y > 0.0 ? 1 : 0);
  }
  return data;
}

double Accuracy(const LabelledFeatures& data, const std::vector<ClassIndex>& given) {
  ConfusionMatrix matrix(data.classes);
  matrix.Add(data.labels, given);
  return matrix.Accuracy();
}

TEST(NaiveBayesTest, ScoresAreLogDensities) {
  const LabelledFeatures data = ThreeClouds(300, 1);
  STRATA_ASSERT_OK_AND_ASSIGN(const NaiveBayes model, LearnNaiveBayes(data, {}));
  const ScoreMatrix scores = NaiveBayesScores(model, data.features);
  for (const Eigen::Index i : {0, 17, 255}) {
    for (Eigen::Index k = 0; k < 3; ++k) {
      const Eigen::MatrixXd& sigma = model.covariance[static_cast<std::size_t>(k)];
      const Eigen::VectorXd r =
          data.features.row(i).cast<double>().transpose() - model.mean.row(k).transpose();
      const double density = std::exp(-0.5 * r.dot(sigma.inverse() * r)) /
                             (2.0 * M_PI * std::sqrt(sigma.determinant()));
      EXPECT_NEAR(scores(i, k), std::log(density) + std::log(1.0 / 3.0), 1e-9);
    }
  }
}

TEST(NaiveBayesTest, TellsGaussiansApartAndBearsConstantFeatures) {
  LabelledFeatures train = ThreeClouds(900, 2);
  LabelledFeatures test = ThreeClouds(900, 3);
  for (LabelledFeatures* data : {&train, &test}) {
    data->features.conservativeResize(Eigen::NoChange, 4);
    data->features.col(2).setConstant(5.0F);
    data->features.col(3) = data->features.col(0);  // singular without regularisation
  }
  STRATA_ASSERT_OK_AND_ASSIGN(const NaiveBayes model, LearnNaiveBayes(train, {}));
  const ScoreMatrix scores = NaiveBayesScores(model, test.features);
  ASSERT_TRUE(scores.allFinite());
  EXPECT_GT(Accuracy(test, LargestScores(scores)), 0.9);
}

TEST(InstancesTest, DistancesAreThoseOfAllPairs) {
  const LabelledFeatures data = ThreeClouds(60, 4);
  const LabelledFeatures query = ThreeClouds(10, 5);
  const Instances instances(data);
  const auto expect = [&](const FeatureMatrix& asked, const FeatureMatrix& found, bool within) {
    for (Eigen::Index i = 0; i < asked.rows(); ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        std::vector<float> all;
        for (std::size_t j = 0; j < data.size(); ++j) {
          if (data.labels[j] != k || (within && static_cast<Eigen::Index>(j) == i)) continue;
          all.push_back((asked.row(i) - data.features.row(static_cast<Eigen::Index>(j))).norm());
        }
        std::sort(all.begin(), all.end());
        for (std::size_t m = 0; m < 5; ++m) {
          EXPECT_NEAR(found(i, static_cast<Eigen::Index>(5 * k + m)), all[m], 1e-5F);
        }
      }
    }
  };
  expect(query.features, instances.Distances(query.features, 5), false);
  expect(data.features, instances.DistancesWithin(5), true);
}

// Far from zero and close together: what a product of matrices alone would round away.
TEST(InstancesTest, KeepsSmallDistancesInManyDimensions) {
  constexpr Eigen::Index kDimensions = 40;
  SplitMix64 random(11);
  LabelledFeatures data;
  data.classes = 2;
  data.features.resize(500, kDimensions);
  for (float& x : data.features.reshaped()) x = static_cast<float>(RandomIn(8.0, 10.0, random));
  for (Eigen::Index i = 0; i < 500; ++i) data.labels.push_back(i % 3 == 0 ? 1 : 0);
  data.features.row(400) = data.features.row(100);
  data.features(400, 7) += 1e-3F;
  const FeatureMatrix found = Instances(data).DistancesWithin(3);
  for (const Eigen::Index i : {0, 100, 127, 128, 255, 400, 499}) {
    for (const ClassIndex k : {0, 1}) {
      std::vector<float> all;
      for (Eigen::Index j = 0; j < 500; ++j) {
        if (j == i || data.labels[static_cast<std::size_t>(j)] != k) continue;
        all.push_back((data.features.row(i) - data.features.row(j)).norm());
      }
      std::sort(all.begin(), all.end());
      for (Eigen::Index m = 0; m < 3; ++m) {
        EXPECT_NEAR(found(i, 3 * k + m), all[static_cast<std::size_t>(m)], 1e-5F) << i;
      }
    }
  }
  EXPECT_NEAR(found(100, data.labels[400] * 3), 1e-3F, 1e-5F);
}

TEST(InstancesTest, ClassesOfOneRepeatOrAreFar) {
  LabelledFeatures data;
  data.classes = 2;
  data.features.resize(3, 1);
  data.features << 0.0F, 1.0F, 5.0F;
  data.labels = {0, 0, 1};
  const Instances instances(data);
  const FeatureMatrix out = instances.Distances(data.features, 2);
  EXPECT_EQ(out(0, 2), 5.0F);
  EXPECT_EQ(out(0, 3), 5.0F);
  const FeatureMatrix within = instances.DistancesWithin(2);
  EXPECT_EQ(within(2, 2), 5.0F) << "no other of its class: as far as the farthest";
  EXPECT_EQ(within(0, 0), 1.0F);
}

TEST(InstanceFeaturesTest, DoNotDependOnHowFarAllAre) {
  FeatureMatrix distances(3, 4);
  distances << 1.0F, 2.0F, 3.0F, 6.0F, 10.0F, 20.0F, 30.0F, 60.0F, 0.0F, 0.0F, 0.0F, 0.0F;
  const FeatureMatrix features = InstanceFeatures(distances);
  ASSERT_EQ(features.cols(), 5);
  EXPECT_TRUE(features.row(0).isApprox(features.row(1)));
  EXPECT_FLOAT_EQ(features(0, 3), 2.0F);
  EXPECT_EQ(features.col(4), Eigen::VectorXf::Ones(3));
  EXPECT_EQ(features.row(2).sum(), 1.0F);
}

TEST(InstancesTest, VotesFollowTheNearest) {
  const LabelledFeatures train = Checkers(2000, 6);
  const LabelledFeatures test = Checkers(500, 7);
  const ScoreMatrix votes = Instances(train).Votes(test.features, 5);
  for (Eigen::Index i = 0; i < votes.rows(); ++i) EXPECT_NEAR(votes.row(i).sum(), 1.0, 1e-12);
  EXPECT_GT(Accuracy(test, LargestScores(votes)), 0.95);
}

TEST(AdaBoostTest, IsRightWhereOneThresholdIs) {
  LabelledFeatures data;
  data.classes = 2;
  data.features.resize(40, 2);
  for (int i = 0; i < 40; ++i) {
    data.features(i, 0) = static_cast<float>(i % 7);
    data.features(i, 1) = static_cast<float>(i);
    data.labels.push_back(i < 13 ? 1 : 0);
  }
  STRATA_ASSERT_OK_AND_ASSIGN(const AdaBoost model, LearnAdaBoost(data, {}, Stop()));
  ASSERT_EQ(model.sequence.size(), 1U);
  ASSERT_EQ(model.sequence[0].stumps.size(), 1U);
  EXPECT_EQ(model.sequence[0].stumps[0].feature, 1U);
  EXPECT_EQ(model.sequence[0].stumps[0].threshold, 12.5F);
  EXPECT_EQ(AdaBoostLabels(model, data.features), data.labels);
  EXPECT_THAT(FeaturesByWeight(model), ::testing::ElementsAre(1));
}

TEST(AdaBoostTest, ManyWeakClassifiersMakeAStrongOne) {
  const LabelledFeatures train = ThreeClouds(900, 8);
  const LabelledFeatures test = ThreeClouds(900, 9);
  STRATA_ASSERT_OK_AND_ASSIGN(const AdaBoost one, LearnAdaBoost(train, {.rounds = 1}, Stop()));
  STRATA_ASSERT_OK_AND_ASSIGN(const AdaBoost many, LearnAdaBoost(train, {.rounds = 60}, Stop()));
  EXPECT_GT(Accuracy(test, AdaBoostLabels(many, test.features)), 0.9);
  EXPECT_GT(Accuracy(train, AdaBoostLabels(many, train.features)),
            Accuracy(train, AdaBoostLabels(one, train.features)));
}

TEST(LabelledFeaturesTest, RefusesWhatCannotBeLearned) {
  using ::testing::HasSubstr;
  LabelledFeatures data = ThreeClouds(30, 10);
  STRATA_EXPECT_OK(Validate(data));
  data.classes = 4;
  EXPECT_THAT(LearnNaiveBayes(data, {}).status(),
              testing::StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("class 3")));
  data.classes = 2;
  EXPECT_THAT(Validate(data),
              testing::StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("label 2")));
  data.classes = 3;
  data.features(3, 1) = NAN;
  EXPECT_THAT(Validate(data),
              testing::StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("finite")));
  EXPECT_THAT(Validate(LabelledFeatures()),
              testing::StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("no labelled")));
}

}  // namespace
}  // namespace strata
