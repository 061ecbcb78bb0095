// Scans that a disk has damaged: optimize leaves them out, carries them along and says so.
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/core/engine/consistency/yard_fixture.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::HasSubstr;
using Code = absl::StatusCode;
using OptimizeDamageTest = YardTest;

// Whichever bit of its points flips, and wherever on the way it is: it follows its neighbours, and
// is told of.
TEST_F(OptimizeDamageTest, ADamagedScanIsLeftOutAndNamed) {
  for (const std::uint64_t k : {1, 3, 6}) {
    const std::string map = "damaged" + std::to_string(k);
    SCOPED_TRACE(map);
    MakeMap(MapParameters(), map);
    for (std::uint64_t i = 1; i <= kScans; ++i) UploadScan(i, SaidOf(i), map);
    WaitIntegrated(db(), map);
    Close();
    // The type of the first piece, a length, and what is in it.
    const std::string at = std::to_string(k == 1 ? 2 : k == 3 ? 10 : 3000);
    Sql("UPDATE truth_chunk SET bytes = CAST(substr(bytes, 1, " + at +
            ") || x'5a' || substr(bytes, " + at +
            " + 2) AS BLOB) WHERE ordinal = 0 AND upload = "
            "(SELECT upload FROM truth_scan WHERE sequence = " +
            std::to_string(k) + ")",
        map);
    Reopen();
    const JobInfo job = RunJob(db(), "optimize", {{"closures", "0"}}, map);
    ASSERT_EQ(job.state, JobState::kSucceeded) << job.message;
    const std::string name = "run/" + std::to_string(k);
    EXPECT_THAT(job.message, HasSubstr("1 damaged scan left out: " + name + " ("));
    EXPECT_EQ(job.metrics.at("left_out"), 1.0);
    EXPECT_EQ(job.metrics.at("left_out." + name), 1.0);
    EXPECT_EQ(job.metrics.at("scans_carried"), 1.0);

    // The others are where they belong, it is where it was seen from one of them.
    const auto pose = [&](std::uint64_t i) {
      const auto lookup = db().posegraph().LookupPose({}, map, {"run", i});
      EXPECT_THAT(lookup, IsOk());
      return lookup.ok() ? lookup->T_map_scan : Pose::Identity();
    };
    const std::uint64_t one = k == 1 ? 2 : 1;
    for (std::uint64_t i = 1; i <= kScans; ++i) {
      if (i == k) continue;
      const Pose off = TruthOf(one).inverse() * TruthOf(i) * pose(i).inverse() * pose(one);
      EXPECT_LT(off.translation().norm(), 0.03) << i;
    }
    const auto follows = [&](std::uint64_t i) {
      return (pose(i).inverse() * pose(k)).isApprox(SaidOf(i).inverse() * SaidOf(k), 1e-9);
    };
    EXPECT_TRUE((k > 1 && follows(k - 1)) || (k < kScans && follows(k + 1)));

    // It is still there to be mended: deleted and sent again the map is sound.
    const JobInfo verify = RunJob(db(), "verify", {}, map);
    EXPECT_THAT(verify.message, HasSubstr(name));
    const Pose place = pose(k);
    STRATA_ASSERT_OK(db().scans().Delete({}, map, {"run", k}));
    UploadScan(k, place, map);
    WaitIntegrated(db(), map);
    const JobInfo sound = RunJob(db(), "verify", {}, map);
    EXPECT_EQ(sound.state, JobState::kSucceeded) << sound.message;
  }
}

// Its header says where its points are: without it the points cannot be used either.
TEST_F(OptimizeDamageTest, AScanWithADamagedRowIsLeftOutAndNamed) {
  MakeWorld();
  Close();
  Sql("UPDATE truth_scan SET header = CAST(x'00' || substr(header, 2) AS BLOB) WHERE sequence = 4");
  Reopen();
  const JobInfo job = Optimize({{"dry_run", "1"}});
  ASSERT_EQ(job.state, JobState::kProposed) << job.message;
  EXPECT_THAT(job.message, HasSubstr("run/4"));
  EXPECT_EQ(job.metrics.at("left_out"), 1.0);
  STRATA_ASSERT_OK(db().jobs().Accept({}, kMapName, job.id));
  const JobInfo accepted = Follow(job.id);
  ASSERT_EQ(accepted.state, JobState::kSucceeded) << accepted.message;
  EXPECT_EQ(accepted.message, job.message);
  const Pose off = TruthOf(1).inverse() * TruthOf(6) * PoseOf(6).inverse() * PoseOf(1);
  EXPECT_LT(off.translation().norm(), 0.03);
}

// A local map takes the place of points that are not kept.
TEST_F(OptimizeDamageTest, ADamagedLocalMapIsLeftOutAndTheWayBackIsOpen) {
  MapParameters parameters;
  parameters.keep_points = false;
  MakeMap(parameters);
  for (std::uint64_t k = 1; k <= kScans; ++k) UploadScan(k, SaidOf(k));
  WaitIntegrated(db());
  const std::vector<Pose> poses = Poses();
  Close();
  Sql("UPDATE truth_local_map SET bytes = CAST(substr(bytes, 1, 200) || x'5a5a' || "
      "substr(bytes, 203) AS BLOB) WHERE scan = "
      "(SELECT number FROM truth_scan WHERE sequence = 5)");
  Reopen();
  const JobInfo job = Optimize();
  ASSERT_EQ(job.state, JobState::kSucceeded) << job.message;
  EXPECT_EQ(job.metrics.at("left_out.run/5"), 1.0);
  EXPECT_LT((TruthOf(6).translation() - PoseOf(6).translation()).norm(), 0.03);
  STRATA_ASSERT_OK_AND_ASSIGN(const JobInfo undo, db().jobs().Revert({}, kMapName, job.id));
  const JobInfo back = Follow(undo.id);
  ASSERT_EQ(back.state, JobState::kSucceeded) << back.message;
  EXPECT_THAT(back.message, HasSubstr("run/5"));
  ExpectEqual(Poses(), poses);
}

// A person moves one scan and is told at once what stands in the way.
TEST_F(OptimizeDamageTest, APoseSetByHandDropsNoDamagedScan) {
  MakeWorld();
  const std::string digest = Digest();
  Close();
  Sql("UPDATE truth_chunk SET bytes = x'00' WHERE upload = "
      "(SELECT upload FROM truth_scan WHERE sequence = 3)");
  Reopen();
  EXPECT_THAT(db().posegraph().SetPose({}, kMapName, {"run", 4}, TruthOf(4)),
              StatusIs(Code::kDataLoss, HasSubstr("run/3")));
  EXPECT_EQ(Digest(), digest);
}

}  // namespace
}  // namespace strata::testing
