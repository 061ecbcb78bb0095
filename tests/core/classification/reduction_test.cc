#include "core/classification/reduction.h"

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

#include "core/classification/evaluation.h"
#include "core/common/random.h"

namespace strata {
namespace {

struct Scene {
  std::vector<Eigen::Vector3f> positions;
  LabelledFeatures data;
};

// A wall of one class with a window of another in it.
Scene WallWithWindow(int across) {
  Scene scene;
  scene.data.classes = 2;
  scene.data.features.resize(across * across, 2);
  SplitMix64 random(5);
  for (int i = 0; i < across; ++i) {
    for (int j = 0; j < across; ++j) {
      const auto row = static_cast<Eigen::Index>(scene.positions.size());
      scene.positions.emplace_back(static_cast<float>(i), 0.0F, static_cast<float>(j));
      const bool window =
          i > across / 2 && i < 3 * across / 4 && j > across / 2 && j < 3 * across / 4;
      scene.data.labels.push_back(window ? 1 : 0);
      scene.data.features.row(row) << static_cast<float>(random.Uniform()), window ? 1.0F : 0.0F;
    }
  }
  return scene;
}

std::uint32_t Sum(const std::vector<std::uint32_t>& counts) {
  return std::accumulate(counts.begin(), counts.end(), 0U);
}

TEST(ReductionTest, PureLeavesStandForPointsOfOneClass) {
  const Scene scene = WallWithWindow(64);
  const ReducedPoints reduced = Reduce(scene.positions, scene.data, {.kind = ReductionKind::kPure});
  EXPECT_EQ(Sum(reduced.counts), scene.positions.size());
  EXPECT_LT(reduced.positions.size(), scene.positions.size() / 10);
  double windows = 0.0;
  for (std::size_t k = 0; k < reduced.positions.size(); ++k) {
    const auto row = static_cast<Eigen::Index>(k);
    EXPECT_EQ(std::count(reduced.row_of.begin(), reduced.row_of.end(), k), reduced.counts[k]);
    // The second feature is the label: no leaf mixes.
    EXPECT_EQ(reduced.data.features(row, 1), reduced.data.labels[k] == 1 ? 1.0F : 0.0F);
    windows += reduced.data.labels[k] == 1 ? reduced.counts[k] : 0.0;
    // The features are those of a point, of the nearest of its class or of one equally near.
    double nearest = 1e9, taken = 1e9;
    for (std::size_t i = 0; i < scene.positions.size(); ++i) {
      if (scene.data.labels[i] != reduced.data.labels[k]) continue;
      const double distance = (scene.positions[i] - reduced.positions[k]).norm();
      nearest = std::min(nearest, distance);
      if (scene.data.features.row(static_cast<Eigen::Index>(i)) == reduced.data.features.row(row)) {
        taken = std::min(taken, distance);
      }
    }
    EXPECT_NEAR(taken, nearest, 1e-5) << k;
  }
  EXPECT_EQ(windows, std::accumulate(scene.data.labels.begin(), scene.data.labels.end(), 0));
}

TEST(ReductionTest, DepthBoundsTheNumberOfPoints) {
  const Scene scene = WallWithWindow(40);
  for (const int depth : {1, 4, 8, 30}) {
    const ReducedPoints reduced =
        Reduce(scene.positions, scene.data, {.kind = ReductionKind::kDepth, .depth = depth});
    EXPECT_EQ(Sum(reduced.counts), scene.positions.size());
    const std::size_t most = std::min<std::size_t>(std::size_t{1} << (depth - 1), 1600);
    EXPECT_LE(reduced.positions.size(), most);
    EXPECT_GE(reduced.positions.size(), most - most / 4);
  }
}

TEST(ReductionTest, LeavesOfADepthAreAsLargeWhereverPointsAreDense) {
  // 1,000 points on the first metre of a line, one on each of the other seven.
  std::vector<Eigen::Vector3f> positions;
  for (int i = 0; i < 1000; ++i) positions.emplace_back(0.001F * static_cast<float>(i), 0.0F, 0.0F);
  for (int i = 1; i < 8; ++i) positions.emplace_back(static_cast<float>(i) + 0.5F, 0.0F, 0.0F);
  positions.emplace_back(8.0F, 0.0F, 0.0F);
  LabelledFeatures data;
  data.classes = 1;
  data.features = FeatureMatrix::Zero(static_cast<Eigen::Index>(positions.size()), 1);
  data.labels.assign(positions.size(), 0);
  const ReducedPoints reduced =
      Reduce(positions, data, {.kind = ReductionKind::kDepth, .depth = 4});
  std::vector<std::uint32_t> counts = reduced.counts;
  std::sort(counts.begin(), counts.end());
  EXPECT_EQ(counts, (std::vector<std::uint32_t>{1, 1, 1, 1, 1, 2, 251, 750}));
  // Points at one place are never told apart.
  positions.assign(positions.size(), Eigen::Vector3f(1.0F, 2.0F, 3.0F));
  EXPECT_EQ(Reduce(positions, data, {.kind = ReductionKind::kDepth, .depth = 30}).counts,
            std::vector<std::uint32_t>{static_cast<std::uint32_t>(positions.size())});
}

TEST(ReductionTest, RandomKeepsPointsAsTheyAre) {
  const Scene scene = WallWithWindow(40);
  const ReducedPoints reduced =
      Reduce(scene.positions, scene.data, {.kind = ReductionKind::kRandom, .count = 100});
  ASSERT_EQ(reduced.positions.size(), 100U);
  for (std::size_t k = 0; k < reduced.positions.size(); ++k) {
    const auto row =
        static_cast<Eigen::Index>(40.0F * reduced.positions[k].x() + reduced.positions[k].z());
    EXPECT_EQ(reduced.data.features.row(static_cast<Eigen::Index>(k)),
              scene.data.features.row(row));
  }
  const ReducedPoints none = Reduce(scene.positions, scene.data, {.kind = ReductionKind::kNone});
  EXPECT_TRUE(none.row_of.empty());
  EXPECT_EQ(none.data.features, scene.data.features);
  EXPECT_EQ(none.data.labels, scene.data.labels);
}

TEST(ReductionTest, BalancedSharesGoByTheRootOfTheNumbers) {
  const Scene scene = WallWithWindow(64);  // 225 of 4096 points are window: roots 15 and 62
  const ReducedPoints reduced =
      Reduce(scene.positions, scene.data, {.kind = ReductionKind::kBalanced, .count = 154});
  const auto windows = std::count(reduced.data.labels.begin(), reduced.data.labels.end(), 1);
  EXPECT_EQ(windows, 30);
  EXPECT_EQ(reduced.data.labels.size(), 155U) << "29.9 and 124.1, both rounded up";
  for (std::size_t k = 0; k < reduced.positions.size(); ++k) {
    const auto row =
        static_cast<Eigen::Index>(64.0F * reduced.positions[k].x() + reduced.positions[k].z());
    EXPECT_EQ(reduced.data.features.row(static_cast<Eigen::Index>(k)),
              scene.data.features.row(row));
  }
  // Where a class has fewer points than its share, all of them.
  const ReducedPoints most =
      Reduce(scene.positions, scene.data, {.kind = ReductionKind::kBalanced, .count = 2000});
  EXPECT_EQ(std::count(most.data.labels.begin(), most.data.labels.end(), 1), 225);
  EXPECT_EQ(most.counts, std::vector<std::uint32_t>(most.data.labels.size(), 1));
}

TEST(EvaluationTest, CountsByHand) {
  ConfusionMatrix matrix(3);
  const std::vector<ClassIndex> truth = {0, 0, 0, 1, 1};
  const std::vector<ClassIndex> given = {0, 0, 1, 1, 0};
  matrix.Add(truth, given);
  EXPECT_EQ(matrix.total(), 5U);
  EXPECT_DOUBLE_EQ(matrix.Accuracy(), 0.6);
  EXPECT_DOUBLE_EQ(matrix.Precision(0).value(), 2.0 / 3.0);
  EXPECT_DOUBLE_EQ(matrix.Recall(0).value(), 2.0 / 3.0);
  EXPECT_DOUBLE_EQ(matrix.Iou(0).value(), 0.5);
  EXPECT_DOUBLE_EQ(matrix.Iou(1).value(), 1.0 / 3.0);
  EXPECT_FALSE(matrix.Iou(2).has_value());
  EXPECT_FALSE(matrix.Precision(2).has_value());
  EXPECT_DOUBLE_EQ(matrix.MeanIou(), (0.5 + 1.0 / 3.0) / 2.0);
  matrix.Add(matrix);
  EXPECT_EQ(matrix.count(0, 1), 2U);
  EXPECT_EQ(ConfusionMatrix(2).Accuracy(), 0.0);
}

TEST(EvaluationTest, FoldsAreOfEqualSize) {
  const std::vector<std::size_t> folds = DrawFolds(11, 3, 4);
  std::vector<int> size(3, 0);
  for (const std::size_t fold : folds) ++size.at(fold);
  for (const int n : size) EXPECT_TRUE(n == 3 || n == 4);
  EXPECT_EQ(folds, DrawFolds(11, 3, 4));
  EXPECT_NE(folds, DrawFolds(11, 3, 5));
}

}  // namespace
}  // namespace strata
