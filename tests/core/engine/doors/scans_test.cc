// What becomes of scans once they are acknowledged.
#include <cstdint>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "absl/time/clock.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/codec/surface_tile_codec.h"
#include "core/common/retry_delay.h"
#include "core/common/status.h"
#include "tests/core/engine/engine_fixture.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class EngineScansTest : public EngineTest {};

TEST_F(EngineScansTest, RestartContinuesWithPendingScans) {
  MakeMap();
  UploadRooms(12);
  Close();  // some are surely still pending
  Reopen();
  const MapStats stats = WaitIntegrated(db());
  EXPECT_EQ(stats.scans, 12U);
  MakeMap(SmallMap(), "other");
  UploadRooms(12, "other");
  EXPECT_EQ(WaitIntegrated(db(), "other").content_digest, stats.content_digest);
}

TEST_F(EngineScansTest, ScansAreAlignedToThoseAround) {
  MapParameters parameters = SmallMap();
  parameters.mls.cell_size_m = 0.2;
  MakeMap(parameters);
  double uploaded_error = 0.0;
  for (std::uint64_t i = 0; i < 6; ++i) {
    const Pose truth = PoseAt(1.5 * static_cast<double>(i), 0.0, 0.05 * static_cast<double>(i));
    const PointCloud cloud = SeeWorld(truth, i + 1, 200'000);
    const Pose rough = i == 0 ? truth : truth * PoseAt(0.15, -0.1, 0.01);
    uploaded_error = (rough.translation() - truth.translation()).norm();
    STRATA_ASSERT_OK(Upload(db(), HeaderOf({"run", i}, cloud, rough, Alignment::kOn), cloud));
  }
  WaitIntegrated(db());
  STRATA_ASSERT_OK_AND_ASSIGN(const ScanInfo last, db().scans().Get({}, kMapName, {"run", 5}));
  EXPECT_TRUE(last.alignment.aligned) << last.alignment.message;
  const Pose truth = PoseAt(7.5, 0.0, 0.25);
  EXPECT_LT((last.T_map_scan.translation() - truth.translation()).norm(), uploaded_error / 2);
  STRATA_ASSERT_OK_AND_ASSIGN(const api::PoseGraphState graph, db().posegraph().Get({}, kMapName));
  EXPECT_EQ(graph.nodes.size(), 6U);
  ASSERT_GE(graph.constraints.size(), 5U);
  for (const Constraint& constraint : graph.constraints) {
    EXPECT_GT(constraint.information.diagonal().minCoeff(), 0.0);
  }
}

TEST_F(EngineScansTest, DeleteEqualsNeverUploaded) {
  MakeMap();
  UploadRooms(3);
  const std::string before = Digest();
  const auto tiles = AllTiles(db());
  UploadRoom(9, PoseAt(1, 1));
  EXPECT_THAT(Digest(), Not(before));
  STRATA_ASSERT_OK(db().scans().Delete({}, kMapName, {"run", 9}));
  EXPECT_EQ(Digest(), before);
  for (const auto& [key, bytes] : AllTiles(db())) {
    ASSERT_TRUE(tiles.contains(key)) << key.ToString();
    EXPECT_EQ(DecodeSurfaceTile(bytes)->surfaces, DecodeSurfaceTile(tiles.at(key))->surfaces);
  }
  EXPECT_THAT(db().scans().Delete({}, kMapName, {"run", 9}),
              StatusIs(absl::StatusCode::kNotFound, HasSubstr("run/9")));
  ExpectSound();
}

// Of a download that other calls come into the middle of.
TEST_F(EngineScansTest, PointsAreOfOneScanAndItsLabelsOfOneMoment) {
  MakeMap();
  PointCloud cloud = SeeWorld(Pose::Identity(), 1, 200'000);
  while (cloud.size() < 200'000) cloud.points.push_back(cloud.points[cloud.size() % 1000]);
  const ScanId id{"run", 1};
  const auto send = [&] {
    STRATA_ASSERT_OK(Upload(db(), HeaderOf(id, cloud, Pose::Identity()), cloud, 20'000));
  };
  send();
  WaitIntegrated(db());
  const auto label = [&](std::uint16_t with) {
    return db().scans().SetLabels(
        {}, kMapName, id, std::vector<std::uint16_t>(cloud.size(), with), api::LabelMode::kReplace);
  };
  STRATA_ASSERT_OK(label(1));
  std::size_t pieces = 0;
  std::vector<std::uint16_t> labels;
  STRATA_ASSERT_OK(db().scans().GetPoints({}, kMapName, id, [&](const PointCloud& piece) {
    labels.insert(labels.end(), piece.label.begin(), piece.label.end());
    return pieces++ == 0 ? label(2) : absl::OkStatus();
  }));
  ASSERT_GT(pieces, 1U);
  EXPECT_EQ(labels.size(), cloud.size());
  EXPECT_THAT(labels, ::testing::Each(1));
  pieces = 0;
  EXPECT_THAT(db().scans().GetPoints({},
                                     kMapName,
                                     id,
                                     [&](const PointCloud&) -> absl::Status {
                                       if (pieces++ > 0) return absl::OkStatus();
                                       const absl::Status deleted =
                                           db().scans().Delete({}, kMapName, id);
                                       send();
                                       return deleted;
                                     }),
              StatusIs(absl::StatusCode::kAborted, HasSubstr("sent anew")));
}

// A listing is of one epoch: what came into the map in a later one waits in it.
TEST_F(EngineScansTest, NoScanIsListedAsIntegratedWithoutItsPose) {
  constexpr std::uint64_t kMany = 300;  // more than a page
  MakeMap();
  UploadRooms(kMany);
  WaitIntegrated(db());
  std::uint64_t seen = 0;
  STRATA_ASSERT_OK(db().scans().List({}, kMapName, {}, [&](const ScanInfo& scan) -> absl::Status {
    if (++seen == 1) {
      STRATA_RETURN_IF_ERROR(db().posegraph().SetPose({}, kMapName, {"run", 1}, PoseAt(0.5, 0.5)));
      UploadRoom(kMany + 1, RoomPose(2));
      WaitIntegrated(db());
    }
    if (scan.header.id.sequence == kMany + 1) {
      EXPECT_EQ(scan.state, ScanState::kPending);
    }
    return absl::OkStatus();
  }));
  EXPECT_EQ(seen, kMany + 1);
  STRATA_ASSERT_OK_AND_ASSIGN(const ScanInfo now,
                              db().scans().Get({}, kMapName, {"run", kMany + 1}));
  EXPECT_EQ(now.state, ScanState::kIntegrated);
}

TEST_F(EngineScansTest, ManyRobotsAtOnce) {
  MakeMap();
  std::vector<std::thread> robots;
  for (int robot = 0; robot < 4; ++robot) {
    robots.emplace_back([this, robot] {
      for (std::uint64_t i = 1; i <= 6; ++i) {
        const PointCloud cloud = MakeRoom(i + 100 * static_cast<std::uint64_t>(robot), 1000);
        const ScanId id{"robot" + std::to_string(robot), i};
        STRATA_EXPECT_OK(Upload(db(), HeaderOf(id, cloud, PoseAt(robot * 5.0, i * 3.0)), cloud));
        STRATA_EXPECT_OK(db().maps().Stats({}, kMapName));
      }
    });
  }
  for (std::thread& robot : robots) robot.join();
  EXPECT_EQ(WaitIntegrated(db()).scans, 24U);
  ExpectSound();
}

TEST_F(EngineScansTest, WhoComesWhileTooManyWaitIsToldWhenToComeAgain) {
  EngineOptions options = Options();
  options.max_pending_scans = 1;
  Reopen(options);
  MakeMap();
  int refused = 0;
  for (std::uint64_t i = 1; i <= 10; ++i) {
    const PointCloud cloud = MakeRoom(i, 100'000);
    const ScanHeader header = HeaderOf({"robot", i}, cloud, RoomPose(i));
    absl::Status sent = Upload(db(), header, cloud).status();
    for (; absl::IsResourceExhausted(sent); sent = Upload(db(), header, cloud).status()) {
      ASSERT_THAT(sent.message(), HasSubstr("scans wait for integration, at most 1"));
      ASSERT_NE(RetryDelayOf(sent), std::nullopt);
      absl::SleepFor(*RetryDelayOf(sent));
      ++refused;
    }
    STRATA_EXPECT_OK(sent);
  }
  EXPECT_GT(refused, 0);
  EXPECT_EQ(WaitIntegrated(db()).scans, 10U);
}

TEST_F(EngineScansTest, AScanThatLeavesTheMapIsNotLostInSilence) {
  MakeMap();
  Pose high = Pose::Identity();
  high.translation().z() = 3000.0;
  const auto beyond = HasSubstr("0 of 3000 points within what a map can hold");
  const ScanId lost = UploadRoom(1, high);
  const ScanId room = UploadRoom(2, PoseAt(0, 0));
  const std::string digest = Digest();
  STRATA_ASSERT_OK_AND_ASSIGN(const ScanInfo scan, db().scans().Get({}, kMapName, lost));
  EXPECT_EQ(scan.state, ScanState::kFailed);
  EXPECT_THAT(scan.message, beyond);
  EXPECT_THAT(db().posegraph().SetPose({}, kMapName, room, high),
              StatusIs(absl::StatusCode::kInvalidArgument, beyond));
  EXPECT_EQ(Digest(), digest);
  ExpectSound();
}

TEST_F(EngineScansTest, AScanAllOverTheMapIsRefusedBeforeItTakesMemory) {
  MakeMap();
  std::mt19937 random(1);
  std::uniform_real_distribution<float> anywhere(-1e6F, 1e6F);
  PointCloud cloud;
  for (int i = 0; i < 20'000; ++i) cloud.points.emplace_back(anywhere(random), anywhere(random), 0);
  ScanHeader header = HeaderOf({"run", 1}, cloud, PoseAt(0, 0));
  header.sensor = SensorModel{.max_range_m = 1e6};
  STRATA_ASSERT_OK(Upload(db(), header, cloud));
  WaitIntegrated(db());
  STRATA_ASSERT_OK_AND_ASSIGN(const ScanInfo scan, db().scans().Get({}, kMapName, header.id));
  EXPECT_EQ(scan.state, ScanState::kFailed);
  EXPECT_THAT(scan.message, HasSubstr("more than 4096 tiles"));
  // Far points that the sensor cannot have seen do no harm.
  cloud.points.front() = {1.0F, 0.0F, 0.0F};
  STRATA_ASSERT_OK(Upload(db(), HeaderOf({"run", 2}, cloud, PoseAt(0, 0)), cloud));
  EXPECT_EQ(WaitIntegrated(db()).scans_failed, 1U);
  ExpectSound();
}

TEST_F(EngineScansTest, ADamagedScanDoesNotStopTheOthers) {
  MakeMap();
  UploadRooms(3);
  WaitIntegrated(db());
  Close();
  const std::string spoilt = "UPDATE truth_scan SET header = x'00' WHERE sequence = ";
  Sql(spoilt + "1");                                                      // integrated
  Sql(spoilt + "2; UPDATE truth_scan SET state = 1 WHERE sequence = 2");  // pending
  Reopen();
  for (const std::uint64_t next : {4, 5}) UploadRoom(next, RoomPose(next));
  const auto state = [&](std::uint64_t sequence) {
    const auto scan = db().scans().Get({}, kMapName, {"run", sequence});
    STRATA_EXPECT_OK(scan);
    return scan.ok() ? scan->state : ScanState::kFailed;
  };
  while (state(5) == ScanState::kPending) {
  }
  for (const std::uint64_t sound : {3, 4, 5}) EXPECT_EQ(state(sound), ScanState::kIntegrated);
  for (const std::uint64_t damaged : {1, 2}) {
    EXPECT_THAT(db().scans().Get({}, kMapName, {"run", damaged}),
                StatusIs(absl::StatusCode::kDataLoss, HasSubstr("scan run/")));
  }
  const JobInfo verified = RunJob(db(), "verify");
  EXPECT_EQ(verified.state, JobState::kFailed);
  EXPECT_THAT(verified.message, HasSubstr("2 mismatches"));
}

}  // namespace
}  // namespace strata::testing
