// What a train job is told; what it learns: classify_test.cc.
#include "core/engine/labels/train.h"

#include <string>
#include <variant>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/world/job_arguments.h"
#include "core/world/job_kinds.h"
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
  EXPECT_EQ(settings.options.features, library.features);
  EXPECT_EQ(settings.options.network.max_degree, library.network.max_degree);
  EXPECT_EQ(settings.options.network.draws, library.network.draws);
  EXPECT_EQ(settings.options.network.sigma_spacings, library.network.sigma_spacings);
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
                                     {"feature_neighbours", "17"},
                                     {"scales", "3"},
                                     {"voxel_m", "0.25"},
                                     {"max_height_m", "8"},
                                     {"plane_side_m", "0.1"},
                                     {"wall_distance_m", "0.75"},
                                     {"spin_radius_m", "0.2"},
                                     {"network_degree", "4"},
                                     {"network_draws", "20"},
                                     {"network_sigma", "3"},
                                     {"folds", "0"},
                                     {"region_m", "12.5"}}));
  EXPECT_EQ(settings.name, "street");
  EXPECT_EQ(settings.options.method, ClassifierMethod::kNearest);
  EXPECT_EQ(settings.options.features.set, FeatureSet::kSpin);
  EXPECT_EQ(ToString(settings.options.reduction), "depth=30");
  EXPECT_EQ(settings.options.neighbours, 9);
  EXPECT_EQ(settings.options.rounds, 7);
  EXPECT_EQ(settings.options.slack_weight, 2.5);
  EXPECT_EQ(settings.options.features.neighbours, 17);
  EXPECT_EQ(settings.options.features.scales, 3);
  EXPECT_EQ(settings.options.features.voxel_m, 0.25);
  EXPECT_EQ(settings.options.features.max_height_m, 8.0);
  EXPECT_EQ(settings.options.features.plane_side_m, 0.1);
  EXPECT_EQ(settings.options.features.wall_distance_m, 0.75);
  EXPECT_EQ(settings.options.features.spin_radius_m, 0.2);
  EXPECT_EQ(settings.options.network.max_degree, 4);
  EXPECT_EQ(settings.options.network.draws, 20);
  EXPECT_EQ(settings.options.network.sigma_spacings, 3.0);
  EXPECT_EQ(settings.folds, 0);
  EXPECT_EQ(settings.region_m, 12.5);
}

TEST(TrainSettingsTest, AReductionOutOfItsBoundsIsNamed) {
  EXPECT_THAT(Parse({{"reduce", "depth=31"}}),
              testing::StatusIs(absl::StatusCode::kInvalidArgument,
                                ::testing::AllOf(::testing::HasSubstr("job parameter reduce"),
                                                 ::testing::HasSubstr("31"))));
}

TEST(TrainSettingsTest, WhatTheTableTakesTheLibraryTakes) {
  for (const JobParameter& parameter : FindJobKind(kTrainJob).value()->parameters) {
    std::vector<std::string> texts;
    if (const auto* whole = std::get_if<WholeType>(&parameter.type)) {
      texts = {absl::StrCat(whole->least), absl::StrCat(whole->most)};
    } else if (const auto* real = std::get_if<RealType>(&parameter.type)) {
      texts = {absl::StrCat(real->least), absl::StrCat(real->most)};
    }
    for (const std::string& text : texts) {
      STRATA_ASSERT_OK_AND_ASSIGN(const TrainSettings settings,
                                  Parse({{std::string(parameter.name), text}}));
      STRATA_EXPECT_OK(settings.options.Validate());
      STRATA_EXPECT_OK(settings.options.network.Validate());
    }
  }
}

}  // namespace
}  // namespace strata
