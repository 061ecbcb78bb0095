// Jobs: rebuild, cancel, restart.
#include <string>
#include <vector>

#include "absl/status/status.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/codec/surface_tile_codec.h"
#include "tests/core/engine/engine_fixture.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::HasSubstr;

class EngineJobsTest : public EngineTest {};

TEST_F(EngineJobsTest, RebuildOfASoundMapChangesNothingForAnyThreads) {
  MakeMap();
  UploadRooms(5);
  const MapStats before = WaitIntegrated(db());
  const auto tiles = AllTiles(db());
  for (const char* threads : {"1", "4"}) {
    const JobInfo job = RunJob(db(), "rebuild", {{"threads", threads}});
    ASSERT_EQ(job.state, JobState::kSucceeded) << job.message;
    EXPECT_EQ(job.metrics.at("tiles_changed"), 0.0);
    EXPECT_EQ(Digest(), before.content_digest);
    EXPECT_EQ(AllTiles(db()), tiles);
  }
}

TEST_F(EngineJobsTest, DroppedDerivedDataComeBackByThemselves) {
  MakeMap();
  UploadRooms(5);
  const MapStats before = WaitIntegrated(db());
  const auto tiles = AllTiles(db());
  for (int threads : {1, 4}) {
    Close();
    Sql("DROP TABLE derived_mls_tile; DROP TABLE derived_surface_tile; DROP TABLE "
        "derived_scan_tile; DROP TABLE derived_footprint; DROP TABLE derived_state;");
    EngineOptions options = Options();
    options.worker_threads = threads;
    Reopen(options);
    // Jobs run after the recovery.
    ExpectSound();
    EXPECT_EQ(Digest(), before.content_digest);
    const auto again = AllTiles(db());
    ASSERT_EQ(again.size(), tiles.size());
    for (const auto& [key, bytes] : tiles) {
      EXPECT_EQ(DecodeSurfaceTile(bytes)->surfaces, DecodeSurfaceTile(again.at(key))->surfaces);
    }
  }
}

TEST_F(EngineJobsTest, ACancelledRebuildChangesNothing) {
  MakeMap();
  UploadRooms(60);
  const std::string digest = Digest();
  const auto tiles = AllTiles(db());
  STRATA_ASSERT_OK_AND_ASSIGN(const auto listed, db().tiles().List({}, kMapName, {}));
  JobInfo last;
  // A job that ends before it can be cancelled is no failure, so there are several tries.
  for (int attempt = 0; attempt < 20 && last.state != JobState::kCancelled; ++attempt) {
    STRATA_ASSERT_OK_AND_ASSIGN(last, db().jobs().Start({}, kMapName, "rebuild", {}));
    while (last.state == JobState::kQueued) {
      STRATA_ASSERT_OK_AND_ASSIGN(last, db().jobs().Get({}, kMapName, last.id));
    }
    STRATA_ASSERT_OK(db().jobs().Cancel({}, kMapName, last.id));
    STRATA_ASSERT_OK(db().jobs().Watch({}, kMapName, last.id, [&last](const JobInfo& info) {
      last = info;
      return absl::OkStatus();
    }));
  }
  EXPECT_EQ(last.state, JobState::kCancelled);
  EXPECT_LT(last.progress, 1.0);
  EXPECT_EQ(Digest(), digest);
  EXPECT_EQ(AllTiles(db()), tiles);
  STRATA_ASSERT_OK_AND_ASSIGN(const auto now, db().tiles().List({}, kMapName, {}));
  ASSERT_EQ(now.size(), listed.size());
  for (std::size_t i = 0; i < now.size(); ++i) EXPECT_EQ(now[i].version, listed[i].version);
  ExpectSound();
}

TEST_F(EngineJobsTest, JobsAreCheckedListedAndSurvive) {
  MakeMap();
  EXPECT_THAT(db().jobs().Start({}, kMapName, "dance", {}),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("dance")));
  EXPECT_THAT(db().jobs().Start({}, kMapName, "verify", {{"threads", "0"}}),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("threads")));
  const JobInfo first = RunJob(db(), "verify");
  STRATA_ASSERT_OK_AND_ASSIGN(const JobInfo second, db().jobs().Start({}, kMapName, "rebuild", {}));
  Reopen();
  STRATA_EXPECT_OK(
      db().jobs().Watch({}, kMapName, second.id, [](const JobInfo&) { return absl::OkStatus(); }));
  STRATA_ASSERT_OK_AND_ASSIGN(const std::vector<JobInfo> all, db().jobs().List({}, kMapName));
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(all[0].metrics, first.metrics);
  EXPECT_EQ(all[1].state, JobState::kSucceeded);
  EXPECT_THAT(db().jobs().Get({}, kMapName, 99),
              StatusIs(absl::StatusCode::kNotFound, HasSubstr("99")));
}

}  // namespace
}  // namespace strata::testing
