// Poses set by hand.
#include "absl/status/status.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/core/engine/engine_fixture.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

class EnginePoseGraphTest : public EngineTest {};

TEST_F(EnginePoseGraphTest, SetPoseEqualsHavingBeenThereAndBeginsAnEpoch) {
  MakeMap();
  UploadRooms(3);
  const MapStats before = WaitIntegrated(db());
  const Pose T_map_scan = PoseAt(30, -5, 1.0);
  STRATA_ASSERT_OK(db().posegraph().SetPose({}, kMapName, {"run", 2}, T_map_scan));
  const MapStats after = WaitIntegrated(db());
  EXPECT_EQ(after.epoch, before.epoch + 1);
  EXPECT_NE(after.content_digest, before.content_digest);
  STRATA_ASSERT_OK_AND_ASSIGN(const ScanInfo moved, db().scans().Get({}, kMapName, {"run", 2}));
  EXPECT_TRUE(moved.T_map_scan.isApprox(T_map_scan, 0.0));
  EXPECT_TRUE(moved.header.T_map_scan.isApprox(RoomPose(2)));
  ExpectSound();

  const PointCloud room = MakeRoom(2);
  STRATA_ASSERT_OK(db().scans().Delete({}, kMapName, {"run", 2}));
  STRATA_ASSERT_OK(Upload(db(), HeaderOf({"run", 2}, room, T_map_scan), room));
  EXPECT_EQ(Digest(), after.content_digest);
}

}  // namespace
}  // namespace strata::testing
