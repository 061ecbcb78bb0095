#include "core/engine/consistency/optimize_settings.h"

#include <gtest/gtest.h>

#include "core/world/job_arguments.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

TEST(OptimizeSettingsTest, WhatNobodySaysIsAsTheLibraryHasIt) {
  const OptimizeSettings settings = DefaultOptimizeSettings();
  EXPECT_FALSE(settings.dry_run);
  EXPECT_TRUE(settings.closures);
  EXPECT_TRUE(settings.planes);
  EXPECT_TRUE(settings.robust);
  EXPECT_EQ(settings.rounds, 30);
  EXPECT_EQ(settings.pool, 5);
  EXPECT_EQ(settings.weighting, PoseGraphOptions().weighting);
  EXPECT_EQ(settings.local_weight, PoseGraphOptions().local_weight);
  EXPECT_EQ(settings.tolerance.translation_m, MoveTolerance().translation_m);
  EXPECT_EQ(settings.tolerance.rotation_rad, MoveTolerance().rotation_rad);
}

TEST(OptimizeSettingsTest, EveryParameterIsHeard) {
  STRATA_ASSERT_OK_AND_ASSIGN(const JobArguments arguments,
                              ReadJobArguments("optimize",
                                               {{"dry_run", "1"},
                                                {"closures", "0"},
                                                {"planes", "0"},
                                                {"robust", "0"},
                                                {"rounds", "3"},
                                                {"pool", "7"},
                                                {"weighting", "local_global"},
                                                {"local_weight", "0.25"},
                                                {"tolerance_m", "0.125"},
                                                {"tolerance_rad", "0.0625"}}));
  const OptimizeSettings settings(arguments);
  EXPECT_TRUE(settings.dry_run);
  EXPECT_FALSE(settings.closures);
  EXPECT_FALSE(settings.planes);
  EXPECT_FALSE(settings.robust);
  EXPECT_EQ(settings.rounds, 3);
  EXPECT_EQ(settings.pool, 7);
  EXPECT_EQ(settings.weighting, Weighting::kLocalGlobal);
  EXPECT_EQ(settings.local_weight, 0.25);
  EXPECT_EQ(settings.tolerance.translation_m, 0.125);
  EXPECT_EQ(settings.tolerance.rotation_rad, 0.0625);
}

}  // namespace
}  // namespace strata
