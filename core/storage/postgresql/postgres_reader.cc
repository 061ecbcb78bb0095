// Truth: the map, its scans, profiles and jobs. postgres_posegraph.cc, postgres_classes.cc and
// postgres_tile_reader.cc have the rest.
#include "core/storage/postgresql/postgres_reader.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/cleanup/cleanup.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"

#include "core/common/status.h"
#include "core/storage/postgresql/cells.h"
#include "core/storage/postgresql/map_copy.h"
#include "core/storage/rows.h"
#include "core/world/value_codec.h"

// A scan with its pose of epoch $2; needs a condition.
#define STRATA_SELECT_POSED_SCAN                                                                 \
  "SELECT " STRATA_POSED_SCAN_COLUMNS                                                            \
  " FROM truth_scan AS s LEFT JOIN truth_pose AS p ON p.map "                                    \
  "= s.map AND p.scan = s.number AND p.epoch = (SELECT max(e.epoch) FROM truth_pose AS e WHERE " \
  "e.map = s.map AND e.scan = s.number AND e.epoch <= $2) WHERE s.map = $1 "

// Conditions of a ScanQuery but for its box; absent ones are given so that they always hold.
#define STRATA_SCAN_CONDITIONS                                                             \
  "AND s.number > $3 AND ($4 = '' OR s.trajectory = $4) AND ($5 = 0 OR s.state = $5) AND " \
  "s.time_us >= $6 AND s.time_us < $7 "

namespace strata {
namespace {

constexpr std::int64_t kForever = std::int64_t{1} << 62;
// What is read at a time where damaged rows are left out.
constexpr std::uint64_t kMostScansAtATime = 1000;

// A box with a NaN meets nothing; in PostgreSQL NaN is larger than all numbers.
bool MeetsNothing(const Eigen::AlignedBox2d& box) {
  return !(box.min().x() <= box.max().x() && box.min().y() <= box.max().y());
}

}  // namespace

absl::Status PostgresReader::Snapshot(absl::FunctionRef<absl::Status()> body) {
  return SnapshotOf("BEGIN ISOLATION LEVEL REPEATABLE READ READ ONLY", body);
}

absl::Status PostgresReader::LongSnapshot(absl::FunctionRef<absl::Status()> body) {
  return SnapshotOf(
      "BEGIN ISOLATION LEVEL REPEATABLE READ READ ONLY; "
      "SET LOCAL idle_in_transaction_session_timeout = '10min'",
      body);
}

absl::Status PostgresReader::SnapshotOf(const char* begin, absl::FunctionRef<absl::Status()> body) {
  if (held_ != nullptr) return absl::InternalError("store: a snapshot in a transaction");
  STRATA_ASSIGN_OR_RETURN(const ConnectionPool::Lease lease, pool_->Take());
  STRATA_RETURN_IF_ERROR(lease->Execute(begin));
  const absl::Cleanup let_go = [this] { held_ = nullptr; };
  held_ = &*lease;
  const absl::Status done = body();
  const absl::Status ended = lease->Execute("COMMIT");
  return done.ok() ? ended : done;
}

absl::Status PostgresReader::OneState(absl::FunctionRef<absl::Status()> body) {
  return held_ != nullptr ? body() : Snapshot(body);
}

absl::Status PostgresReader::CopyTo(const std::filesystem::path& file, const Stop& stop) {
  if (held_ != nullptr) return absl::InternalError("store: a copy in a snapshot");
  STRATA_ASSIGN_OR_RETURN(const ConnectionPool::Lease lease, pool_->Take());
  STRATA_RETURN_IF_ERROR(
      lease->Execute("BEGIN ISOLATION LEVEL REPEATABLE READ READ ONLY; "
                     "SET LOCAL statement_timeout = 0"));
  STRATA_RETURN_IF_ERROR(CopyMapToFile(*lease, map_, file, stop));
  return lease->Execute("COMMIT");
}

absl::StatusOr<MapClock> PostgresReader::GetClock() {
  STRATA_ASSIGN_OR_RETURN(
      Rows row,
      Ask("SELECT m.commit_sequence, m.epoch, d.tile_version, d.complete FROM truth_map AS m JOIN "
          "derived_state AS d ON d.map = m.map WHERE m.map = $1"));
  if (!row.Next()) return absl::DataLossError("store: the map's own row is missing");
  return MapClock{row.Unsigned(0), row.Unsigned(1), row.Unsigned(2), row.Bool(3)};
}

absl::StatusOr<MapInfo> PostgresReader::GetMapInfo() {
  STRATA_ASSIGN_OR_RETURN(
      Rows row,
      Ask("SELECT " STRATA_MAP_INFO_COLUMNS " FROM truth_map AS m JOIN truth_profile AS p ON p.map "
          "= m.map AND p.name = 'default' WHERE m.map = $1"));
  if (!row.Next()) return absl::DataLossError("store: the map's parameters are missing");
  return ReadMapInfo(row);
}

absl::StatusOr<std::optional<PosedScan>> PostgresReader::AskForScan(absl::StatusOr<Rows> rows) {
  STRATA_RETURN_IF_ERROR(rows.status());
  if (!rows->Next()) return std::optional<PosedScan>();
  STRATA_ASSIGN_OR_RETURN(PosedScan scan, ReadPosedScan(*rows));
  return std::optional<PosedScan>(std::move(scan));
}

absl::StatusOr<std::vector<ScanNumber>> PostgresReader::AskForNumbers(absl::StatusOr<Rows> rows) {
  STRATA_RETURN_IF_ERROR(rows.status());
  std::vector<ScanNumber> numbers;
  numbers.reserve(static_cast<std::size_t>(rows->size()));
  while (rows->Next()) numbers.push_back(rows->Unsigned(0));
  return numbers;
}

absl::StatusOr<std::optional<std::string>> PostgresReader::AskForBytes(absl::StatusOr<Rows> rows) {
  STRATA_RETURN_IF_ERROR(rows.status());
  if (!rows->Next()) return std::optional<std::string>();
  return std::optional<std::string>(rows->Text(0));
}

absl::StatusOr<std::uint64_t> PostgresReader::AskForNumber(absl::StatusOr<Rows> rows) {
  STRATA_RETURN_IF_ERROR(rows.status());
  return rows->Next() ? rows->Unsigned(0) : 0;
}

absl::StatusOr<std::optional<PosedScan>> PostgresReader::FindScan(const ScanId& id,
                                                                  std::uint64_t epoch) {
  return AskForScan(Ask(STRATA_SELECT_POSED_SCAN "AND s.trajectory = $3 AND s.sequence = $4",
                        epoch,
                        id.trajectory,
                        id.sequence));
}

absl::StatusOr<PosedScan> PostgresReader::GetScan(ScanNumber number, std::uint64_t epoch) {
  STRATA_ASSIGN_OR_RETURN(
      std::optional<PosedScan> scan,
      AskForScan(Ask(STRATA_SELECT_POSED_SCAN "AND s.number = $3", epoch, number)));
  if (!scan.has_value()) return absl::NotFoundError(absl::StrCat("scan number ", number));
  return *std::move(scan);
}

absl::StatusOr<std::vector<ScanNumber>> PostgresReader::ListScanNumbers() {
  return AskForNumbers(Ask("SELECT number FROM truth_scan WHERE map = $1 ORDER BY number"));
}

absl::Status PostgresReader::CheckScanRow(ScanNumber number) {
  return OneState([&]() -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(
        Rows row,
        Ask("SELECT " STRATA_SCAN_CHECK_COLUMNS " FROM truth_scan WHERE map = $1 AND number = $2",
            number));
    if (!row.Next()) {
      return absl::NotFoundError(absl::StrCat("scan number ", number, " does not exist"));
    }
    STRATA_RETURN_IF_ERROR(CheckScanColumns(row));
    STRATA_ASSIGN_OR_RETURN(
        Rows pose,
        Ask("SELECT epoch, pose FROM truth_pose WHERE map = $1 AND scan = $2 ORDER BY epoch",
            number));
    while (pose.Next()) {
      STRATA_RETURN_IF_ERROR(Annotate(DecodePose(pose.Bytes(1)).status(),
                                      absl::StrCat("in epoch ", pose.Unsigned(0))));
    }
    return absl::OkStatus();
  });
}

absl::StatusOr<Rows> PostgresReader::AskForScans(const ScanQuery& query,
                                                 std::uint64_t after,
                                                 std::uint64_t limit,
                                                 std::uint64_t epoch) {
  const std::string trajectory = query.trajectory.value_or("");
  const int state = query.state.has_value() ? static_cast<int>(*query.state) : 0;
  const std::int64_t from = query.from.has_value() ? absl::ToUnixMicros(*query.from) : -kForever;
  const std::int64_t until = query.until.has_value() ? absl::ToUnixMicros(*query.until) : kForever;
  if (!query.box.has_value()) {
    return Ask(STRATA_SELECT_POSED_SCAN STRATA_SCAN_CONDITIONS "ORDER BY s.number LIMIT $8",
               epoch,
               after,
               trajectory,
               state,
               from,
               until,
               limit);
  }
  const CellRange cells = CellsOf(*query.box);
  return Ask(STRATA_SELECT_POSED_SCAN STRATA_SCAN_CONDITIONS
             "AND s.number IN (SELECT f.scan FROM derived_footprint AS f WHERE f.map = $1 AND "
             "f.min_x <= $10 AND f.max_x >= $9 AND f.min_y <= $12 AND f.max_y >= $11 AND f.scan IN "
             "(SELECT c.scan FROM derived_scan_cell AS c WHERE c.map = $1 AND c.wide = 0 AND c.cx "
             "BETWEEN $13 AND $14 AND c.cy BETWEEN $15 AND $16 UNION ALL SELECT w.scan FROM "
             "derived_scan_cell AS w WHERE w.map = $1 AND w.wide = 1)) ORDER BY s.number LIMIT $8",
             epoch,
             after,
             trajectory,
             state,
             from,
             until,
             limit,
             query.box->min().x(),
             query.box->max().x(),
             query.box->min().y(),
             query.box->max().y(),
             cells.x_min,
             cells.x_max,
             cells.y_min,
             cells.y_max);
}

absl::StatusOr<std::vector<PosedScan>> PostgresReader::ListScans(const ScanQuery& query,
                                                                 std::uint64_t epoch) {
  std::vector<PosedScan> scans;
  if (query.box.has_value() && MeetsNothing(*query.box)) return scans;
  const absl::Status listed = OneState([&]() -> absl::Status {
    std::uint64_t after = query.after;
    while (scans.size() < query.limit) {
      const std::uint64_t limit =
          std::min<std::uint64_t>(query.limit - scans.size(), kMostScansAtATime);
      STRATA_ASSIGN_OR_RETURN(Rows row, AskForScans(query, after, limit, epoch));
      while (row.Next()) {
        after = row.Unsigned(0);
        absl::StatusOr<PosedScan> scan = ReadPosedScan(row);
        if (query.skip_damaged && absl::IsDataLoss(scan.status())) continue;
        STRATA_RETURN_IF_ERROR(scan.status());
        scans.push_back(*std::move(scan));
      }
      if (static_cast<std::uint64_t>(row.size()) < limit) break;
    }
    return absl::OkStatus();
  });
  STRATA_RETURN_IF_ERROR(listed);
  return scans;
}

absl::StatusOr<UploadState> PostgresReader::GetUploadState(absl::string_view trajectory) {
  STRATA_ASSIGN_OR_RETURN(Rows row,
                          Ask("SELECT count(*), coalesce(max(sequence), 0) FROM truth_scan WHERE "
                              "map = $1 AND trajectory = $2",
                              trajectory));
  row.Next();
  return UploadState{
      .exists = row.Int(0) > 0, .last_sequence = row.Unsigned(1), .scans = row.Unsigned(0)};
}

absl::StatusOr<ScanTotals> PostgresReader::GetScanTotals() {
  STRATA_ASSIGN_OR_RETURN(
      Rows row,
      Ask("SELECT count(*), count(*) FILTER (WHERE state = 1), count(*) FILTER (WHERE state = 3), "
          "coalesce(sum(points), 0)::bigint, coalesce(sum(point_bytes), 0)::bigint FROM truth_scan "
          "WHERE map = $1"));
  row.Next();
  return ScanTotals{
      row.Unsigned(0), row.Unsigned(1), row.Unsigned(2), row.Unsigned(3), row.Unsigned(4)};
}

absl::StatusOr<std::vector<UnfinishedUpload>> PostgresReader::ListUnfinishedUploads() {
  STRATA_ASSIGN_OR_RETURN(
      Rows row,
      Ask("SELECT u.upload, u.trajectory, u.sequence, u.content_hash, u.touched_us, "
          "count(c.ordinal), coalesce(sum(length(c.bytes)), 0)::bigint FROM truth_upload AS u LEFT "
          "JOIN truth_chunk AS c ON c.map = u.map AND c.upload = u.upload WHERE u.map = $1 GROUP "
          "BY u.map, u.upload ORDER BY u.upload"));
  std::vector<UnfinishedUpload> uploads;
  while (row.Next()) uploads.push_back(ReadUnfinishedUpload(row));
  return uploads;
}

absl::StatusOr<std::string> PostgresReader::GetChunk(std::uint64_t upload, std::uint32_t ordinal) {
  STRATA_ASSIGN_OR_RETURN(
      std::optional<std::string> bytes,
      AskForBytes(Ask("SELECT bytes FROM truth_chunk WHERE map = $1 AND upload = $2 AND ordinal = "
                      "$3 AND length(bytes) <= 1048576",
                      upload,
                      ordinal)));
  if (bytes.has_value()) return *std::move(bytes);
  return absl::DataLossError(absl::StrCat("piece ", ordinal, " of the points is gone"));
}

absl::StatusOr<std::string> PostgresReader::GetLocalMap(ScanNumber number) {
  STRATA_ASSIGN_OR_RETURN(
      std::optional<std::string> bytes,
      AskForBytes(Ask("SELECT bytes FROM truth_local_map WHERE map = $1 AND scan = $2", number)));
  if (bytes.has_value()) return *std::move(bytes);
  return absl::DataLossError(absl::StrCat("local map of scan ", number, " is gone"));
}

absl::StatusOr<std::map<std::string, RobotProfile>> PostgresReader::ListProfiles() {
  STRATA_ASSIGN_OR_RETURN(
      Rows row, Ask("SELECT " STRATA_PROFILE_COLUMNS " FROM truth_profile WHERE map = $1"));
  std::map<std::string, RobotProfile> profiles;
  while (row.Next()) profiles[row.Text(0)] = ReadProfile(row, 1);
  return profiles;
}

absl::Status PostgresReader::ReadJobDetails(std::vector<JobInfo>& jobs) {
  std::map<std::uint64_t, JobInfo*> by_id;
  std::vector<std::int64_t> ids;
  for (JobInfo& job : jobs) {
    by_id[job.id] = &job;
    ids.push_back(static_cast<std::int64_t>(job.id));
  }
  STRATA_ASSIGN_OR_RETURN(
      Rows parameter,
      Ask("SELECT job, name, value FROM truth_job_parameter WHERE map = $1 AND job = ANY ($2)",
          ids));
  while (parameter.Next()) {
    const auto job = by_id.find(parameter.Unsigned(0));
    if (job != by_id.end()) job->second->parameters[parameter.Text(1)] = parameter.Text(2);
  }
  STRATA_ASSIGN_OR_RETURN(
      Rows metric,
      Ask("SELECT job, name, value FROM truth_job_metric WHERE map = $1 AND job = ANY ($2)", ids));
  while (metric.Next()) {
    const auto job = by_id.find(metric.Unsigned(0));
    if (job != by_id.end()) job->second->metrics[metric.Text(1)] = metric.Real(2);
  }
  return absl::OkStatus();
}

absl::StatusOr<std::optional<JobInfo>> PostgresReader::FindJob(std::uint64_t id) {
  std::vector<JobInfo> jobs;
  const absl::Status found = OneState([&]() -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(
        Rows row,
        Ask("SELECT " STRATA_JOB_COLUMNS " FROM truth_job WHERE map = $1 AND id = $2", id));
    if (!row.Next()) return absl::OkStatus();
    jobs.push_back(ReadJob(row));
    return ReadJobDetails(jobs);
  });
  STRATA_RETURN_IF_ERROR(found);
  if (jobs.empty()) return std::optional<JobInfo>();
  return std::optional<JobInfo>(std::move(jobs.front()));
}

absl::StatusOr<std::vector<JobInfo>> PostgresReader::ListJobs() {
  std::vector<JobInfo> jobs;
  const absl::Status listed = OneState([&]() -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(
        Rows row, Ask("SELECT " STRATA_JOB_COLUMNS " FROM truth_job WHERE map = $1 ORDER BY id"));
    while (row.Next()) jobs.push_back(ReadJob(row));
    return ReadJobDetails(jobs);
  });
  STRATA_RETURN_IF_ERROR(listed);
  return jobs;
}

absl::StatusOr<std::vector<Attempt>> PostgresReader::ListAttempts() {
  STRATA_ASSIGN_OR_RETURN(
      Rows row,
      Ask("SELECT kind, id, deaths, under_way FROM attempt WHERE map = $1 ORDER BY kind, id"));
  std::vector<Attempt> attempts;
  while (row.Next()) attempts.push_back(ReadAttempt(row));
  return attempts;
}

}  // namespace strata
