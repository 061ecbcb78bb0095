// Truth: the map, its scans, profiles and jobs. sqlite_posegraph.cc and sqlite_tile_reader.cc have
// the rest.
#include "core/storage/sqlite/sqlite_reader.h"

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"

#include "core/common/status.h"
#include "core/storage/sqlite/database.h"
#include "core/storage/sqlite/scan_rows.h"
#include "core/world/value_codec.h"

namespace strata {
namespace {

RobotProfile ReadProfile(const Statement& row, int column) {
  RobotProfile profile;
  profile.radius_m = row.Real(column);
  profile.height_m = row.Real(column + 1);
  profile.max_step_m = row.Real(column + 2);
  profile.max_slope_rad = row.Real(column + 3);
  profile.max_gap_m = row.Real(column + 4);
  profile.max_roughness_m = row.Real(column + 5);
  return profile;
}

absl::StatusOr<std::optional<PosedScan>> ReadOne(Statement& row) {
  STRATA_ASSIGN_OR_RETURN(const bool found, row.Step());
  if (!found) return std::optional<PosedScan>();
  STRATA_ASSIGN_OR_RETURN(PosedScan scan, ReadPosedScan(row));
  return std::optional<PosedScan>(std::move(scan));
}

JobInfo ReadJob(const Statement& row) {
  JobInfo job;
  job.id = row.Unsigned(0);
  job.kind = row.Text(1);
  job.state = static_cast<JobState>(row.Int(2));
  job.progress = row.Real(3);
  job.phase = row.Text(4);
  job.message = row.Text(5);
  job.created = absl::FromUnixMicros(row.Int(6));
  job.updated = absl::FromUnixMicros(row.Int(7));
  return job;
}

}  // namespace

absl::Status SqliteReader::Snapshot(absl::FunctionRef<absl::Status()> body) {
  STRATA_ASSIGN_OR_RETURN(Transaction transaction, Transaction::Begin(database_, "BEGIN"));
  STRATA_RETURN_IF_ERROR(body());
  return transaction.Commit();
}

absl::Status SqliteReader::CopyTo(const std::filesystem::path& file, const Stop& stop) {
  return database_.CopyTo(file, stop);
}

absl::StatusOr<MapClock> SqliteReader::GetClock() {
  STRATA_ASSIGN_OR_RETURN(
      Statement row,
      database_.Prepare("SELECT m.commit_sequence, m.epoch, d.tile_version, d.complete "
                        "FROM truth_map AS m, derived_state AS d WHERE m.id = 1 AND d.id = 1"));
  STRATA_ASSIGN_OR_RETURN(const bool found, row.Step());
  if (!found) return absl::DataLossError("store: the map's own row is missing");
  return MapClock{row.Unsigned(0), row.Unsigned(1), row.Unsigned(2), row.Int(3) != 0};
}

absl::StatusOr<MapInfo> SqliteReader::GetMapInfo() {
  STRATA_ASSIGN_OR_RETURN(
      Statement row,
      database_.Prepare(
          "SELECT m.created_us, m.cell_size_m, m.gap_size_m, m.thickness_m, m.sensor_sigma_m, "
          "m.sensor_sigma_per_metre, m.sensor_min_range_m, m.sensor_max_range_m, m.keep_points, "
          "m.has_origin, m.latitude_rad, m.longitude_rad, m.altitude_m, p.radius_m, p.height_m, "
          "p.max_step_m, p.max_slope_rad, p.max_gap_m, p.max_roughness_m, m.fade_after FROM "
          "truth_map AS m, "
          "truth_profile AS p WHERE m.id = 1 AND p.name = 'default'"));
  STRATA_ASSIGN_OR_RETURN(const bool found, row.Step());
  if (!found) return absl::DataLossError("store: the map's parameters are missing");
  MapInfo info;
  info.created = absl::FromUnixMicros(row.Int(0));
  info.parameters.mls = {row.Real(1), row.Real(2), row.Real(3)};
  info.parameters.sensor = {row.Real(4), row.Real(5), row.Real(6), row.Real(7)};
  info.parameters.keep_points = row.Int(8) != 0;
  if (row.Int(9) != 0) info.parameters.origin = {row.Real(10), row.Real(11), row.Real(12)};
  info.parameters.default_profile = ReadProfile(row, 13);
  info.parameters.fade_after = static_cast<std::uint32_t>(row.Int(19));
  if (const absl::Status valid = ValidateMapParameters(info.parameters); !valid.ok()) {
    return absl::DataLossError(absl::StrCat("store: ", valid.message()));
  }
  return info;
}

absl::StatusOr<std::optional<PosedScan>> SqliteReader::FindScan(const ScanId& id,
                                                                std::uint64_t epoch) {
  STRATA_ASSIGN_OR_RETURN(
      Statement row,
      database_.Prepare(STRATA_SELECT_POSED_SCAN "WHERE s.trajectory = ?2 AND s.sequence = ?3"));
  row.Bind(epoch, id.trajectory, id.sequence);
  return ReadOne(row);
}

absl::StatusOr<PosedScan> SqliteReader::GetScan(ScanNumber number, std::uint64_t epoch) {
  STRATA_ASSIGN_OR_RETURN(Statement row,
                          database_.Prepare(STRATA_SELECT_POSED_SCAN "WHERE s.number = ?2"));
  row.Bind(epoch, number);
  STRATA_ASSIGN_OR_RETURN(std::optional<PosedScan> scan, ReadOne(row));
  if (!scan.has_value()) return absl::NotFoundError(absl::StrCat("scan number ", number));
  return *std::move(scan);
}

absl::StatusOr<std::vector<ScanNumber>> SqliteReader::ListScanNumbers() {
  STRATA_ASSIGN_OR_RETURN(Statement row,
                          database_.Prepare("SELECT number FROM truth_scan ORDER BY number"));
  std::vector<ScanNumber> numbers;
  STRATA_RETURN_IF_ERROR(ForEachRow(row, [&] {
    numbers.push_back(row.Unsigned(0));
    return absl::OkStatus();
  }));
  return numbers;
}

absl::Status SqliteReader::CheckScanRow(ScanNumber number) {
  STRATA_ASSIGN_OR_RETURN(Statement row,
                          database_.Prepare("SELECT trajectory, sequence, header, points, time_us "
                                            "FROM truth_scan WHERE number = ?1"));
  row.Bind(number);
  STRATA_ASSIGN_OR_RETURN(const bool found, row.Step());
  if (!found) return absl::NotFoundError(absl::StrCat("scan number ", number, " does not exist"));
  STRATA_ASSIGN_OR_RETURN(const ScanHeader header,
                          DecodeScanHeader({row.Text(0), row.Unsigned(1)}, row.Bytes(2)));
  if (row.Unsigned(3) != header.point_count) {
    return absl::DataLossError(
        absl::StrCat("counted with ", row.Unsigned(3), " points instead of ", header.point_count));
  }
  const std::int64_t time_us = absl::ToUnixMicros(header.time);
  if (row.Int(4) != time_us) {
    return absl::DataLossError(
        absl::StrCat("found by time ", row.Int(4), " us instead of ", time_us));
  }
  STRATA_ASSIGN_OR_RETURN(
      Statement pose,
      database_.Prepare("SELECT epoch, pose FROM truth_pose WHERE scan = ?1 ORDER BY epoch"));
  pose.Bind(number);
  return ForEachRow(pose, [&] {
    return Annotate(DecodePose(pose.Bytes(1)).status(),
                    absl::StrCat("in epoch ", pose.Unsigned(0)));
  });
}

absl::StatusOr<std::vector<PosedScan>> SqliteReader::ListScans(const ScanQuery& query,
                                                               std::uint64_t epoch) {
  // An absent condition is bound so that it always holds.
  STRATA_ASSIGN_OR_RETURN(
      Statement row,
      database_.Prepare(
          STRATA_SELECT_POSED_SCAN
          "WHERE s.number > ?2 AND (?3 = '' OR s.trajectory = ?3) AND (?4 = 0 OR s.state = ?4) "
          "AND s.time_us >= ?5 AND s.time_us < ?6 AND (?7 = 0 OR s.number IN (SELECT f.scan FROM "
          "derived_footprint AS f WHERE f.min_x <= ?9 AND f.max_x >= ?8 AND f.min_y <= ?11 AND "
          "f.max_y >= ?10 AND f.exact_min_x <= ?9 AND f.exact_max_x >= ?8 AND "
          "f.exact_min_y <= ?11 AND f.exact_max_y >= ?10)) "
          "ORDER BY s.number"));
  constexpr std::int64_t kForever = std::int64_t{1} << 62;
  const Eigen::AlignedBox2d box = query.box.value_or(Eigen::AlignedBox2d());
  row.Bind(epoch,
           query.after,
           query.trajectory.value_or(""),
           query.state.has_value() ? static_cast<int>(*query.state) : 0,
           query.from.has_value() ? absl::ToUnixMicros(*query.from) : -kForever,
           query.until.has_value() ? absl::ToUnixMicros(*query.until) : kForever,
           query.box.has_value(),
           box.min().x(),
           box.max().x(),
           box.min().y(),
           box.max().y());
  std::vector<PosedScan> scans;
  while (scans.size() < query.limit) {
    STRATA_ASSIGN_OR_RETURN(const bool more, row.Step());
    if (!more) break;
    absl::StatusOr<PosedScan> scan = ReadPosedScan(row);
    if (query.skip_damaged && absl::IsDataLoss(scan.status())) continue;
    STRATA_RETURN_IF_ERROR(scan.status());
    scans.push_back(*std::move(scan));
  }
  return scans;
}

absl::StatusOr<UploadState> SqliteReader::GetUploadState(absl::string_view trajectory) {
  STRATA_ASSIGN_OR_RETURN(Statement row,
                          database_.Prepare("SELECT count(*), coalesce(max(sequence), 0) FROM "
                                            "truth_scan WHERE trajectory = ?1"));
  row.Bind(trajectory);
  STRATA_RETURN_IF_ERROR(row.Step().status());
  return UploadState{
      .exists = row.Int(0) > 0, .last_sequence = row.Unsigned(1), .scans = row.Unsigned(0)};
}

absl::StatusOr<ScanTotals> SqliteReader::GetScanTotals() {
  STRATA_ASSIGN_OR_RETURN(
      Statement row,
      database_.Prepare("SELECT count(*), count(*) FILTER (WHERE state = 1), count(*) FILTER "
                        "(WHERE state = 3), coalesce(sum(points), 0), "
                        "coalesce(sum(point_bytes), 0) FROM truth_scan"));
  STRATA_RETURN_IF_ERROR(row.Step().status());
  return ScanTotals{
      row.Unsigned(0), row.Unsigned(1), row.Unsigned(2), row.Unsigned(3), row.Unsigned(4)};
}

absl::StatusOr<std::uint64_t> SqliteReader::LastUpload() {
  STRATA_ASSIGN_OR_RETURN(
      const std::int64_t last,
      database_.Pragma("SELECT max(coalesce((SELECT max(upload) FROM truth_scan), 0), "
                       "coalesce((SELECT max(upload) FROM truth_chunk), 0), "
                       "coalesce((SELECT max(upload) FROM truth_upload), 0))"));
  return static_cast<std::uint64_t>(last);
}

absl::StatusOr<std::vector<UnfinishedUpload>> SqliteReader::ListUnfinishedUploads() {
  STRATA_ASSIGN_OR_RETURN(
      Statement row,
      database_.Prepare("SELECT u.upload, u.trajectory, u.sequence, u.content_hash, u.touched_us, "
                        "count(c.ordinal), coalesce(sum(length(c.bytes)), 0) FROM truth_upload AS "
                        "u LEFT JOIN truth_chunk AS c ON c.upload = u.upload GROUP BY u.upload "
                        "ORDER BY u.upload"));
  std::vector<UnfinishedUpload> uploads;
  STRATA_RETURN_IF_ERROR(ForEachRow(row, [&] {
    uploads.push_back({.upload = row.Unsigned(0),
                       .id = {row.Text(1), row.Unsigned(2)},
                       .content_hash = row.Text(3),
                       .touched = absl::FromUnixMicros(row.Int(4)),
                       .chunks = static_cast<std::uint32_t>(row.Int(5)),
                       .bytes = row.Unsigned(6)});
    return absl::OkStatus();
  }));
  return uploads;
}

absl::StatusOr<std::string> SqliteReader::GetChunk(std::uint64_t upload, std::uint32_t ordinal) {
  STRATA_ASSIGN_OR_RETURN(
      Statement row,
      database_.Prepare("SELECT bytes FROM truth_chunk WHERE upload = ?1 AND ordinal = ?2"));
  row.Bind(upload, ordinal);
  STRATA_ASSIGN_OR_RETURN(const bool found, row.Step());
  if (!found) return absl::DataLossError(absl::StrCat("piece ", ordinal, " of the points is gone"));
  return row.Text(0);
}

absl::StatusOr<std::string> SqliteReader::GetLocalMap(ScanNumber number) {
  STRATA_ASSIGN_OR_RETURN(Statement row,
                          database_.Prepare("SELECT bytes FROM truth_local_map WHERE scan = ?1"));
  row.Bind(number);
  STRATA_ASSIGN_OR_RETURN(const bool found, row.Step());
  if (!found) return absl::DataLossError(absl::StrCat("local map of scan ", number, " is gone"));
  return row.Text(0);
}

absl::StatusOr<std::map<std::string, RobotProfile>> SqliteReader::ListProfiles() {
  STRATA_ASSIGN_OR_RETURN(
      Statement row,
      database_.Prepare("SELECT name, radius_m, height_m, max_step_m, max_slope_rad, max_gap_m, "
                        "max_roughness_m FROM truth_profile ORDER BY name"));
  std::map<std::string, RobotProfile> profiles;
  STRATA_RETURN_IF_ERROR(ForEachRow(row, [&] {
    profiles[row.Text(0)] = ReadProfile(row, 1);
    return absl::OkStatus();
  }));
  return profiles;
}

absl::Status SqliteReader::ReadJobDetails(JobInfo& job) {
  STRATA_ASSIGN_OR_RETURN(
      Statement parameter,
      database_.Prepare("SELECT name, value FROM truth_job_parameter WHERE job = ?1"));
  parameter.Bind(job.id);
  STRATA_RETURN_IF_ERROR(ForEachRow(parameter, [&] {
    job.parameters[parameter.Text(0)] = parameter.Text(1);
    return absl::OkStatus();
  }));
  STRATA_ASSIGN_OR_RETURN(
      Statement metric,
      database_.Prepare("SELECT name, value FROM truth_job_metric WHERE job = ?1"));
  metric.Bind(job.id);
  return ForEachRow(metric, [&] {
    job.metrics[metric.Text(0)] = metric.Real(1);
    return absl::OkStatus();
  });
}

absl::StatusOr<std::optional<JobInfo>> SqliteReader::FindJob(std::uint64_t id) {
  STRATA_ASSIGN_OR_RETURN(
      Statement row,
      database_.Prepare("SELECT id, kind, state, progress, phase, message, created_us, updated_us "
                        "FROM truth_job WHERE id = ?1"));
  row.Bind(id);
  STRATA_ASSIGN_OR_RETURN(const bool found, row.Step());
  if (!found) return std::optional<JobInfo>();
  JobInfo job = ReadJob(row);
  STRATA_RETURN_IF_ERROR(ReadJobDetails(job));
  return std::optional<JobInfo>(std::move(job));
}

absl::StatusOr<std::vector<JobInfo>> SqliteReader::ListJobs() {
  STRATA_ASSIGN_OR_RETURN(
      Statement row,
      database_.Prepare("SELECT id, kind, state, progress, phase, message, created_us, updated_us "
                        "FROM truth_job ORDER BY id"));
  std::vector<JobInfo> jobs;
  STRATA_RETURN_IF_ERROR(ForEachRow(row, [&]() -> absl::Status {
    jobs.push_back(ReadJob(row));
    return ReadJobDetails(jobs.back());
  }));
  return jobs;
}

}  // namespace strata
