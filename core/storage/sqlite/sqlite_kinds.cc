// Kinds of things: the library, which is truth, and what a job found.
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

#include "core/common/status.h"
#include "core/storage/sqlite/sqlite_reader.h"
#include "core/storage/sqlite/sqlite_writer.h"

namespace strata {
namespace {

absl::Status KindExists(const absl::Status& put, absl::string_view name) {
  if (!absl::IsAlreadyExists(put)) return put;
  return absl::AlreadyExistsError(
      absl::StrCat("kind ", name, " exists, or another has its shape; see kind list"));
}

}  // namespace

absl::StatusOr<std::vector<KindRow>> SqliteReader::ListKinds() {
  STRATA_ASSIGN_OR_RETURN(
      Statement row,
      database_.Prepare("SELECT id, name, info, 1 FROM truth_kind UNION ALL SELECT id, '', info, 0 "
                        "FROM derived_kind WHERE id NOT IN (SELECT id FROM truth_kind) "
                        "ORDER BY 4 DESC, 1"));
  std::vector<KindRow> kinds;
  STRATA_RETURN_IF_ERROR(ForEachRow(row, [&] {
    kinds.push_back({row.Unsigned(0), row.Text(1), row.Int(3) == 1, row.Text(2)});
    return absl::OkStatus();
  }));
  return kinds;
}

absl::StatusOr<std::optional<std::string>> SqliteReader::FindKindShape(std::uint64_t id) {
  STRATA_ASSIGN_OR_RETURN(
      Statement row,
      database_.Prepare("SELECT shape, 0 FROM truth_kind WHERE id = ?1 UNION ALL SELECT shape, 1 "
                        "FROM derived_kind WHERE id = ?1 ORDER BY 2 LIMIT 1"));
  row.Bind(id);
  STRATA_ASSIGN_OR_RETURN(const bool found, row.Step());
  if (!found) return std::optional<std::string>();
  return std::optional<std::string>(row.Text(0));
}

absl::Status SqliteWriter::PutKind(const KindRow& row, absl::string_view shape) {
  return KindExists(RunSql("INSERT INTO truth_kind (id, name, info, shape) VALUES (?1, ?2, ?3, ?4)",
                           row.id,
                           row.name,
                           Blob{row.info},
                           Blob{shape}),
                    row.name);
}

absl::Status SqliteWriter::RenameKind(std::uint64_t id, absl::string_view name) {
  return KindExists(RunSql("UPDATE truth_kind SET name = ?2 WHERE id = ?1", id, name), name);
}

absl::Status SqliteWriter::DeleteKind(std::uint64_t id) {
  return RunSql("DELETE FROM truth_kind WHERE id = ?1", id);
}

absl::Status SqliteWriter::PutFoundKind(const KindRow& row, absl::string_view shape) {
  return RunSql("INSERT OR REPLACE INTO derived_kind (id, info, shape) VALUES (?1, ?2, ?3)",
                row.id,
                Blob{row.info},
                Blob{shape});
}

}  // namespace strata
