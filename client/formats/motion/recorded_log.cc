#include "client/formats/motion/recorded_log.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <optional>
#include <system_error>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

#include "client/formats/motion/csv_columns.h"
#include "core/common/status.h"

namespace strata {
namespace {

namespace fs = std::filesystem;

constexpr double kRadians = std::numbers::pi / 180.0;
constexpr double kKmH = 1.0 / 3.6;

const std::vector<absl::string_view>& ImuColumns() {
  static const auto* const columns =
      new std::vector<absl::string_view>{"stamp", "wx", "wy", "wz", "ax", "ay", "az"};
  return *columns;
}

const std::vector<absl::string_view>& CarColumns() {
  static const auto* const columns = new std::vector<absl::string_view>{"millis",
                                                                        "ax",
                                                                        "ay",
                                                                        "az",
                                                                        "rollrate",
                                                                        "pitchrate",
                                                                        "yawrate",
                                                                        "speed",
                                                                        "latitude",
                                                                        "longitude",
                                                                        "altitude",
                                                                        "hdop",
                                                                        "vdop",
                                                                        "epe"};
  return *columns;
}

absl::StatusOr<std::vector<GpsFix>> ReadRosFixes(const fs::path& file) {
  std::vector<absl::string_view> columns = {
      "stamp", "lat", "lon", "alt", "var_e", "var_n", "var_u"};
  const bool has_status = HasColumns(CsvHeader(file), {"status"});
  if (has_status) columns.emplace_back("status");
  STRATA_ASSIGN_OR_RETURN(const auto rows, ReadCsvColumns(file, columns));
  std::vector<GpsFix> fixes;
  for (const std::vector<double>& row : rows) {
    if (has_status && row.back() < 0.0) continue;
    GpsFix fix{row[0], row[1] * kRadians, row[2] * kRadians, row[3], {}};
    fix.sigma_m = Eigen::Vector3d(row[4], row[5], row[6]).cwiseMax(0.0).cwiseSqrt();
    fixes.push_back(fix);
  }
  return fixes;
}

absl::StatusOr<std::vector<WheelSample>> ReadRosOdometry(const fs::path& file) {
  std::vector<WheelSample> wheels;
  if (!fs::exists(file)) return wheels;
  STRATA_ASSIGN_OR_RETURN(const auto rows, ReadCsvColumns(file, {"stamp", "vx", "wz"}));
  for (const std::vector<double>& row : rows) wheels.push_back({row[0], row[1], row[2]});
  return wheels;
}

absl::StatusOr<RecordedLog> ReadRosFolder(const fs::path& folder) {
  RecordedLog result;
  result.layout = "imu.csv, odom.csv and gps.csv";
  STRATA_ASSIGN_OR_RETURN(const auto rows, ReadCsvColumns(folder / "imu.csv", ImuColumns()));
  for (const std::vector<double>& row : rows) {
    result.log.imu.push_back({row[0], {row[1], row[2], row[3]}, {row[4], row[5], row[6]}});
  }
  STRATA_ASSIGN_OR_RETURN(result.log.wheels, ReadRosOdometry(folder / "odom.csv"));
  STRATA_ASSIGN_OR_RETURN(result.log.fixes, ReadRosFixes(folder / "gps.csv"));
  return result;
}

// Its receiver says where the car was a while ago, and how fast; found by the innovations' least
// mean square (tests/experiments/RESULTS.md). The logger's clock jitters, its gyroscope is a
// phone's.
Rig CarRig() {
  Rig rig;
  rig.gps.lag_s = 0.4;
  rig.wheels.lag_s = 0.7;
  rig.wheels.speed_m_s = 0.5;
  rig.imu.gyro_bias_rad_s = 0.1;
  rig.imu.accelerometer_noise = 0.3;
  return rig;
}

absl::StatusOr<RecordedLog> ReadCarFile(const fs::path& file) {
  RecordedLog result;
  result.layout = absl::StrCat("a car's logger, ", file.filename().string());
  result.rig = CarRig();
  STRATA_ASSIGN_OR_RETURN(const auto rows, ReadCsvColumns(file, CarColumns()));
  for (const std::vector<double>& row : rows) {
    const double time_s = 1e-3 * row[0];
    const Eigen::Vector3d gravity(row[1], row[2], row[3]);
    const Eigen::Vector3d rate(row[4], row[5], row[6]);
    result.log.imu.push_back({time_s, rate * kRadians, -gravity});
    const GpsFix fix{time_s,
                     row[8] * kRadians,
                     row[9] * kRadians,
                     row[10],
                     {row[13], row[13], row[13] * row[12] / std::max(row[11], 0.1)}};
    if (!result.log.fixes.empty() && fix.latitude_rad == result.log.fixes.back().latitude_rad &&
        fix.longitude_rad == result.log.fixes.back().longitude_rad) {
      continue;
    }
    result.log.fixes.push_back(fix);
    result.log.wheels.push_back({time_s, row[7] * kKmH, std::nullopt});
  }
  return result;
}

std::vector<fs::path> Below(const fs::path& folder) {
  std::error_code error;
  std::vector<fs::path> paths;
  for (const auto& entry : fs::directory_iterator(folder, error)) paths.push_back(entry.path());
  std::sort(paths.begin(), paths.end());
  return paths;
}

// The log in this very folder, if there is one.
std::optional<absl::StatusOr<RecordedLog>> ReadHere(const fs::path& folder) {
  if (fs::exists(folder / "imu.csv") && fs::exists(folder / "gps.csv")) {
    return ReadRosFolder(folder);
  }
  for (const fs::path& file : Below(folder)) {
    if (file.extension() == ".csv" && HasColumns(CsvHeader(file), CarColumns())) {
      return ReadCarFile(file);
    }
  }
  return std::nullopt;
}

}  // namespace

absl::StatusOr<RecordedLog> ReadRecordedLog(const fs::path& folder) {
  std::error_code error;
  if (!fs::is_directory(folder, error)) {
    return absl::NotFoundError(
        absl::StrCat(folder.string(), " is no folder; name the one that holds the log's files"));
  }
  if (auto here = ReadHere(folder)) return *std::move(here);
  for (const fs::path& below : Below(folder)) {
    if (!fs::is_directory(below, error)) continue;
    if (auto log = ReadHere(below)) return *std::move(log);
  }
  return absl::NotFoundError(absl::StrCat(
      folder.string(),
      " holds no log that is known. Write imu.csv (columns stamp,wx,wy,wz,ax,ay,az), gps.csv "
      "(stamp,lat,lon,alt,var_e,var_n,var_u) and, if there are wheels, odom.csv (stamp,vx,wz): "
      "seconds, rad/s, m/s2, degrees, m, m2, m/s"));
}

}  // namespace strata
