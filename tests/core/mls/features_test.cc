#include "core/mls/features.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/mls/patch.h"
#include "tests/core/mls/reference_map.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::strata::testing::ReferenceMap;
using ::strata::testing::ReferenceMeasurement;
using ::strata::testing::StatusIs;
using ::testing::HasSubstr;

// Ground at 0 in cell (0, 0), a wall from 1 to 2 m in cell (-1, 3).
MlsMap GroundAndWall() {
  std::vector<ReferenceMeasurement> measurements = {{.cell = {0, 0}, .z = 0, .sigma_code = 64}};
  for (int z = 4096; z <= 8192; z += 64) {
    measurements.push_back({.cell = {-1, 3}, .z = z, .sigma_code = 64});
  }
  return ReferenceMap(measurements, MlsParameters{});
}

std::vector<Feature> PlainFeatures(std::size_t count) {
  std::vector<Feature> features(count);
  for (std::size_t i = 0; i < count; ++i) {
    features[i].patch = static_cast<std::uint32_t>(i);
    features[i].sigma_m = i % 2 == 0 ? 0.01F : 0.02F;
    features[i].feature_class = static_cast<FeatureClass>(i % 3);
  }
  return features;
}

TEST(ExtractFeaturesTest, CellCentresAndVerticalSamplesFromTheTop) {
  STRATA_ASSERT_OK_AND_ASSIGN(const std::vector<Feature> features,
                              ExtractFeatures(GroundAndWall()));
  ASSERT_EQ(features.size(), 6U);  // 1 m at 4 points a metre: 2, 1.75, 1.5, 1.25, 1; and the ground
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(features[i].feature_class, FeatureClass::kVertical);
    EXPECT_NEAR(features[i].p_map.x(), -0.05, 1e-12);
    EXPECT_NEAR(features[i].p_map.y(), 0.35, 1e-12);
    EXPECT_NEAR(features[i].p_map.z(), 2.0 - 0.25 * i, 1e-12);
  }
  EXPECT_EQ(features[5].feature_class, FeatureClass::kTraversable);
  EXPECT_NEAR(features[5].p_map.z(), 0.0, 1e-12);
  EXPECT_NEAR(features[5].sigma_m, SigmaOfCode(64), 1e-4);
}

TEST(ExtractFeaturesTest, AnnotationGivesTheThirdClass) {
  const std::vector<Traversability> classes = {Traversability::kNonTraversable,
                                               Traversability::kNonTraversable};
  STRATA_ASSERT_OK_AND_ASSIGN(const std::vector<Feature> features,
                              ExtractFeatures(GroundAndWall(), {}, classes));
  EXPECT_EQ(features.front().feature_class, FeatureClass::kVertical);
  EXPECT_EQ(features.back().feature_class, FeatureClass::kNonTraversable);
}

TEST(ExtractFeaturesTest, RefusesWrongLengthAndOptions) {
  const std::vector<Traversability> classes(3);
  EXPECT_THAT(ExtractFeatures(GroundAndWall(), {}, classes),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("3 classes for 2 patches")));
  EXPECT_THAT(ExtractFeatures(GroundAndWall(), {.points_per_metre = 0}),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("points_per_metre")));
}

TEST(SampleTest, SizesOrderAndSeeds) {
  const std::vector<Feature> features = PlainFeatures(1000);
  const auto ids = [](const std::vector<Feature>& some) {
    std::vector<std::uint32_t> result;
    for (const Feature& f : some) result.push_back(f.patch);
    return result;
  };
  const auto sample = ids(SampleUniform(features, 100, 5));
  EXPECT_EQ(sample.size(), 100U);
  EXPECT_TRUE(std::is_sorted(sample.begin(), sample.end()));
  EXPECT_EQ(std::adjacent_find(sample.begin(), sample.end()), sample.end());
  EXPECT_EQ(ids(SampleUniform(features, 100, 5)), sample);
  EXPECT_NE(ids(SampleUniform(features, 100, 6)), sample);
  EXPECT_EQ(SampleUniform(features, 5000, 1).size(), 1000U);
  EXPECT_EQ(SampleFraction(features, 0.25, 1).size(), 250U);
  EXPECT_EQ(SampleFraction(features, std::nan(""), 1).size(), 0U);
  EXPECT_EQ(SampleFraction(features, 7.0, 1).size(), 1000U);
  EXPECT_EQ(SampleInverseVariance(features, 5000, 1).size(), 1000U);
  EXPECT_EQ(SampleUniform({}, 10, 1).size(), 0U);
}

TEST(SampleTest, UniformTakesEveryFeatureEquallyOften) {
  const std::vector<Feature> features = PlainFeatures(20);
  std::array<int, 20> hits{};
  for (std::uint64_t seed = 0; seed < 20000; ++seed) {
    for (const Feature& f : SampleUniform(features, 5, seed)) ++hits[f.patch];
  }
  // Binomial(20000, 1/4): σ = 61; 5 σ.
  for (const int hit : hits) EXPECT_NEAR(hit, 5000, 306);
}

TEST(SampleTest, ClasswiseKeepsTheAskedNumbers) {
  const std::vector<Feature> features = PlainFeatures(300);
  std::map<FeatureClass, int> count;
  for (const Feature& f : SampleClasswise(features, {10, 0, 500}, 9)) ++count[f.feature_class];
  EXPECT_EQ(count[FeatureClass::kTraversable], 10);
  EXPECT_EQ(count[FeatureClass::kNonTraversable], 0);
  EXPECT_EQ(count[FeatureClass::kVertical], 100);
}

TEST(SampleTest, FirstDrawGoesByInverseVariance) {
  const std::vector<Feature> features = PlainFeatures(10);  // σ 1 cm and 2 cm: 4 to 1
  int precise = 0;
  for (std::uint64_t seed = 0; seed < 20000; ++seed) {
    precise += SampleInverseVariance(features, 1, seed).front().patch % 2 == 0 ? 1 : 0;
  }
  EXPECT_NEAR(precise, 16000, 283);  // 5 σ of a binomial
}

}  // namespace
}  // namespace strata
