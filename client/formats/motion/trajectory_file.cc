#include "client/formats/motion/trajectory_file.h"

#include <cmath>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "absl/strings/string_view.h"
#include <Eigen/Geometry>

#include "client/formats/motion/csv_columns.h"
#include "client/formats/parsing/text_cursor.h"
#include "core/common/status.h"

namespace strata {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;
constexpr absl::string_view kOrigin = "# origin ";
constexpr std::size_t kPoseColumns = 8;
constexpr double kUnitTolerance = 0.01;

std::vector<std::string> Columns() {
  std::vector<std::string> columns = {"time", "x", "y", "z", "qx", "qy", "qz", "qw"};
  for (int i = 0; i < 6; ++i) {
    for (int k = 0; k < 6; ++k) columns.push_back(absl::StrCat("c", i, k));
  }
  return columns;
}

void AppendPose(std::string& text, const TrajectoryPose& pose) {
  Eigen::Quaterniond q(pose.T_map_body.linear());
  if (q.w() < 0.0) q.coeffs() *= -1.0;
  const Eigen::Vector3d t = pose.T_map_body.translation();
  absl::StrAppendFormat(&text,
                        "%.6f,%.6f,%.6f,%.6f,%.12f,%.12f,%.12f,%.12f",
                        pose.time_s,
                        t.x(),
                        t.y(),
                        t.z(),
                        q.x(),
                        q.y(),
                        q.z(),
                        q.w());
  for (int i = 0; i < 6; ++i) {
    for (int k = 0; k < 6; ++k) absl::StrAppendFormat(&text, ",%.9g", pose.covariance(i, k));
  }
  text += '\n';
}

// The origin in the comments before the names.
absl::StatusOr<std::optional<GeodeticOrigin>> OriginOf(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::string line;
  while (std::getline(file, line) && absl::StartsWith(line, "#")) {
    if (!absl::StartsWith(line, kOrigin)) continue;
    const auto words = SplitWords(absl::string_view(line).substr(kOrigin.size()));
    std::vector<double> numbers;
    for (const absl::string_view word : words) {
      const std::optional<double> number = ParseNumber(word);
      if (number.has_value() && std::isfinite(*number)) numbers.push_back(*number);
    }
    if (words.size() != 3 || numbers.size() != 3 || std::abs(numbers[0]) > 90.0) {
      return absl::InvalidArgumentError(absl::StrCat(
          path.string(), ": expected '# origin LATITUDE LONGITUDE ALTITUDE', got '", line, "'"));
    }
    return GeodeticOrigin{numbers[0] / kDegrees, numbers[1] / kDegrees, numbers[2]};
  }
  return std::nullopt;
}

absl::StatusOr<TrajectoryPose> PoseOfRow(const std::vector<double>& row) {
  const Eigen::Quaterniond q(row[7], row[4], row[5], row[6]);
  if (std::abs(q.norm() - 1.0) > kUnitTolerance) {
    return absl::InvalidArgumentError(
        absl::StrFormat("time %.6f: the quaternion has length %.3f, must be 1", row[0], q.norm()));
  }
  TrajectoryPose pose;
  pose.time_s = row[0];
  pose.T_map_body = MakePose(q, {row[1], row[2], row[3]});
  for (std::size_t i = 0; i < 36; ++i) {
    pose.covariance(static_cast<int>(i / 6), static_cast<int>(i % 6)) = row[kPoseColumns + i];
  }
  return pose;
}

}  // namespace

std::string TrajectoryText(const TrajectoryFile& file) {
  std::string text;
  if (file.origin.has_value()) {
    absl::StrAppendFormat(&text,
                          "%s%.9f %.9f %.3f\n",
                          kOrigin,
                          file.origin->latitude_rad * kDegrees,
                          file.origin->longitude_rad * kDegrees,
                          file.origin->altitude_m);
  }
  absl::StrAppend(&text, absl::StrJoin(Columns(), ","), "\n");
  for (const TrajectoryPose& pose : file.trajectory.poses()) AppendPose(text, pose);
  return text;
}

absl::StatusOr<TrajectoryFile> ReadTrajectory(const std::filesystem::path& path) {
  const std::vector<std::string> names = Columns();
  STRATA_ASSIGN_OR_RETURN(const auto rows, ReadCsvColumns(path, {names.begin(), names.end()}));
  STRATA_ASSIGN_OR_RETURN(const std::optional<GeodeticOrigin> origin, OriginOf(path));
  std::vector<TrajectoryPose> poses;
  for (const std::vector<double>& row : rows) {
    absl::StatusOr<TrajectoryPose> pose = PoseOfRow(row);
    if (!pose.ok()) return Annotate(pose.status(), path.string());
    poses.push_back(*std::move(pose));
  }
  absl::StatusOr<Trajectory> trajectory = Trajectory::Make(std::move(poses));
  if (!trajectory.ok()) return Annotate(trajectory.status(), path.string());
  return TrajectoryFile{*std::move(trajectory), origin};
}

}  // namespace strata
