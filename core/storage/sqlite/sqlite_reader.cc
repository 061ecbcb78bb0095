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
#include "core/storage/rows.h"
#include "core/storage/sqlite/database.h"
#include "core/world/value_codec.h"

// A scan with its pose of epoch ?1; needs a WHERE.
#define STRATA_SELECT_POSED_SCAN                                                            \
  "SELECT " STRATA_POSED_SCAN_COLUMNS                                                       \
  " FROM truth_scan AS s LEFT JOIN truth_pose AS p ON "                                     \
  "p.scan = s.number AND p.epoch = (SELECT max(epoch) FROM truth_pose AS e WHERE e.scan = " \
  "s.number AND e.epoch <= ?1) "

namespace strata {
namespace {

absl::StatusOr<std::optional<PosedScan>> ReadOne(Statement& row) {
  STRATA_ASSIGN_OR_RETURN(const bool found, row.Step());
  if (!found) return std::optional<PosedScan>();
  STRATA_ASSIGN_OR_RETURN(PosedScan scan, ReadPosedScan(row));
  return std::optional<PosedScan>(std::move(scan));
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
  STRATA_ASSIGN_OR_RETURN(Statement row,
                          database_.Prepare("SELECT " STRATA_MAP_INFO_COLUMNS
                                            " FROM truth_map AS m, truth_profile AS p "
                                            "WHERE m.id = 1 AND p.name = 'default'"));
  STRATA_ASSIGN_OR_RETURN(const bool found, row.Step());
  if (!found) return absl::DataLossError("store: the map's parameters are missing");
  return ReadMapInfo(row);
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
  STRATA_ASSIGN_OR_RETURN(
      Statement row,
      database_.Prepare("SELECT " STRATA_SCAN_CHECK_COLUMNS " FROM truth_scan WHERE number = ?1"));
  row.Bind(number);
  STRATA_ASSIGN_OR_RETURN(const bool found, row.Step());
  if (!found) return absl::NotFoundError(absl::StrCat("scan number ", number, " does not exist"));
  STRATA_RETURN_IF_ERROR(CheckScanColumns(row));
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

absl::StatusOr<std::vector<UnfinishedUpload>> SqliteReader::ListUnfinishedUploads() {
  STRATA_ASSIGN_OR_RETURN(
      Statement row,
      database_.Prepare("SELECT u.upload, u.trajectory, u.sequence, u.content_hash, u.touched_us, "
                        "count(c.ordinal), coalesce(sum(length(c.bytes)), 0) FROM truth_upload AS "
                        "u LEFT JOIN truth_chunk AS c ON c.upload = u.upload GROUP BY u.upload "
                        "ORDER BY u.upload"));
  std::vector<UnfinishedUpload> uploads;
  STRATA_RETURN_IF_ERROR(ForEachRow(row, [&] {
    uploads.push_back(ReadUnfinishedUpload(row));
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
      database_.Prepare("SELECT " STRATA_PROFILE_COLUMNS " FROM truth_profile ORDER BY name"));
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
      database_.Prepare("SELECT " STRATA_JOB_COLUMNS " FROM truth_job WHERE id = ?1"));
  row.Bind(id);
  STRATA_ASSIGN_OR_RETURN(const bool found, row.Step());
  if (!found) return std::optional<JobInfo>();
  JobInfo job = ReadJob(row);
  STRATA_RETURN_IF_ERROR(ReadJobDetails(job));
  return std::optional<JobInfo>(std::move(job));
}

absl::StatusOr<std::vector<JobInfo>> SqliteReader::ListJobs() {
  STRATA_ASSIGN_OR_RETURN(
      Statement row, database_.Prepare("SELECT " STRATA_JOB_COLUMNS " FROM truth_job ORDER BY id"));
  std::vector<JobInfo> jobs;
  STRATA_RETURN_IF_ERROR(ForEachRow(row, [&]() -> absl::Status {
    jobs.push_back(ReadJob(row));
    return ReadJobDetails(jobs.back());
  }));
  return jobs;
}

}  // namespace strata
