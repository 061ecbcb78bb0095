// Transactions, and truth about scans and jobs; postgres_posegraph.cc, postgres_classes.cc and
// postgres_tile_writer.cc have the rest.
#include "core/storage/postgresql/postgres_writer.h"

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/cleanup/cleanup.h"
#include "absl/functional/function_ref.h"
#include "absl/random/random.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "absl/types/span.h"

#include "core/common/retry_delay.h"
#include "core/common/status.h"
#include "core/storage/outcome.h"
#include "core/storage/postgresql/connection.h"
#include "core/storage/postgresql/map_leases.h"
#include "core/world/job.h"
#include "core/world/value_codec.h"

namespace strata {
namespace {

constexpr int kMostRuns = 6;
constexpr absl::Duration kFirstPause = absl::Milliseconds(10);
// As long as a server takes to come back from its log, or a replica to take its place.
constexpr absl::Duration kLongestLook = absl::Seconds(60);
constexpr absl::Duration kPauseBetweenLooks = absl::Milliseconds(200);

std::int64_t NumberOfCommit() {
  absl::BitGen random;
  return absl::Uniform<std::int64_t>(random, 1, std::int64_t{1} << 62);
}

// Longer each time, and of no two writers the same.
void PauseBeforeRun(int run) {
  absl::BitGen random;
  const double share = absl::Uniform(random, 0.5, 1.5);
  absl::SleepFor(kFirstPause * (1 << run) * share);
}

}  // namespace

// Whoever is frozen in a commit holds the map's row, for which his successor waits.
std::string BeginOf(const OpenedMap& map) {
  if (map.owner == 0 && map.beside == 0) return "BEGIN";
  return absl::StrCat("BEGIN; SET LOCAL idle_in_transaction_session_timeout = ",
                      absl::ToInt64Milliseconds(map.patience));
}

absl::Status CheckOwner(absl::StatusOr<Rows>& owner, const OpenedMap& map) {
  STRATA_RETURN_IF_ERROR(owner.status());
  const bool there = owner->Next();
  if (there && (map.owner == 0 || !map.fenced || owner->Int(0) == map.owner)) {
    return absl::OkStatus();
  }
  return TakenAway(absl::StrCat("store: map ",
                                map.name,
                                there ? " was opened by another process" : " was removed",
                                " while it was open: nothing more is taken into it here"));
}

absl::Status PostgresWriter::Commit(Durability durability, absl::FunctionRef<absl::Status()> body) {
  for (int run = 1;; ++run) {
    bool again = false;
    const absl::Status done = CommitOnce(durability, body, again);
    if (done.ok() || !again) return done;
    if (run == kMostRuns) {
      if (absl::IsUnavailable(done)) return done;
      return absl::AbortedError(absl::StrCat(
          done.message(), "; others were in the way ", kMostRuns, " times: try again"));
    }
    PauseBeforeRun(run);
  }
}

absl::Status PostgresWriter::CommitOnce(Durability durability,
                                        absl::FunctionRef<absl::Status()> body,
                                        bool& again) {
  if (connection_ != nullptr) return absl::InternalError("store: a commit within a commit");
  STRATA_ASSIGN_OR_RETURN(const ConnectionPool::Lease lease, pool_->Take());
  // Whatever ends this, an exception too: a connection that is in a transaction is closed with it.
  const absl::Cleanup let_go = [this] {
    reader_.ReadThrough(nullptr);
    connection_ = nullptr;
  };
  connection_ = &*lease;
  reader_.ReadThrough(connection_);
  durability_ = durability;
  broken_ = absl::OkStatus();
  const bool numbered = alone() || (durability == Durability::kFull && opened_.beside == 0);
  const std::int64_t commit = numbered ? NumberOfCommit() : 0;
  absl::Status done = LockMap(durability, commit);
  again = !done.ok() && lease->IsBroken();  // the server had hung up before
  if (done.ok()) done = RunBody(body);
  if (done.ok() && !lease->may_be_redone()) {
    done = EndCommit(commit, again);
  } else if (!lease->IsBroken()) {
    lease->Execute("ROLLBACK").IgnoreError();
  }
  again = again || (lease->may_be_redone() && !lease->IsBroken());
  if (done.ok() && again) done = absl::AbortedError("store: a part met another's commit");
  lease->ForgetError();
  return done;
}

absl::Status PostgresWriter::LockMap(Durability durability, std::int64_t commit) {
  const bool relaxed = durability == Durability::kRelaxed;
  STRATA_RETURN_IF_ERROR(connection_->Execute(
      relaxed ? absl::StrCat(begin_, "; SET LOCAL synchronous_commit = off").c_str()
              : begin_.c_str()));
  if (alone()) return LockOwnMap(commit);
  if (opened_.beside > 0) return LockOthersMap(relaxed);
  absl::StatusOr<Rows> owner =
      relaxed ? connection_->Query("SELECT owner FROM truth_map WHERE map = $1 FOR KEY SHARE", map_)
              : connection_->Query(
                    "UPDATE truth_map SET last_commit = $2 WHERE map = $1 RETURNING owner",
                    map_,
                    commit);
  STRATA_RETURN_IF_ERROR(CheckOwner(owner, opened_));
  // Whoever takes it now waits for the row that this commit holds.
  return opened_.idle ? CheckNobodyHas(*connection_, map_, opened_.name) : absl::OkStatus();
}

absl::Status PostgresWriter::LockOthersMap(bool relaxed) {
  absl::StatusOr<Rows> owner =
      relaxed ? connection_->Query("SELECT owner FROM truth_map WHERE map = $1 FOR KEY SHARE", map_)
              : connection_->Query("SELECT owner FROM truth_map WHERE map = $1 FOR NO KEY UPDATE",
                                   map_);
  STRATA_RETURN_IF_ERROR(CheckOwner(owner, opened_));
  return opened_.run_by.empty() ? absl::OkStatus() : CheckRunsJob();
}

absl::Status PostgresWriter::CheckRunsJob() {
  STRATA_ASSIGN_OR_RETURN(
      Rows row,
      connection_->Query(
          "SELECT 1 FROM truth_job_parameter WHERE map = $1 AND job = $2 AND name = $3 "
          "AND value = $4",
          map_,
          opened_.job,
          absl::string_view(kRunBy),
          opened_.run_by));
  if (row.Next()) return absl::OkStatus();
  return TakenAway(absl::StrCat(
      "map ", opened_.name, ": job ", opened_.job, " is not run by this server any more"));
}

absl::Status PostgresWriter::LockOwnMap(std::int64_t commit) {
  absl::StatusOr<Rows> row = connection_->Query(
      "UPDATE truth_map AS m SET last_commit = $2 FROM (SELECT last_commit FROM truth_map WHERE "
      "map = $1 FOR NO KEY UPDATE) AS before WHERE m.map = $1 RETURNING m.owner, "
      "before.last_commit",
      map_,
      commit);
  STRATA_RETURN_IF_ERROR(CheckOwner(row, opened_));
  if (!opened_.fenced || !last_commit_.has_value() || row->Int(1) == *last_commit_) {
    return absl::OkStatus();
  }
  return OutcomeUnknown(
      absl::StrCat("store: what was written to map ", opened_.name, " last is not there any more"));
}

absl::Status PostgresWriter::RunBody(absl::FunctionRef<absl::Status()> body) {
  STRATA_RETURN_IF_ERROR(body());
  // A body that goes on after an error has nothing left to commit.
  if (!connection_->InFailedTransaction() && !connection_->IsBroken()) return absl::OkStatus();
  return broken_.ok() ? absl::InternalError("store: the transaction has failed") : broken_;
}

// The server may wait for its replica as long as it takes: a statement's time that ran out would
// end the wait, not the commit.
absl::Status PostgresWriter::EndCommit(std::int64_t commit, bool& again) {
  const absl::Status committed = connection_->Execute("SET LOCAL statement_timeout = 0; COMMIT");
  if (!committed.ok() && !connection_->IsBroken()) return committed;
  const absl::StatusOr<bool> there = committed.ok() ? absl::StatusOr<bool>(true)
                                     : commit == 0  ? absl::UnknownError("a relaxed commit")
                                                    : WasCommitted(commit);
  if (there.ok() && *there) {
    if (alone()) last_commit_ = commit;
    return absl::OkStatus();
  }
  again = there.ok();
  if (again) return committed;
  last_commit_.reset();
  return OutcomeUnknown(absl::StrCat(committed.message(), ", in a commit"));
}

absl::StatusOr<bool> PostgresWriter::WasCommitted(std::int64_t commit) {
  const absl::Time end = absl::Now() + kLongestLook;
  while (true) {
    const absl::StatusOr<bool> there = LookForCommit(commit);
    const bool away =
        absl::IsUnavailable(there.status()) || absl::IsResourceExhausted(there.status());
    if (!away || absl::Now() >= end) return there;
    absl::SleepFor(kPauseBetweenLooks);
  }
}

// The lock waits for the commit, should the server still be at it. Whoever has the map alone knows
// that nobody else has committed since.
absl::StatusOr<bool> PostgresWriter::LookForCommit(std::int64_t commit) {
  STRATA_ASSIGN_OR_RETURN(const ConnectionPool::Lease lease, pool_->Take());
  STRATA_ASSIGN_OR_RETURN(
      Rows row,
      lease->Query("SELECT last_commit, owner FROM truth_map WHERE map = $1 FOR NO KEY UPDATE",
                   map_));
  if (!row.Next()) return absl::UnknownError("the map was removed");
  if (row.Int(0) == commit) return true;
  if (alone() && row.Int(1) == opened_.owner) return false;
  return absl::UnknownError("others have written since");
}

absl::Status PostgresWriter::Part(absl::FunctionRef<absl::Status()> body) {
  if (connection_ == nullptr) return absl::InternalError("store: a part outside a commit");
  STRATA_RETURN_IF_ERROR(broken_);
  STRATA_RETURN_IF_ERROR(connection_->Execute("SAVEPOINT part"));
  absl::Status done = body();
  if (done.ok() && connection_->InFailedTransaction()) done = broken_;
  if (done.ok()) return connection_->Execute("RELEASE part");
  const absl::Status undone = connection_->Execute("ROLLBACK TO part; RELEASE part");
  broken_ = undone.ok() ? absl::OkStatus() : done;
  return done;
}

absl::Status PostgresWriter::RunAll(absl::Span<const char* const> statements,
                                    std::uint64_t number) {
  for (const char* sql : statements) STRATA_RETURN_IF_ERROR(RunSql(sql, number));
  return absl::OkStatus();
}

absl::StatusOr<std::uint64_t> PostgresWriter::NextCommitSequence() {
  if (durability_ != Durability::kFull) {
    return absl::InternalError("store: a number from a commit that may be lost");
  }
  return Number(
      "UPDATE truth_map SET commit_sequence = commit_sequence + 1 WHERE map = $1 RETURNING "
      "commit_sequence");
}

absl::Status PostgresWriter::PutChunk(std::uint64_t upload,
                                      std::uint32_t ordinal,
                                      absl::string_view bytes) {
  return RunSql("INSERT INTO truth_chunk (map, upload, ordinal, bytes) VALUES ($1, $2, $3, $4)",
                upload,
                ordinal,
                Bytea{bytes});
}

absl::Status PostgresWriter::KeepUpload(const UnfinishedUpload& upload) {
  return RunSql(
      "INSERT INTO truth_upload (map, upload, trajectory, sequence, content_hash, touched_us) "
      "VALUES ($1, $2, $3, $4, $5, $6) ON CONFLICT (map, upload) DO UPDATE SET touched_us = "
      "excluded.touched_us",
      upload.upload,
      upload.id.trajectory,
      upload.id.sequence,
      upload.content_hash,
      absl::ToUnixMicros(upload.touched));
}

absl::Status PostgresWriter::AbandonUpload(std::uint64_t upload) {
  STRATA_RETURN_IF_ERROR(RunSql("DELETE FROM truth_upload WHERE map = $1 AND upload = $2", upload));
  return RunSql(
      "DELETE FROM truth_chunk AS c WHERE c.map = $1 AND c.upload = $2 AND NOT EXISTS (SELECT FROM "
      "truth_scan AS s WHERE s.map = $1 AND s.upload = $2)",
      upload);
}

absl::Status PostgresWriter::AbandonOrphans() {
  return RunSql(
      "DELETE FROM truth_chunk AS c WHERE c.map = $1 AND NOT EXISTS (SELECT FROM truth_scan AS s "
      "WHERE s.map = $1 AND s.upload = c.upload) AND NOT EXISTS (SELECT FROM truth_upload AS u "
      "WHERE u.map = $1 AND u.upload = c.upload)");
}

// The next to have the map alone clears away what belongs to no scan, and no number tells of a
// relaxed commit here that the store's end took with it.
absl::Status PostgresWriter::CheckAdded(const ScanRecord& scan) {
  absl::StatusOr<Rows> found = connection_->Query(
      "SELECT (SELECT count(*) FROM truth_chunk WHERE map = $1 AND upload = $2), (SELECT count(*) "
      "FROM (SELECT FROM truth_scan WHERE map = $1 AND state = $3 LIMIT $4) AS waiting)",
      map_,
      scan.upload,
      static_cast<int>(ScanState::kPending),
      opened_.beside);
  if (!found.ok() && broken_.ok()) broken_ = found.status();
  STRATA_RETURN_IF_ERROR(found.status());
  found->Next();
  if (found->Unsigned(0) != scan.chunks) {
    return WithRetryDelay(absl::UnavailableError("store: pieces of the scan were cleared away by "
                                                 "another process; send it again"),
                          absl::ZeroDuration());
  }
  if (found->Unsigned(1) < opened_.beside) return absl::OkStatus();
  return WithRetryDelay(
      absl::ResourceExhaustedError(absl::StrCat(
          "map ", opened_.name, ": ", opened_.beside, " scans wait for integration; retry later")),
      absl::Seconds(1));
}

// A conflict is no error of the transaction, so that its caller may go on as with other stores.
absl::Status PostgresWriter::PutScan(const ScanRecord& scan) {
  if (opened_.beside > 0) STRATA_RETURN_IF_ERROR(CheckAdded(scan));
  const bool has_box = !scan.box_scan.isEmpty();
  const Eigen::Vector3d low = has_box ? Eigen::Vector3d(scan.box_scan.min().cast<double>())
                                      : Eigen::Vector3d(Eigen::Vector3d::Zero());
  const Eigen::Vector3d high = has_box ? Eigen::Vector3d(scan.box_scan.max().cast<double>())
                                       : Eigen::Vector3d(Eigen::Vector3d::Zero());
  const std::string header = EncodeScanHeader(scan.header);
  STRATA_ASSIGN_OR_RETURN(
      const std::uint64_t put,
      Change("INSERT INTO truth_scan (map, number, trajectory, sequence, time_us, header, points, "
             "state, upload, chunks, has_points, point_bytes, has_box, min_x, min_y, min_z, max_x, "
             "max_y, max_z, content_hash, message) VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, "
             "$10, $11, $12, $13, $14, $15, $16, $17, $18, $19, $20, $21) ON CONFLICT DO NOTHING",
             scan.number,
             scan.header.id.trajectory,
             scan.header.id.sequence,
             absl::ToUnixMicros(scan.header.time),
             Bytea{header},
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
             scan.message));
  if (put == 0) {
    return absl::AlreadyExistsError(absl::StrCat("scan ", scan.header.id.ToString(), " exists"));
  }
  return RunSql("DELETE FROM truth_upload WHERE map = $1 AND upload = $2", scan.upload);
}

absl::Status PostgresWriter::SetScanState(ScanNumber number,
                                          ScanState state,
                                          absl::string_view message) {
  return RunSql("UPDATE truth_scan SET state = $3, message = $4 WHERE map = $1 AND number = $2",
                number,
                static_cast<int>(state),
                message);
}

absl::Status PostgresWriter::DropPoints(ScanNumber number, absl::string_view local_map) {
  STRATA_RETURN_IF_ERROR(
      RunSql("INSERT INTO truth_local_map (map, scan, bytes) VALUES ($1, $2, $3) ON CONFLICT (map, "
             "scan) DO UPDATE SET bytes = excluded.bytes",
             number,
             Bytea{local_map}));
  return RunAll({"DELETE FROM truth_chunk WHERE map = $1 AND upload = (SELECT upload FROM "
                 "truth_scan WHERE map = $1 AND number = $2)",
                 "DELETE FROM truth_label WHERE map = $1 AND scan = $2",
                 "UPDATE truth_scan SET chunks = 0, has_points = 0, point_bytes = 0 WHERE map = $1 "
                 "AND number = $2"},
                number);
}

absl::Status PostgresWriter::DeleteScan(ScanNumber number) {
  return RunAll(
      {"DELETE FROM truth_chunk WHERE map = $1 AND upload = (SELECT upload FROM truth_scan WHERE "
       "map = $1 AND number = $2)",
       "DELETE FROM truth_label WHERE map = $1 AND scan = $2",
       "DELETE FROM truth_local_map WHERE map = $1 AND scan = $2",
       "DELETE FROM truth_pose WHERE map = $1 AND scan = $2",
       "DELETE FROM truth_proposed_pose WHERE map = $1 AND scan = $2",
       "DELETE FROM truth_constraint WHERE map = $1 AND (scan_i = $2 OR scan_j = $2)",
       "DELETE FROM truth_plane_support WHERE map = $1 AND scan = $2",
       "DELETE FROM derived_entity WHERE map = $1 AND part IN (SELECT part FROM "
       "derived_entity_scan WHERE map = $1 AND scan = $2) AND part NOT IN (SELECT part FROM "
       "derived_entity_scan WHERE map = $1 AND scan <> $2)",
       "DELETE FROM derived_entity_scan WHERE map = $1 AND scan = $2",
       "DELETE FROM derived_inferred WHERE map = $1 AND kind IN (SELECT kind FROM "
       "derived_inferred_scan WHERE map = $1 AND scan = $2)",
       "DELETE FROM derived_inferred_scan WHERE map = $1 AND scan = $2",
       "DELETE FROM derived_scan_view WHERE map = $1 AND scan = $2",
       "DELETE FROM derived_scan_tile WHERE map = $1 AND scan = $2",
       "DELETE FROM derived_footprint WHERE map = $1 AND scan = $2",
       "DELETE FROM derived_scan_cell WHERE map = $1 AND scan = $2",
       "DELETE FROM truth_scan WHERE map = $1 AND number = $2"},
      number);
}

absl::Status PostgresWriter::PutProfile(absl::string_view name, const RobotProfile& profile) {
  return RunSql(
      "INSERT INTO truth_profile (map, name, radius_m, height_m, max_step_m, max_slope_rad, "
      "max_gap_m, max_roughness_m) VALUES ($1, $2, $3, $4, $5, $6, $7, $8) ON CONFLICT (map, name) "
      "DO UPDATE SET radius_m = $3, height_m = $4, max_step_m = $5, max_slope_rad = $6, max_gap_m "
      "= $7, max_roughness_m = $8",
      name,
      profile.radius_m,
      profile.height_m,
      profile.max_step_m,
      profile.max_slope_rad,
      profile.max_gap_m,
      profile.max_roughness_m);
}

absl::Status PostgresWriter::PutOrigin(const GeodeticOrigin& origin) {
  return RunSql(
      "UPDATE truth_map SET has_origin = 1, latitude_rad = $2, longitude_rad = $3, altitude_m = $4 "
      "WHERE map = $1",
      origin.latitude_rad,
      origin.longitude_rad,
      origin.altitude_m);
}

absl::Status PostgresWriter::PutJob(const JobInfo& job) {
  STRATA_RETURN_IF_ERROR(DeleteJob(job.id));
  STRATA_RETURN_IF_ERROR(
      RunSql("INSERT INTO truth_job (map, id, kind, state, progress, phase, message, created_us, "
             "updated_us) VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9)",
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
        RunSql("INSERT INTO truth_job_parameter (map, job, name, value) VALUES ($1, $2, $3, $4)",
               job.id,
               name,
               value));
  }
  for (const auto& [name, value] : job.metrics) {
    STRATA_RETURN_IF_ERROR(
        RunSql("INSERT INTO truth_job_metric (map, job, name, value) VALUES ($1, $2, $3, $4)",
               job.id,
               name,
               value));
  }
  return absl::OkStatus();
}

absl::Status PostgresWriter::DeleteJob(std::uint64_t id) {
  return RunAll({"DELETE FROM truth_job WHERE map = $1 AND id = $2",
                 "DELETE FROM truth_job_parameter WHERE map = $1 AND job = $2",
                 "DELETE FROM truth_job_metric WHERE map = $1 AND job = $2"},
                id);
}

absl::Status PostgresWriter::PutAttempt(const Attempt& attempt) {
  return RunSql(
      "INSERT INTO attempt (map, kind, id, deaths, under_way) VALUES ($1, $2, $3, $4, $5) ON "
      "CONFLICT (map, kind, id) DO UPDATE SET deaths = $4, under_way = $5",
      static_cast<int>(attempt.work.kind),
      attempt.work.id,
      attempt.deaths,
      attempt.under_way);
}

absl::Status PostgresWriter::DeleteAttempt(const WorkId& work) {
  return RunSql("DELETE FROM attempt WHERE map = $1 AND kind = $2 AND id = $3",
                static_cast<int>(work.kind),
                work.id);
}

}  // namespace strata
