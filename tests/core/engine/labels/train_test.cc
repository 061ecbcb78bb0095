// What a train job is told; what it learns: classify_test.cc.
#include "core/engine/labels/train.h"

#include "absl/status/status.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/world/job_arguments.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

absl::StatusOr<TrainSettings> Parse(const JobParameters& parameters) {
  return ParseTrainSettings(ReadJobArguments("train", parameters).value());
}

TEST(TrainSettingsTest, WhatNobodySaysIsAsTheLibraryHasIt) {
  STRATA_ASSERT_OK_AND_ASSIGN(const TrainSettings settings, Parse({}));
  const TrainingOptions library;
  EXPECT_EQ(settings.name, "");
  EXPECT_EQ(settings.options.method, library.method);
  EXPECT_EQ(settings.options.features.set, library.features.set);
  EXPECT_EQ(ToString(settings.options.reduction), ToString(library.reduction));
  EXPECT_EQ(settings.options.neighbours, library.neighbours);
  EXPECT_EQ(settings.options.rounds, library.rounds);
  EXPECT_EQ(settings.options.slack_weight, library.slack_weight);
  EXPECT_EQ(settings.folds, 5);
  EXPECT_EQ(settings.region_m, 0.0);
}

TEST(TrainSettingsTest, EveryParameterIsHeard) {
  STRATA_ASSERT_OK_AND_ASSIGN(const TrainSettings settings,
                              Parse({{"name", "street"},
                                     {"method", "knn"},
                                     {"features", "spin"},
                                     {"reduce", "depth=30"},
                                     {"neighbours", "9"},
                                     {"rounds", "7"},
                                     {"slack_weight", "2.5"},
                                     {"folds", "0"},
                                     {"region_m", "12.5"}}));
  EXPECT_EQ(settings.name, "street");
  EXPECT_EQ(settings.options.method, ClassifierMethod::kNearest);
  EXPECT_EQ(settings.options.features.set, FeatureSet::kSpin);
  EXPECT_EQ(ToString(settings.options.reduction), "depth=30");
  EXPECT_EQ(settings.options.neighbours, 9);
  EXPECT_EQ(settings.options.rounds, 7);
  EXPECT_EQ(settings.options.slack_weight, 2.5);
  EXPECT_EQ(settings.folds, 0);
  EXPECT_EQ(settings.region_m, 12.5);
}

TEST(TrainSettingsTest, AReductionOutOfItsBoundsIsNamed) {
  EXPECT_THAT(Parse({{"reduce", "depth=31"}}),
              testing::StatusIs(absl::StatusCode::kInvalidArgument,
                                ::testing::AllOf(::testing::HasSubstr("job parameter reduce"),
                                                 ::testing::HasSubstr("31"))));
}

}  // namespace
}  // namespace strata
