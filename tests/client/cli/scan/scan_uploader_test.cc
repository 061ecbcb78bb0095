#include "client/cli/scan/scan_uploader.h"

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/common/retry_delay.h"
#include "tests/client/cli/scan/fake_scans.h"
#include "tests/support/status_matchers.h"

namespace strata::cli {
namespace {

using ::strata::testing::StatusIs;
using ::testing::HasSubstr;

PointCloud CloudOf(std::size_t points) {
  PointCloud cloud;
  for (std::size_t i = 0; i < points; ++i) {
    cloud.points.emplace_back(static_cast<float>(i), 1.0F, 2.0F);
  }
  return cloud;
}

std::vector<UploadSource> Sources(int count) {
  std::vector<UploadSource> sources;
  for (int i = 0; i < count; ++i) {
    UploadSource source;
    source.file = "scan" + std::to_string(i);
    source.header.id = {"robot", static_cast<std::uint64_t>(i)};
    // Later scans are smaller and therefore ready earlier.
    source.read = [=]() -> absl::StatusOr<PointCloud> {
      return CloudOf(static_cast<std::size_t>(1000 * (count - i)));
    };
    sources.push_back(source);
  }
  return sources;
}

std::vector<UploadResult> UploadAll(FakeDatabase& database,
                                    const std::vector<UploadSource>& sources) {
  return UploadScans(database, {}, "map", sources, 4, [](const UploadProgress&) {});
}

TEST(ScanUploaderTest, CommitsInOrderThoughLaterScansAreReadyEarlier) {
  FakeDatabase database;
  const auto results = UploadAll(database, Sources(40));
  ASSERT_EQ(database.fake_scans.finished.size(), 40U);
  for (std::size_t i = 0; i < 40; ++i) {
    STRATA_EXPECT_OK(results[i].status);
    EXPECT_EQ(results[i].points, 1000 * (40 - i));
    EXPECT_EQ(database.fake_scans.finished[i].first.id.sequence, i);
    EXPECT_EQ(database.fake_scans.finished[i].first.point_count, 1000 * (40 - i));
    EXPECT_EQ(database.fake_scans.finished[i].second, 1000 * (40 - i));
  }
}

TEST(ScanUploaderTest, LargeScansGoInPiecesOfTheAllowedSize) {
  FakeDatabase database;
  std::vector<UploadSource> sources = Sources(1);
  sources[0].read = []() -> absl::StatusOr<PointCloud> { return CloudOf(100'001); };
  STRATA_ASSERT_OK(UploadAll(database, sources)[0].status);
  EXPECT_EQ(database.fake_scans.largest_chunk, api::kMaxPointsPerChunk);
  EXPECT_EQ(database.fake_scans.finished[0].second, 100'001U);
}

TEST(ScanUploaderTest, HeaderSaysWhatTheCloudHasAndTheOriginGoesIntoThePose) {
  FakeDatabase database;
  std::vector<UploadSource> sources = Sources(1);
  sources[0].header.T_map_scan = MakePose(
      Eigen::Quaterniond(Eigen::AngleAxisd(0.5 * M_PI, Eigen::Vector3d::UnitZ())), {1, 2, 3});
  sources[0].read = []() -> absl::StatusOr<PointCloud> {
    PointCloud cloud = CloudOf(6);
    cloud.rows = 2;
    cloud.columns = 3;
    cloud.intensity.assign(6, 0.5F);
    cloud.origin = {100, 0, 0};
    cloud.sensor_origin = {0, 0, 1};
    return cloud;
  };
  STRATA_ASSERT_OK(UploadAll(database, sources)[0].status);
  const ScanHeader& header = database.fake_scans.finished[0].first;
  EXPECT_EQ(header.rows, 2U);
  EXPECT_EQ(header.columns, 3U);
  EXPECT_TRUE(header.has_intensity);
  EXPECT_FALSE(header.has_colour);
  EXPECT_TRUE(header.T_map_scan.translation().isApprox(Eigen::Vector3d(1, 102, 3)));
  EXPECT_EQ(header.sensor_origin, Eigen::Vector3f(0, 0, 1));
}

TEST(ScanUploaderTest, ABadFileIsReportedAndTheRestGoesOn) {
  FakeDatabase database;
  std::vector<UploadSource> sources = Sources(5);
  sources[2].read = []() -> absl::StatusOr<PointCloud> {
    return absl::InvalidArgumentError("scan2: byte 40: expected more points");
  };
  const auto results = UploadAll(database, sources);
  EXPECT_THAT(results[2].status,
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("byte 40")));
  EXPECT_EQ(database.fake_scans.finished.size(), 4U);
  STRATA_EXPECT_OK(results[4].status);
}

TEST(ScanUploaderTest, ABusyServerIsTriedAgainAndTheOrderKept) {
  FakeDatabase database;
  const absl::Status full = absl::ResourceExhaustedError("queue full");
  database.fake_scans.troubles[3] = {WithRetryDelay(full, absl::Milliseconds(1)),
                                     absl::UnavailableError("gone"),
                                     absl::AbortedError("broke off; begin it again")};
  for (const UploadResult& result : UploadAll(database, Sources(8))) {
    STRATA_EXPECT_OK(result.status);
  }
  ASSERT_EQ(database.fake_scans.finished.size(), 8U);
  EXPECT_EQ(database.fake_scans.finished[3].first.id.sequence, 3U);
}

TEST(ScanUploaderTest, AnErrorThatLastsIsNotTriedAgain) {
  FakeDatabase database;
  database.fake_scans.troubles[1] = {absl::AlreadyExistsError("other content")};
  database.fake_scans.troubles[2] = {absl::ResourceExhaustedError("the disk is full")};
  const auto results = UploadAll(database, Sources(4));
  EXPECT_THAT(results[1].status,
              StatusIs(absl::StatusCode::kAlreadyExists, HasSubstr("other content")));
  EXPECT_THAT(results[2].status,
              StatusIs(absl::StatusCode::kResourceExhausted, HasSubstr("the disk is full")));
  EXPECT_EQ(database.fake_scans.finished.size(), 2U);
}

TEST(ScanUploaderTest, WhoHasNoRightIsToldOnceAndSendsNoMore) {
  FakeDatabase database;
  database.fake_scans.troubles[1] = {absl::PermissionDeniedError("needs the right to write")};
  const auto results = UploadAll(database, Sources(20));
  for (std::size_t i = 1; i < results.size(); ++i) {
    EXPECT_THAT(results[i].status,
                StatusIs(absl::StatusCode::kPermissionDenied, HasSubstr("right")));
  }
  EXPECT_EQ(database.fake_scans.finished.size(), 1U);
}

TEST(ScanUploaderTest, AStopEndsTheUploads) {
  FakeDatabase database;
  const api::Call call;
  call.stop.Request();
  for (const UploadResult& result :
       UploadScans(database, call, "map", Sources(5), 2, [](const UploadProgress&) {})) {
    EXPECT_THAT(result.status, StatusIs(absl::StatusCode::kCancelled, HasSubstr("")));
  }
  EXPECT_TRUE(database.fake_scans.finished.empty());
}

}  // namespace
}  // namespace strata::cli
