// Taking scans in: durable, once, and refused with a reason.
#include <limits>
#include <memory>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/api/database.h"
#include "tests/core/engine/engine_fixture.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::HasSubstr;

class UploadTest : public EngineTest {
 protected:
  void SetUp() override { MakeMap(); }

  PointCloud PointsOf(const ScanId& id) {
    PointCloud all;
    STRATA_EXPECT_OK(db().scans().GetPoints({}, kMapName, id, [&](const PointCloud& piece) {
      EXPECT_LE(piece.size(), api::kMaxPointsPerChunk);
      all.points.insert(all.points.end(), piece.points.begin(), piece.points.end());
      all.intensity.insert(all.intensity.end(), piece.intensity.begin(), piece.intensity.end());
      all.colour.insert(all.colour.end(), piece.colour.begin(), piece.colour.end());
      all.label.insert(all.label.end(), piece.label.begin(), piece.label.end());
      return absl::OkStatus();
    }));
    return all;
  }
};

TEST_F(UploadTest, PointsComeBackAsSent) {
  PointCloud cloud = MakeRoom(1, 95'000);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    cloud.intensity.push_back(static_cast<float>(i) * 0.25F);
    cloud.colour.push_back({static_cast<std::uint8_t>(i), 2, 3});
    cloud.label.push_back(static_cast<std::uint16_t>(i % 7));
  }
  const ScanId id{"run", 1};
  STRATA_ASSERT_OK_AND_ASSIGN(const ScanAck ack,
                              Upload(db(), HeaderOf(id, cloud, PoseAt(1, 2)), cloud, 7777));
  EXPECT_FALSE(ack.already_present);
  const PointCloud back = PointsOf(id);
  EXPECT_EQ(back.points, cloud.points);
  EXPECT_EQ(back.intensity, cloud.intensity);
  EXPECT_EQ(back.colour, cloud.colour);
  EXPECT_EQ(back.label, cloud.label);
}

TEST_F(UploadTest, SameScanAgainChangesNothingHoweverItIsCut) {
  const PointCloud cloud = MakeRoom(1, 5000);
  const ScanHeader header = HeaderOf({"run", 1}, cloud, PoseAt(0, 0));
  STRATA_ASSERT_OK_AND_ASSIGN(const ScanAck first, Upload(db(), header, cloud, 5000));
  STRATA_ASSERT_OK_AND_ASSIGN(const ScanAck again, Upload(db(), header, cloud, 123));
  EXPECT_TRUE(again.already_present);
  EXPECT_EQ(again.commit_sequence, first.commit_sequence);
  EXPECT_EQ(WaitIntegrated(db()).scans, 1U);
}

TEST_F(UploadTest, OtherContentUnderTheSameIdIsRefused) {
  PointCloud cloud = MakeRoom(1, 500);
  const ScanHeader header = HeaderOf({"run", 1}, cloud, PoseAt(0, 0));
  STRATA_ASSERT_OK(Upload(db(), header, cloud));
  cloud.points[250].z() += 0.5F;
  EXPECT_THAT(Upload(db(), header, cloud),
              StatusIs(absl::StatusCode::kAlreadyExists, HasSubstr("run/1")));
  ScanHeader moved = header;
  moved.T_map_scan.translation().x() += 1.0;
  cloud.points[250].z() -= 0.5F;
  EXPECT_THAT(Upload(db(), moved, cloud),
              StatusIs(absl::StatusCode::kAlreadyExists, HasSubstr("run/1")));
}

TEST_F(UploadTest, ThePosesLastBitsAreNoOtherContent) {
  const PointCloud cloud = MakeRoom(1, 500);
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> angle(-3.2, 3.2);
  std::vector<Eigen::Quaterniond> rotations = {
      Eigen::Quaterniond::Identity(),
      Eigen::Quaterniond(0, 0, 0, 1),
      Eigen::Quaterniond(0, 1, 0, 0),
      Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d(0.6, 0.0, -0.8)))};
  for (int i = 0; i < 20; ++i) {
    rotations.emplace_back(Eigen::AngleAxisd(angle(random), Eigen::Vector3d::UnitZ()) *
                           Eigen::AngleAxisd(angle(random), Eigen::Vector3d::UnitX()));
  }
  for (std::size_t i = 0; i < rotations.size(); ++i) {
    ScanHeader header = HeaderOf({"run", i}, cloud, MakePose(rotations[i], {512'345.67, -7.1, 3}));
    STRATA_ASSERT_OK(Upload(db(), header, cloud));
    // As a wire does it, and as one whose quaternions have the other sign.
    for (const double sign : {1.0, -1.0}) {
      Eigen::Quaterniond q(header.T_map_scan.linear());
      q.coeffs() *= sign;
      header.T_map_scan.linear() = q.normalized().toRotationMatrix();
      STRATA_ASSERT_OK_AND_ASSIGN(const ScanAck again, Upload(db(), header, cloud));
      EXPECT_TRUE(again.already_present) << i;
    }
    header.T_map_scan.rotate(Eigen::AngleAxisd(1e-7, Eigen::Vector3d(1, 2, 2) / 3.0));
    EXPECT_THAT(Upload(db(), header, cloud),
                StatusIs(absl::StatusCode::kAlreadyExists, HasSubstr("run/")));
  }
}

TEST_F(UploadTest, BadPointsAreNamed) {
  PointCloud cloud = MakeRoom(1, 100);
  cloud.points[42].y() = std::numeric_limits<float>::infinity();
  EXPECT_THAT(Upload(db(), HeaderOf({"run", 1}, cloud, PoseAt(0, 0)), cloud, 30),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("point 42")));
  cloud.points[42] = Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN());
  EXPECT_THAT(Upload(db(), HeaderOf({"run", 1}, cloud, PoseAt(0, 0)), cloud),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("point 42")));
  cloud.rows = 10;
  cloud.columns = 10;
  STRATA_EXPECT_OK(Upload(db(), HeaderOf({"run", 1}, cloud, PoseAt(0, 0)), cloud));
}

TEST_F(UploadTest, CountAndColumnsMustMatchTheHeader) {
  const PointCloud cloud = MakeRoom(1, 100);
  ScanHeader header = HeaderOf({"run", 1}, cloud, PoseAt(0, 0));
  header.point_count = 101;
  EXPECT_THAT(Upload(db(), header, cloud),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("announced 101")));
  header.point_count = 99;
  EXPECT_THAT(Upload(db(), header, cloud),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("announced 99")));
  header.point_count = 100;
  header.has_intensity = true;
  EXPECT_THAT(Upload(db(), header, cloud),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("intensity")));
}

TEST_F(UploadTest, AbandonedUploadLeavesNoTrace) {
  const PointCloud cloud = MakeRoom(1, 40'000);
  ScanHeader header = HeaderOf({"run", 1}, cloud, PoseAt(0, 0));
  header.point_count = 400'000;
  {
    STRATA_ASSERT_OK_AND_ASSIGN(const std::unique_ptr<api::ScanUpload> upload,
                                db().scans().Upload({}, kMapName, header));
    for (int i = 0; i < 9; ++i) STRATA_ASSERT_OK(upload->Write(cloud));
  }
  EXPECT_THAT(db().scans().Get({}, kMapName, header.id),
              StatusIs(absl::StatusCode::kNotFound, HasSubstr("run/1")));
  header.point_count = cloud.size();
  STRATA_EXPECT_OK(Upload(db(), header, cloud, 40'000));
}

TEST_F(UploadTest, LimitsAreTold) {
  EngineOptions options = Options();
  options.max_points_per_scan = 1000;
  Reopen(options);
  const PointCloud cloud = MakeRoom(1, 1001);
  EXPECT_THAT(Upload(db(), HeaderOf({"run", 1}, cloud, PoseAt(0, 0)), cloud),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("at most 1000, split it")));
}

TEST_F(UploadTest, CancelledCallEnds) {
  const PointCloud cloud = MakeRoom(1, 100);
  api::Call call;
  STRATA_ASSERT_OK_AND_ASSIGN(
      const std::unique_ptr<api::ScanUpload> upload,
      db().scans().Upload(call, kMapName, HeaderOf({"run", 1}, cloud, PoseAt(0, 0))));
  call.stop.Request();
  EXPECT_THAT(upload->Write(cloud), StatusIs(absl::StatusCode::kCancelled, HasSubstr("")));
}

TEST_F(UploadTest, UploadStateTellsTheLastSequence) {
  UploadRoom(3, PoseAt(0, 0));
  UploadRoom(9, PoseAt(0, 0));
  STRATA_ASSERT_OK_AND_ASSIGN(const UploadState state,
                              db().scans().GetUploadState({}, kMapName, "run"));
  EXPECT_TRUE(state.exists);
  EXPECT_EQ(state.last_sequence, 9U);
  EXPECT_EQ(state.scans, 2U);
  STRATA_ASSERT_OK_AND_ASSIGN(const UploadState none,
                              db().scans().GetUploadState({}, kMapName, "other"));
  EXPECT_FALSE(none.exists);
}

TEST_F(UploadTest, ListFiltersInCommitOrder) {
  UploadRoom(2, PoseAt(0, 0));
  UploadRoom(1, PoseAt(100, 0));
  UploadRoom(7, PoseAt(200, 0));
  WaitIntegrated(db());
  const auto list = [&](const api::ScanFilter& filter) {
    std::vector<std::uint64_t> sequences;
    STRATA_EXPECT_OK(db().scans().List({}, kMapName, filter, [&](const ScanInfo& info) {
      sequences.push_back(info.header.id.sequence);
      return absl::OkStatus();
    }));
    return sequences;
  };
  EXPECT_THAT(list({}), ::testing::ElementsAre(2, 1, 7));
  api::ScanFilter near;
  near.box = Eigen::AlignedBox2d(Eigen::Vector2d(90, -1), Eigen::Vector2d(120, 1));
  EXPECT_THAT(list(near), ::testing::ElementsAre(1));
  api::ScanFilter early;
  early.until = absl::FromUnixSeconds(1'600'000'007);
  EXPECT_THAT(list(early), ::testing::ElementsAre(2, 1));
  api::ScanFilter pending;
  pending.state = ScanState::kPending;
  EXPECT_THAT(list(pending), ::testing::ElementsAre());
  api::ScanFilter stranger;
  stranger.trajectory = "stranger";
  EXPECT_THAT(list(stranger), ::testing::ElementsAre());
}

}  // namespace
}  // namespace strata::testing
