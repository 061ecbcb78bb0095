// Conformance: scans.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/codec/local_map_codec.h"
#include "core/common/status.h"
#include "core/mls/build.h"
#include "core/world/scan_hash.h"
#include "tests/support/database_suite/database_suite.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::_;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using Code = absl::StatusCode;

PointCloud ColouredCloud(std::size_t points) {
  PointCloud cloud = LevelFloor();
  cloud = Slice(cloud, 0, points);
  for (std::size_t i = 0; i < points; ++i) {
    cloud.intensity.push_back(0.5F * static_cast<float>(i));
    cloud.colour.push_back({static_cast<std::uint8_t>(i), static_cast<std::uint8_t>(i >> 8U), 7});
    cloud.label.push_back(static_cast<std::uint16_t>(i % 3));
  }
  return cloud;
}

TEST_P(DatabaseSuite, AScanComesBackAsSent) {
  const PointCloud cloud = ColouredCloud(25'000);
  ScanHeader header = FloorHeader({"run", 7}, cloud);
  header.T_map_scan = MakePose(Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitZ())),
                               {1.0, -2.0, 0.5});
  header.sensor = SensorModel{.sigma_m = 0.02, .max_range_m = 80.0};
  STRATA_ASSERT_OK_AND_ASSIGN(const ScanAck ack, UploadScan(db(), kMap, header, cloud));
  EXPECT_EQ(ack.id, header.id);
  EXPECT_FALSE(ack.already_present);

  STRATA_ASSERT_OK_AND_ASSIGN(const ScanInfo scan, db().scans().Get({}, kMap, header.id));
  EXPECT_TRUE(scan.header.T_map_scan.isApprox(header.T_map_scan, 1e-14));
  EXPECT_EQ(scan.header.time, header.time);
  EXPECT_EQ(scan.header.sensor, header.sensor);
  EXPECT_EQ(scan.header.sensor_origin, header.sensor_origin);
  EXPECT_EQ(scan.header.alignment, Alignment::kOff);
  EXPECT_EQ(scan.header.point_count, cloud.size());
  EXPECT_EQ(scan.commit_sequence, ack.commit_sequence);

  PointCloud back;
  const auto append = [](auto& to, const auto& from) {
    to.insert(to.end(), from.begin(), from.end());
  };
  STRATA_ASSERT_OK(db().scans().GetPoints({}, kMap, header.id, [&](const PointCloud& piece) {
    EXPECT_LE(piece.size(), api::kMaxPointsPerChunk);
    append(back.points, piece.points);
    append(back.intensity, piece.intensity);
    append(back.colour, piece.colour);
    append(back.label, piece.label);
    return absl::OkStatus();
  }));
  EXPECT_EQ(back.points, cloud.points);
  EXPECT_EQ(back.intensity, cloud.intensity);
  EXPECT_EQ(back.colour, cloud.colour);
  EXPECT_EQ(back.label, cloud.label);
}

TEST_P(DatabaseSuite, TheSameScanAgainChangesNothingAndAnotherIsRefused) {
  const PointCloud floor = LevelFloor(1.0);
  const ScanHeader header = FloorHeader({"run", 1}, floor);
  STRATA_ASSERT_OK_AND_ASSIGN(const ScanAck first, UploadScan(db(), kMap, header, floor));
  STRATA_ASSERT_OK_AND_ASSIGN(const ScanAck again, UploadScan(db(), kMap, header, floor));
  EXPECT_TRUE(again.already_present);
  EXPECT_EQ(again.commit_sequence, first.commit_sequence);
  PointCloud other = floor;
  other.points[17].z() += 0.01F;
  EXPECT_THAT(UploadScan(db(), kMap, header, other),
              StatusIs(Code::kAlreadyExists, HasSubstr("run/1")));
  EXPECT_THAT(Listed(db(), {}), ElementsAre(ScanId{"run", 1}));
}

TEST_P(DatabaseSuite, BadUploadsAreRefusedWithoutATrace) {
  const PointCloud floor = LevelFloor(1.0);
  const ScanHeader header = FloorHeader({"run", 1}, floor);
  const auto invalid = [](const char* message) {
    return StatusIs(Code::kInvalidArgument, HasSubstr(message));
  };
  ScanHeader bad = header;
  bad.T_map_scan = NanPose();
  EXPECT_THAT(db().scans().Upload({}, kMap, bad).status(), invalid("run/1"));
  bad = header;
  bad.id.trajectory = "a b";
  EXPECT_THAT(db().scans().Upload({}, kMap, bad).status(), invalid("a b"));

  const auto written = [&](const PointCloud& cloud) -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(const std::unique_ptr<api::ScanUpload> upload,
                            db().scans().Upload({}, kMap, header));
    return upload->Write(cloud);
  };
  PointCloud cloud = floor;
  cloud.points[3].y() = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(written(cloud), invalid("point 3"));
  cloud = floor;
  cloud.label.assign(cloud.size(), 1);
  EXPECT_THAT(written(cloud), invalid("label"));
  cloud = floor;
  cloud.points.push_back(cloud.points.front());
  EXPECT_THAT(written(cloud), StatusIs(Code::kInvalidArgument, _));
  cloud.points.resize(api::kMaxPointsPerChunk + 1);
  EXPECT_THAT(written(cloud), StatusIs(Code::kInvalidArgument, _));
  cloud = floor;
  cloud.points.pop_back();
  EXPECT_THAT(UploadScan(db(), kMap, header, cloud), StatusIs(Code::kInvalidArgument, _));
  EXPECT_THAT(Listed(db(), {}), IsEmpty());
}

TEST_P(DatabaseSuite, AnAbandonedUploadLeavesNoTrace) {
  const PointCloud floor = LevelFloor(1.0);
  const ScanHeader header = FloorHeader({"run", 1}, floor);
  {
    STRATA_ASSERT_OK_AND_ASSIGN(auto upload, db().scans().Upload({}, kMap, header));
    STRATA_ASSERT_OK(upload->Write(floor));
  }
  EXPECT_THAT(db().scans().Get({}, kMap, header.id), StatusIs(Code::kNotFound, HasSubstr("run/1")));
  STRATA_ASSERT_OK_AND_ASSIGN(const ScanAck ack, UploadScan(db(), kMap, header, floor));
  EXPECT_FALSE(ack.already_present);
}

// Those of the upload's points that it does not hold, up to `end`.
absl::Status WriteRest(api::ScanUpload& upload, const PointCloud& cloud, std::size_t end) {
  constexpr std::size_t kPiece = 777;
  for (std::size_t begin = upload.points_held(); begin < end; begin += kPiece) {
    STRATA_RETURN_IF_ERROR(upload.Write(Slice(cloud, begin, std::min(end, begin + kPiece))));
  }
  return absl::OkStatus();
}

TEST_P(DatabaseSuite, AnAnnouncedUploadGoesOnWhereItBroke) {
  const PointCloud cloud = ColouredCloud(9'000);
  ScanHeader header = FloorHeader({"run", 1}, cloud);
  header.content_hash = ContentHashOf(header, cloud);
  for (const std::size_t end : {0, 1, 2'500, 5'001}) {
    STRATA_ASSERT_OK_AND_ASSIGN(auto upload, db().scans().Upload({}, kMap, header));
    STRATA_ASSERT_OK(WriteRest(*upload, cloud, end));
    upload = nullptr;
    STRATA_ASSERT_OK_AND_ASSIGN(upload, db().scans().Upload({}, kMap, header));
    EXPECT_EQ(upload->points_held(), end);
  }
  STRATA_ASSERT_OK_AND_ASSIGN(auto upload, db().scans().Upload({}, kMap, header));
  STRATA_ASSERT_OK(WriteRest(*upload, cloud, cloud.size()));
  STRATA_ASSERT_OK_AND_ASSIGN(const ScanAck ack, upload->Finish());
  EXPECT_FALSE(ack.already_present);
  EXPECT_EQ(ack.content_hash, header.content_hash);
  STRATA_ASSERT_OK_AND_ASSIGN(const ScanInfo scan, db().scans().Get({}, kMap, header.id));
  EXPECT_EQ(scan.content_hash, header.content_hash);
  EXPECT_THAT(scan.header.content_hash, IsEmpty());
  std::vector<float> intensity;
  STRATA_ASSERT_OK(db().scans().GetPoints({}, kMap, header.id, [&](const PointCloud& piece) {
    intensity.insert(intensity.end(), piece.intensity.begin(), piece.intensity.end());
    return absl::OkStatus();
  }));
  EXPECT_EQ(intensity, cloud.intensity);
}

TEST_P(DatabaseSuite, AnAnnouncedScanThatIsThereNeedsNoPoints) {
  const PointCloud floor = LevelFloor(1.0);
  ScanHeader header = FloorHeader({"run", 1}, floor);
  STRATA_ASSERT_OK_AND_ASSIGN(const ScanAck first, UploadScan(db(), kMap, header, floor));
  header.content_hash = first.content_hash;
  EXPECT_EQ(header.content_hash, ContentHashOf(header, floor));
  STRATA_ASSERT_OK_AND_ASSIGN(auto upload, db().scans().Upload({}, kMap, header));
  EXPECT_EQ(upload->points_held(), floor.size());
  STRATA_ASSERT_OK_AND_ASSIGN(const ScanAck again, upload->Finish());
  EXPECT_TRUE(again.already_present);
  EXPECT_EQ(again.commit_sequence, first.commit_sequence);
  header.content_hash = std::string(32, '0');
  EXPECT_THAT(db().scans().Upload({}, kMap, header).status(),
              StatusIs(Code::kAlreadyExists, HasSubstr("run/1")));
}

TEST_P(DatabaseSuite, AnUploadWithAnotherHashThanAnnouncedLeavesNoTrace) {
  const PointCloud floor = LevelFloor(1.0);
  ScanHeader header = FloorHeader({"run", 1}, floor);
  header.content_hash = "not a hash";
  EXPECT_THAT(db().scans().Upload({}, kMap, header).status(),
              StatusIs(Code::kInvalidArgument, HasSubstr("'not a hash'")));
  header.content_hash = std::string(32, 'a');
  EXPECT_THAT(UploadScan(db(), kMap, header, floor),
              StatusIs(Code::kInvalidArgument, HasSubstr("announced aaaa")));
  EXPECT_THAT(Listed(db(), {}), IsEmpty());
  STRATA_ASSERT_OK_AND_ASSIGN(auto upload, db().scans().Upload({}, kMap, header));
  EXPECT_EQ(upload->points_held(), 0U);
}

TEST_P(DatabaseSuite, TheLaterOfTwoUploadsOfAnAnnouncedScanTakesOver) {
  const PointCloud floor = LevelFloor(2.0);
  ScanHeader header = FloorHeader({"run", 1}, floor);
  header.content_hash = ContentHashOf(header, floor);
  STRATA_ASSERT_OK_AND_ASSIGN(auto first, db().scans().Upload({}, kMap, header));
  STRATA_ASSERT_OK(WriteRest(*first, floor, 1'000));
  STRATA_ASSERT_OK_AND_ASSIGN(auto second, db().scans().Upload({}, kMap, header));
  STRATA_ASSERT_OK(WriteRest(*second, floor, floor.size()));
  STRATA_ASSERT_OK(second->Finish());
  // Over a wire the first may learn of it with its next points or at its end.
  absl::Status last = first->Write(Slice(floor, 1'000, floor.size()));
  if (last.ok()) last = first->Finish().status();
  EXPECT_THAT(last, StatusIs(Code::kAborted, HasSubstr("taken over")));
  EXPECT_THAT(Listed(db(), {}), ElementsAre(ScanId{"run", 1}));
}

TEST_P(DatabaseSuite, ALocalMapIsAScanWithoutPoints) {
  const PointCloud floor = LevelFloor(4.0);
  STRATA_ASSERT_OK_AND_ASSIGN(const MapInfo map, db().maps().Get({}, kMap));
  const MlsParameters mls = map.parameters.mls;
  STRATA_ASSERT_OK_AND_ASSIGN(const MlsBuildResult built,
                              BuildMlsMap(floor, Pose::Identity(), map.parameters.sensor, mls));
  STRATA_ASSERT_OK_AND_ASSIGN(const std::string bytes, EncodeLocalMap(built.map));
  ScanHeader header = FloorHeader({"run", 1}, {});
  STRATA_ASSERT_OK_AND_ASSIGN(const ScanAck ack,
                              db().scans().UploadLocalMap({}, kMap, header, mls, bytes));
  EXPECT_FALSE(ack.already_present);
  STRATA_ASSERT_OK_AND_ASSIGN(const ScanAck again,
                              db().scans().UploadLocalMap({}, kMap, header, mls, bytes));
  EXPECT_TRUE(again.already_present);
  EXPECT_EQ(again.commit_sequence, ack.commit_sequence);
  AwaitIntegration(db(), kMap);
  STRATA_ASSERT_OK_AND_ASSIGN(const ScanInfo scan, db().scans().Get({}, kMap, header.id));
  EXPECT_EQ(scan.state, ScanState::kIntegrated) << scan.message;
  STRATA_ASSERT_OK_AND_ASSIGN(const MapStats stats, db().maps().Stats({}, kMap));
  EXPECT_EQ(stats.patches, built.map.patch_count());
  EXPECT_THAT(db().scans().GetPoints(
                  {}, kMap, header.id, [](const PointCloud&) { return absl::OkStatus(); }),
              StatusIs(Code::kFailedPrecondition, HasSubstr("local map")));

  const auto refused = [&](const ScanHeader& h, const MlsParameters& p, const std::string& b) {
    return db().scans().UploadLocalMap({}, kMap, h, p, b).status();
  };
  EXPECT_THAT(refused(header, mls, *EncodeLocalMap(MlsMap{mls, {}})),
              StatusIs(Code::kAlreadyExists, HasSubstr("run/1")));
  header.id.sequence = 2;
  MlsParameters coarse = mls;
  coarse.cell_size_m *= 2;
  EXPECT_THAT(refused(header, coarse, bytes),
              StatusIs(Code::kInvalidArgument, HasSubstr("cell_size")));
  EXPECT_THAT(refused(header, mls, bytes.substr(0, bytes.size() - 1)),
              StatusIs(Code::kInvalidArgument, HasSubstr("run/2")));
  EXPECT_THAT(refused(FloorHeader({"run", 2}, floor), mls, bytes),
              StatusIs(Code::kInvalidArgument, HasSubstr("points")));
  EXPECT_THAT(Listed(db(), {}), ElementsAre(ScanId{"run", 1}));
  STRATA_ASSERT_OK(db().scans().Delete({}, kMap, {"run", 1}));
  STRATA_ASSERT_OK_AND_ASSIGN(const MapStats empty, db().maps().Stats({}, kMap));
  EXPECT_EQ(empty.patches, 0U);
}

TEST_P(DatabaseSuite, UploadsMayBeUnderWayTogether) {
  const PointCloud floor = LevelFloor(1.0);
  STRATA_ASSERT_OK_AND_ASSIGN(auto first,
                              db().scans().Upload({}, kMap, FloorHeader({"a", 1}, floor)));
  STRATA_ASSERT_OK_AND_ASSIGN(auto second,
                              db().scans().Upload({}, kMap, FloorHeader({"b", 1}, floor)));
  STRATA_EXPECT_OK(first->Write(floor));
  STRATA_EXPECT_OK(second->Write(floor));
  STRATA_EXPECT_OK(second->Finish());
  STRATA_EXPECT_OK(first->Finish());
  EXPECT_THAT(Listed(db(), {}), ElementsAre(ScanId{"b", 1}, ScanId{"a", 1}));
}

TEST_P(DatabaseSuite, TheUploadStateTellsWhereToResume) {
  STRATA_ASSERT_OK_AND_ASSIGN(UploadState state, db().scans().GetUploadState({}, kMap, "run"));
  EXPECT_FALSE(state.exists);
  const PointCloud floor = LevelFloor(0.5);
  for (const std::uint64_t sequence : {3, 9}) {
    STRATA_ASSERT_OK(UploadScan(db(), kMap, FloorHeader({"run", sequence}, floor), floor));
  }
  STRATA_ASSERT_OK_AND_ASSIGN(state, db().scans().GetUploadState({}, kMap, "run"));
  EXPECT_TRUE(state.exists);
  EXPECT_EQ(state.last_sequence, 9U);
  EXPECT_EQ(state.scans, 2U);
}

TEST_P(DatabaseSuite, ListingsKeepTheirFilterAndTheirSinksWord) {
  const PointCloud floor = LevelFloor(1.0);
  for (const std::uint64_t sequence : {1, 2, 3}) {
    const double x_m = 10.0 * static_cast<double>(sequence);
    STRATA_ASSERT_OK(UploadScan(db(), kMap, FloorHeader({"a", sequence}, floor, x_m), floor));
  }
  STRATA_ASSERT_OK(UploadScan(db(), kMap, FloorHeader({"b", 9}, floor, 20.0), floor));
  AwaitIntegration(db(), kMap);
  api::ScanFilter filter;
  filter.trajectory = "a";
  EXPECT_THAT(Listed(db(), filter), ElementsAre(ScanId{"a", 1}, ScanId{"a", 2}, ScanId{"a", 3}));
  filter.box = Eigen::AlignedBox2d(Eigen::Vector2d(18, -1), Eigen::Vector2d(22, 1));
  EXPECT_THAT(Listed(db(), filter), ElementsAre(ScanId{"a", 2}));
  filter.trajectory.reset();
  EXPECT_THAT(Listed(db(), filter), ElementsAre(ScanId{"a", 2}, ScanId{"b", 9}));
  filter.box.reset();
  filter.from = absl::FromUnixSeconds(1002);
  filter.until = absl::FromUnixSeconds(1009);
  EXPECT_THAT(Listed(db(), filter), ElementsAre(ScanId{"a", 2}, ScanId{"a", 3}));
  filter = {};
  filter.state = ScanState::kFailed;
  EXPECT_THAT(Listed(db(), filter), IsEmpty());
  int seen = 0;
  const auto enough = [&seen](const ScanInfo&) {
    return ++seen == 2 ? absl::OutOfRangeError("enough") : absl::OkStatus();
  };
  EXPECT_THAT(db().scans().List({}, kMap, {}, enough), StatusIs(Code::kOutOfRange, "enough"));
  EXPECT_EQ(seen, 2);
}

TEST_P(DatabaseSuite, AScanSeenAsIntegratedIsInTheTiles) {
  const PointCloud floor = LevelFloor(1.0);
  for (std::uint64_t sequence = 1; sequence <= 30; ++sequence) {
    const ScanId id{"run", sequence};
    const double x_m = 3.0 * static_cast<double>(sequence);
    STRATA_ASSERT_OK(UploadScan(db(), kMap, FloorHeader(id, floor, x_m), floor));
    api::ScanFilter integrated;
    integrated.state = ScanState::kIntegrated;
    const auto seen = [&]() -> bool {
      if (sequence % 2 == 0) return Listed(db(), integrated).size() == sequence;
      const absl::StatusOr<ScanInfo> scan = db().scans().Get({}, kMap, id);
      STRATA_EXPECT_OK(scan);
      return !scan.ok() || scan->state == ScanState::kIntegrated;
    };
    while (!seen()) {
    }
    STRATA_ASSERT_OK_AND_ASSIGN(
        const auto columns, db().planning().SampleSurfaces({}, kMap, {Eigen::Vector2d(x_m, 0.0)}));
    ASSERT_THAT(columns[0].surfaces, SizeIs(1)) << id.ToString();
  }
}

TEST_P(DatabaseSuite, PointsThatDoNotReachTheMapAreCounted) {
  PointCloud floor = LevelFloor(2.0);
  for (std::size_t i = 0; i < 7; ++i) floor.points[i].x() = 2000.0F;
  STRATA_ASSERT_OK(UploadScan(db(), kMap, FloorHeader({"run", 1}, floor), floor));
  for (Eigen::Vector3f& point : floor.points) point.x() = -3000.0F;
  STRATA_ASSERT_OK(UploadScan(db(), kMap, FloorHeader({"run", 2}, floor), floor));
  AwaitIntegration(db(), kMap);
  STRATA_ASSERT_OK_AND_ASSIGN(ScanInfo scan, db().scans().Get({}, kMap, {"run", 1}));
  EXPECT_EQ(scan.state, ScanState::kIntegrated);
  EXPECT_EQ(scan.message,
            "7 of 1600 points left out: 7 not within range [0, 1000] m of the sensor at (0, 0, 1)");
  STRATA_ASSERT_OK_AND_ASSIGN(scan, db().scans().Get({}, kMap, {"run", 2}));
  EXPECT_EQ(scan.state, ScanState::kFailed);
  EXPECT_EQ(scan.message,
            "scan run/2: 0 of 1600 points within range [0, 1000] m of the sensor at (0, 0, 1); set "
            "the sensor origin or the sensor's max range");
  STRATA_ASSERT_OK_AND_ASSIGN(const MapStats stats, db().maps().Stats({}, kMap));
  EXPECT_EQ(stats.scans_failed, 1U);
}

}  // namespace
}  // namespace strata::testing
