#include "tests/support/database_suite/database_suite.h"

#include <algorithm>
#include <limits>
#include <ostream>
#include <type_traits>
#include <vector>

#include "absl/time/clock.h"
#include <gmock/gmock.h>

#include "core/common/status.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {

void PrintTo(const DatabaseMaker& maker, std::ostream* out) { *out << maker.name; }

std::string DatabaseMakerName(const ::testing::TestParamInfo<DatabaseMaker>& info) {
  return info.param.name;
}

void DatabaseSuite::Reopen() {
  database_.reset();
  database_ = GetParam().make(directory_.path());
  ASSERT_NE(database_, nullptr);
}

void DatabaseSuite::SetUp() {
  database_ = GetParam().make(directory_.path());
  ASSERT_NE(database_, nullptr);
  STRATA_ASSERT_OK(db().maps().Create({}, kMap, {}));
}

PointCloud LevelFloor(double side_m) {
  constexpr double kSpacingM = 0.05;
  const int steps = static_cast<int>(side_m / kSpacingM);
  PointCloud cloud;
  for (int y = 0; y < steps; ++y) {
    for (int x = 0; x < steps; ++x) {
      cloud.points.emplace_back(static_cast<float>((x + 0.5) * kSpacingM - side_m / 2),
                                static_cast<float>((y + 0.5) * kSpacingM - side_m / 2),
                                0.0F);
    }
  }
  return cloud;
}

ScanHeader FloorHeader(const ScanId& id, const PointCloud& cloud, double x_m) {
  ScanHeader header;
  header.id = id;
  header.time = absl::FromUnixSeconds(1000 + static_cast<std::int64_t>(id.sequence));
  header.T_map_scan = MakePose(Eigen::Quaterniond::Identity(), {x_m, 0.0, 0.0});
  header.sensor_origin = Eigen::Vector3f(0.0F, 0.0F, 1.0F);
  header.alignment = Alignment::kOff;
  header.point_count = cloud.size();
  header.has_intensity = !cloud.intensity.empty();
  header.has_colour = !cloud.colour.empty();
  header.has_label = !cloud.label.empty();
  return header;
}

absl::StatusOr<ScanAck> UploadScan(api::Database& database,
                                   const std::string& map,
                                   const ScanHeader& header,
                                   const PointCloud& cloud) {
  constexpr std::size_t kPiece = 10'000;
  STRATA_ASSIGN_OR_RETURN(const std::unique_ptr<api::ScanUpload> upload,
                          database.scans().Upload({}, map, header));
  for (std::size_t begin = 0; begin < cloud.size(); begin += kPiece) {
    const std::size_t end = std::min(cloud.size(), begin + kPiece);
    STRATA_RETURN_IF_ERROR(upload->Write(Slice(cloud, begin, end)));
  }
  return upload->Finish();
}

void AwaitIntegration(api::Database& database, const std::string& map) {
  while (true) {
    STRATA_ASSERT_OK_AND_ASSIGN(const MapStats stats, database.maps().Stats({}, map));
    if (stats.scans_pending == 0) return;
    absl::SleepFor(absl::Milliseconds(5));
  }
}

PointCloud Slice(const PointCloud& cloud, std::size_t begin, std::size_t end) {
  const auto part = [begin, end](const auto& column) {
    using Column = std::decay_t<decltype(column)>;
    const auto first = column.begin();
    return column.empty() ? Column()
                          : Column(first + static_cast<std::ptrdiff_t>(begin),
                                   first + static_cast<std::ptrdiff_t>(end));
  };
  PointCloud slice;
  slice.points = part(cloud.points);
  slice.intensity = part(cloud.intensity);
  slice.colour = part(cloud.colour);
  slice.label = part(cloud.label);
  return slice;
}

std::vector<ScanId> Listed(api::Database& db, const api::ScanFilter& filter) {
  std::vector<ScanId> ids;
  STRATA_EXPECT_OK(db.scans().List({}, kMap, filter, [&ids](const ScanInfo& scan) {
    ids.push_back(scan.header.id);
    return absl::OkStatus();
  }));
  return ids;
}

const Pose& NanPose() {
  static const Pose pose = [] {
    Pose T = Pose::Identity();
    T.translation().x() = std::numeric_limits<double>::quiet_NaN();
    return T;
  }();
  return pose;
}

void PutFloor(api::Database& db, const ScanId& id, double x_m) {
  const PointCloud floor = LevelFloor();
  STRATA_ASSERT_OK(UploadScan(db, kMap, FloorHeader(id, floor, x_m), floor));
  AwaitIntegration(db, kMap);
}

JobInfo EndOfJob(api::Database& database,
                 const std::string& kind,
                 const JobParameters& parameters,
                 const std::string& map) {
  JobInfo last;
  const absl::StatusOr<JobInfo> job = database.jobs().Start({}, map, kind, parameters);
  STRATA_EXPECT_OK(job);
  if (!job.ok()) return last;
  STRATA_EXPECT_OK(database.jobs().Watch({}, map, job->id, [&last](const JobInfo& now) {
    last = now;
    return absl::OkStatus();
  }));
  return last;
}

}  // namespace strata::testing
