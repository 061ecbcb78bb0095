// Transactions and truth; sqlite_tile_writer.cc has the derived tables.
#include "core/storage/sqlite/sqlite_writer.h"

#include <cstdint>
#include <filesystem>
#include <optional>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"

#include "core/common/status.h"
#include "core/storage/sqlite/database.h"
#include "core/world/value_codec.h"

namespace strata {
namespace {

// Whether it is the file that it was, and has not become smaller.
bool IsWhole(const std::optional<FileState>& before, const std::filesystem::path& file) {
  if (!before.has_value()) return true;
  const std::optional<FileState> now = StateOfFile(file);
  return now.has_value() && now->SameFile(*before) && now->bytes >= before->bytes;
}

}  // namespace

absl::Status SqliteWriter::CheckFiles() const {
  const std::filesystem::path file = database_.File();
  if (!database_.InPlace() || !IsWhole(file_, file)) return TakenAway(file);
  const std::filesystem::path log = database_.LogFile();
  return IsWhole(log_, log) ? absl::OkStatus() : TakenAway(log);
}

absl::Status SqliteWriter::Commit(Durability durability, absl::FunctionRef<absl::Status()> body) {
  if (durability != durability_) {
    STRATA_RETURN_IF_ERROR(database_.Execute(durability == Durability::kFull
                                                 ? "PRAGMA synchronous = FULL"
                                                 : "PRAGMA synchronous = NORMAL"));
    durability_ = durability;
  }
  STRATA_ASSIGN_OR_RETURN(Transaction transaction,
                          Transaction::Begin(database_, "BEGIN IMMEDIATE"));
  broken_ = absl::OkStatus();
  STRATA_RETURN_IF_ERROR(body());
  STRATA_RETURN_IF_ERROR(broken_);
  STRATA_RETURN_IF_ERROR(CheckFiles());
  const std::filesystem::path file = database_.File();
  const std::filesystem::path log = database_.LogFile();
  STRATA_RETURN_IF_ERROR(transaction.Commit());
  file_ = StateOfFile(file);  // takes no memory: what is committed must not fail any more
  log_ = StateOfFile(log);
  return absl::OkStatus();
}

// After some errors (a full disk, say) SQLite rolls back the whole transaction by itself. Then
// there is no savepoint to go back to, and a further part would begin and commit a transaction of
// its own.
absl::Status SqliteWriter::Part(absl::FunctionRef<absl::Status()> body) {
  STRATA_RETURN_IF_ERROR(broken_);
  STRATA_RETURN_IF_ERROR(database_.Execute("SAVEPOINT part"));
  absl::Status done = body();
  if (!done.ok() && !database_.Execute("ROLLBACK TO part").ok()) {
    broken_ = done;
    return done;
  }
  const absl::Status released = database_.Execute("RELEASE part");
  return done.ok() ? released : done;
}

absl::StatusOr<std::uint64_t> SqliteWriter::NextCommitSequence() {
  if (durability_ != Durability::kFull) {
    return absl::InternalError("store: a number from a commit that may be lost");
  }
  STRATA_ASSIGN_OR_RETURN(
      Statement row,
      database_.Prepare("UPDATE truth_map SET commit_sequence = commit_sequence + 1 WHERE id = 1 "
                        "RETURNING commit_sequence"));
  STRATA_ASSIGN_OR_RETURN(const bool found, row.Step());
  if (!found) return absl::DataLossError("store: the map's own row is missing");
  const std::uint64_t sequence = row.Unsigned(0);
  STRATA_RETURN_IF_ERROR(row.Run());
  return sequence;
}

absl::Status SqliteWriter::PutChunk(std::uint64_t upload,
                                    std::uint32_t ordinal,
                                    absl::string_view bytes) {
  return RunSql("INSERT INTO truth_chunk (upload, ordinal, bytes) VALUES (?1, ?2, ?3)",
                upload,
                ordinal,
                Blob{bytes});
}

absl::Status SqliteWriter::KeepUpload(const UnfinishedUpload& upload) {
  return RunSql(
      "INSERT INTO truth_upload (upload, trajectory, sequence, content_hash, touched_us) VALUES "
      "(?1, ?2, ?3, ?4, ?5) ON CONFLICT (upload) DO UPDATE SET touched_us = excluded.touched_us",
      upload.upload,
      upload.id.trajectory,
      upload.id.sequence,
      upload.content_hash,
      absl::ToUnixMicros(upload.touched));
}

absl::Status SqliteWriter::AbandonUpload(std::uint64_t upload) {
  STRATA_RETURN_IF_ERROR(RunSql("DELETE FROM truth_upload WHERE upload = ?1", upload));
  return RunSql(
      "DELETE FROM truth_chunk WHERE upload = ?1 AND ?1 NOT IN (SELECT upload FROM truth_scan)",
      upload);
}

absl::Status SqliteWriter::AbandonOrphans() {
  return RunSql(
      "DELETE FROM truth_chunk WHERE upload NOT IN (SELECT upload FROM truth_scan) AND upload NOT "
      "IN (SELECT upload FROM truth_upload)");
}

absl::Status SqliteWriter::PutScan(const ScanRecord& scan) {
  const bool has_box = !scan.box_scan.isEmpty();
  const Eigen::Vector3d low = has_box ? Eigen::Vector3d(scan.box_scan.min().cast<double>())
                                      : Eigen::Vector3d(Eigen::Vector3d::Zero());
  const Eigen::Vector3d high = has_box ? Eigen::Vector3d(scan.box_scan.max().cast<double>())
                                       : Eigen::Vector3d(Eigen::Vector3d::Zero());
  const std::string header = EncodeScanHeader(scan.header);
  absl::Status put = RunSql(
      "INSERT INTO truth_scan (number, trajectory, sequence, time_us, header, points, state, "
      "upload, chunks, has_points, point_bytes, has_box, min_x, min_y, min_z, max_x, max_y, max_z, "
      "content_hash, message) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13, ?14, "
      "?15, ?16, ?17, ?18, ?19, ?20)",
      scan.number,
      scan.header.id.trajectory,
      scan.header.id.sequence,
      absl::ToUnixMicros(scan.header.time),
      Blob{header},
      scan.header.point_count,
      static_cast<int>(scan.state),
      scan.upload,
      scan.chunks,
      scan.has_points,
      scan.point_bytes,
      has_box,
      low.x(),
      low.y(),
      low.z(),
      high.x(),
      high.y(),
      high.z(),
      scan.content_hash,
      scan.message);
  if (put.ok()) return RunSql("DELETE FROM truth_upload WHERE upload = ?1", scan.upload);
  if (!absl::IsAlreadyExists(put)) return put;
  return absl::AlreadyExistsError(absl::StrCat("scan ", scan.header.id.ToString(), " exists"));
}

absl::Status SqliteWriter::SetScanState(ScanNumber number,
                                        ScanState state,
                                        absl::string_view message) {
  return RunSql("UPDATE truth_scan SET state = ?2, message = ?3 WHERE number = ?1",
                number,
                static_cast<int>(state),
                message);
}

absl::Status SqliteWriter::DropPoints(ScanNumber number, absl::string_view local_map) {
  STRATA_RETURN_IF_ERROR(
      RunSql("INSERT OR REPLACE INTO truth_local_map (scan, bytes) VALUES (?1, ?2)",
             number,
             Blob{local_map}));
  STRATA_RETURN_IF_ERROR(
      RunSql("DELETE FROM truth_chunk WHERE upload = (SELECT upload FROM truth_scan WHERE number = "
             "?1)",
             number));
  STRATA_RETURN_IF_ERROR(RunSql("DELETE FROM truth_label WHERE scan = ?1", number));
  return RunSql(
      "UPDATE truth_scan SET chunks = 0, has_points = 0, point_bytes = 0 WHERE number = ?1",
      number);
}

absl::Status SqliteWriter::DeleteScan(ScanNumber number) {
  STRATA_RETURN_IF_ERROR(
      RunSql("DELETE FROM truth_chunk WHERE upload = (SELECT upload FROM truth_scan WHERE number = "
             "?1)",
             number));
  for (const char* sql : {"DELETE FROM truth_label WHERE scan = ?1",
                          "DELETE FROM truth_local_map WHERE scan = ?1",
                          "DELETE FROM truth_pose WHERE scan = ?1",
                          "DELETE FROM truth_proposed_pose WHERE scan = ?1",
                          "DELETE FROM truth_constraint WHERE scan_i = ?1 OR scan_j = ?1",
                          "DELETE FROM truth_plane_support WHERE scan = ?1",
                          "DELETE FROM derived_entity WHERE part IN (SELECT part FROM "
                          "derived_entity_scan WHERE scan = ?1) AND part NOT IN (SELECT part FROM "
                          "derived_entity_scan WHERE scan <> ?1)",
                          "DELETE FROM derived_entity_scan WHERE scan = ?1",
                          "DELETE FROM derived_inferred WHERE kind IN (SELECT kind FROM "
                          "derived_inferred_scan WHERE scan = ?1)",
                          "DELETE FROM derived_inferred_scan WHERE scan = ?1",
                          "DELETE FROM derived_scan_view WHERE scan = ?1",
                          "DELETE FROM derived_scan_tile WHERE scan = ?1",
                          "DELETE FROM derived_footprint WHERE scan = ?1",
                          "DELETE FROM truth_scan WHERE number = ?1"}) {
    STRATA_RETURN_IF_ERROR(RunSql(sql, number));
  }
  return absl::OkStatus();
}

absl::Status SqliteWriter::PutPose(const PoseRecord& pose) {
  const std::string bytes = EncodePose(pose.T_map_scan);
  return RunSql(
      "INSERT OR REPLACE INTO truth_pose (scan, epoch, pose, origin, aligned, message, overlap, "
      "rms_m, iterations) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9)",
      pose.scan,
      pose.epoch,
      Blob{bytes},
      static_cast<int>(pose.origin),
      pose.report.aligned,
      pose.report.message,
      pose.report.overlap,
      pose.report.rms_m,
      pose.report.iterations);
}

absl::Status SqliteWriter::PutProfile(absl::string_view name, const RobotProfile& profile) {
  return RunSql(
      "INSERT OR REPLACE INTO truth_profile (name, radius_m, height_m, max_step_m, max_slope_rad, "
      "max_gap_m, max_roughness_m) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7)",
      name,
      profile.radius_m,
      profile.height_m,
      profile.max_step_m,
      profile.max_slope_rad,
      profile.max_gap_m,
      profile.max_roughness_m);
}

absl::Status SqliteWriter::PutJob(const JobInfo& job) {
  STRATA_RETURN_IF_ERROR(DeleteJob(job.id));
  STRATA_RETURN_IF_ERROR(
      RunSql("INSERT INTO truth_job (id, kind, state, progress, phase, message, "
             "created_us, updated_us) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8)",
             job.id,
             job.kind,
             static_cast<int>(job.state),
             job.progress,
             job.phase,
             job.message,
             absl::ToUnixMicros(job.created),
             absl::ToUnixMicros(job.updated)));
  for (const auto& [name, value] : job.parameters) {
    STRATA_RETURN_IF_ERROR(
        RunSql("INSERT INTO truth_job_parameter (job, name, value) VALUES (?1, ?2, ?3)",
               job.id,
               name,
               value));
  }
  for (const auto& [name, value] : job.metrics) {
    STRATA_RETURN_IF_ERROR(
        RunSql("INSERT INTO truth_job_metric (job, name, value) VALUES (?1, ?2, ?3)",
               job.id,
               name,
               value));
  }
  return absl::OkStatus();
}

}  // namespace strata
