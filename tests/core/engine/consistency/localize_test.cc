#include <string>

#include <gtest/gtest.h>

#include "tests/core/engine/consistency/yard_fixture.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using LocalizeTest = YardTest;

TEST_F(LocalizeTest, AnEmptyMapHasNoPlace) {
  MakeMap(MapParameters());
  LocalizeQuery query;
  query.cloud = See(TruthOf(1), 1);
  STRATA_ASSERT_OK_AND_ASSIGN(const LocalizeResult result,
                              db().posegraph().Localize({}, kMapName, query));
  EXPECT_FALSE(result.found);
  EXPECT_NE(result.message, "");
}

TEST_F(LocalizeTest, AScanFindsItsPlace) {
  MakeMap(MapParameters());
  for (std::uint64_t k = 1; k <= kScans; ++k) UploadScan(k, TruthOf(k));
  const std::string digest = Digest();
  const Pose taken = TruthOf(3) * PoseAt(0.6, -0.4, 0.25);
  LocalizeQuery query;
  query.cloud = See(taken, 1234);
  query.T_map_scan_guess = taken * PoseAt(1.0, 0.5, 0.2);
  query.guess_radius_m = 3.0;
  for (const bool guess : {true, false}) {
    SCOPED_TRACE(guess ? "with a guess" : "by looks");
    if (!guess) query.T_map_scan_guess.reset();
    STRATA_ASSERT_OK_AND_ASSIGN(const LocalizeResult result,
                                db().posegraph().Localize({}, kMapName, query));
    ASSERT_TRUE(result.found) << result.message;
    const Pose off = taken.inverse() * result.best.T_map_scan;
    EXPECT_LT(off.translation().norm(), 0.1);
    EXPECT_LT(RotationAngleRad(off), 0.02);
    EXPECT_EQ(result.epoch, 1U);
    EXPECT_GT(result.best.overlap, 0.5);
    EXPECT_TRUE(result.covariance.allFinite());
    EXPECT_GT(result.covariance.diagonal().minCoeff(), 0.0);
  }
  EXPECT_EQ(Digest(), digest);
  query.T_map_scan_guess = PoseAt(500.0, 500.0);
  STRATA_ASSERT_OK_AND_ASSIGN(const LocalizeResult nowhere,
                              db().posegraph().Localize({}, kMapName, query));
  EXPECT_FALSE(nowhere.found);
}

}  // namespace
}  // namespace strata::testing
