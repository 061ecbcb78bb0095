// What was under way, for the case that the process dies of it.
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/common/status.h"
#include "core/storage/rows.h"
#include "core/storage/sqlite/database.h"
#include "core/storage/sqlite/sqlite_reader.h"
#include "core/storage/sqlite/sqlite_writer.h"

namespace strata {

absl::StatusOr<std::vector<Attempt>> SqliteReader::ListAttempts() {
  STRATA_ASSIGN_OR_RETURN(
      Statement row,
      database_.Prepare("SELECT kind, id, deaths, under_way FROM attempt ORDER BY kind, id"));
  std::vector<Attempt> attempts;
  STRATA_RETURN_IF_ERROR(ForEachRow(row, [&] {
    attempts.push_back(ReadAttempt(row));
    return absl::OkStatus();
  }));
  return attempts;
}

absl::Status SqliteWriter::PutAttempt(const Attempt& attempt) {
  return RunSql(
      "INSERT OR REPLACE INTO attempt (kind, id, deaths, under_way) VALUES (?1, ?2, ?3, ?4)",
      static_cast<int>(attempt.work.kind),
      attempt.work.id,
      attempt.deaths,
      attempt.under_way);
}

absl::Status SqliteWriter::DeleteAttempt(const WorkId& work) {
  return RunSql(
      "DELETE FROM attempt WHERE kind = ?1 AND id = ?2", static_cast<int>(work.kind), work.id);
}

absl::Status SqliteWriter::DeleteJob(std::uint64_t id) {
  STRATA_RETURN_IF_ERROR(RunSql("DELETE FROM truth_job WHERE id = ?1", id));
  STRATA_RETURN_IF_ERROR(RunSql("DELETE FROM truth_job_parameter WHERE job = ?1", id));
  return RunSql("DELETE FROM truth_job_metric WHERE job = ?1", id);
}

}  // namespace strata
