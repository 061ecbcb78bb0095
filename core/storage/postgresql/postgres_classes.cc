// Truth about what things are: classes, labels, classifiers, kinds.
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"

#include "core/common/status.h"
#include "core/storage/postgresql/postgres_reader.h"
#include "core/storage/postgresql/postgres_writer.h"
#include "core/storage/rows.h"

namespace strata {
namespace {

constexpr std::size_t kPieceBytes = std::size_t{1} << 20;

absl::Status KindExists(absl::string_view name) {
  return absl::AlreadyExistsError(
      absl::StrCat("kind ", name, " exists, or another has its shape; see kind list"));
}

}  // namespace

absl::StatusOr<std::vector<MapClass>> PostgresReader::ListClasses() {
  STRATA_ASSIGN_OR_RETURN(
      Rows row, Ask("SELECT id, name, colour FROM truth_class WHERE map = $1 ORDER BY id"));
  std::vector<MapClass> classes;
  while (row.Next()) classes.push_back(ReadMapClass(row));
  return classes;
}

absl::StatusOr<std::optional<std::string>> PostgresReader::FindLabels(ScanNumber number,
                                                                      LabelOrigin origin,
                                                                      std::uint32_t piece) {
  return AskForBytes(
      Ask("SELECT bytes FROM truth_label WHERE map = $1 AND scan = $2 AND origin = $3 AND piece = "
          "$4 AND length(bytes) <= 1048576",
          number,
          static_cast<int>(origin),
          piece));
}

absl::StatusOr<std::vector<ClassifierInfo>> PostgresReader::ListClassifiers() {
  std::vector<ClassifierInfo> classifiers;
  const absl::Status listed = OneState([&]() -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(
        Rows row,
        Ask("SELECT " STRATA_CLASSIFIER_COLUMNS " FROM truth_model WHERE map = $1 ORDER BY id"));
    std::map<std::uint64_t, std::size_t> by_id;
    while (row.Next()) {
      classifiers.push_back(ReadClassifier(row));
      by_id[classifiers.back().id] = classifiers.size() - 1;
    }
    STRATA_ASSIGN_OR_RETURN(
        Rows parameter, Ask("SELECT model, name, value FROM truth_model_parameter WHERE map = $1"));
    while (parameter.Next()) {
      const auto at = by_id.find(parameter.Unsigned(0));
      if (at == by_id.end()) continue;
      classifiers[at->second].parameters[parameter.Text(1)] = parameter.Text(2);
    }
    STRATA_ASSIGN_OR_RETURN(Rows score,
                            Ask("SELECT model, name, value FROM truth_model_score WHERE map = $1"));
    while (score.Next()) {
      const auto at = by_id.find(score.Unsigned(0));
      if (at != by_id.end()) classifiers[at->second].scores[score.Text(1)] = score.Real(2);
    }
    return absl::OkStatus();
  });
  STRATA_RETURN_IF_ERROR(listed);
  return classifiers;
}

absl::StatusOr<std::string> PostgresReader::GetClassifier(std::uint64_t id) {
  STRATA_ASSIGN_OR_RETURN(
      Rows row,
      Ask("SELECT bytes FROM truth_model_piece WHERE map = $1 AND model = $2 ORDER BY piece", id));
  std::string bytes;
  while (row.Next()) {
    const absl::string_view piece = row.Bytes(0);
    bytes.append(piece.data(), piece.size());
  }
  return bytes;
}

// The map's row is locked: nobody takes the name between the two statements.
absl::Status PostgresWriter::PutClass(const MapClass& map_class) {
  STRATA_ASSIGN_OR_RETURN(
      const std::uint64_t put,
      Change("INSERT INTO truth_class (map, id, name, colour) SELECT $1, $2, $3, $4 WHERE NOT "
             "EXISTS (SELECT FROM truth_class WHERE map = $1 AND name = $3 AND id <> $2) ON "
             "CONFLICT (map, id) DO UPDATE SET name = $3, colour = $4",
             std::uint32_t{map_class.id},
             map_class.name,
             ColourToColumn(map_class.colour)));
  if (put > 0) return absl::OkStatus();
  return absl::AlreadyExistsError(
      absl::StrCat("class name ", map_class.name, " is another class's; choose another"));
}

absl::Status PostgresWriter::PutLabels(ScanNumber number,
                                       LabelOrigin origin,
                                       std::uint64_t model,
                                       const std::vector<std::string>& pieces) {
  STRATA_RETURN_IF_ERROR(
      RunSql("DELETE FROM truth_label WHERE map = $1 AND scan = $2 AND origin = $3",
             number,
             static_cast<int>(origin)));
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    STRATA_RETURN_IF_ERROR(RunSql(
        "INSERT INTO truth_label (map, scan, origin, piece, bytes) VALUES ($1, $2, $3, $4, $5)",
        number,
        static_cast<int>(origin),
        static_cast<std::uint32_t>(i),
        Bytea{pieces[i]}));
  }
  switch (origin) {
    case LabelOrigin::kPerson:
      return RunSql("UPDATE truth_scan SET person_labels = $3 WHERE map = $1 AND number = $2",
                    number,
                    !pieces.empty());
    case LabelOrigin::kModel:
      return RunSql(
          "UPDATE truth_scan SET label_model = $3 WHERE map = $1 AND number = $2", number, model);
    case LabelOrigin::kFaded:
      return RunSql(
          "UPDATE truth_scan SET faded_points = $3 WHERE map = $1 AND number = $2", number, model);
  }
  return absl::InternalError("store: labels of no origin");
}

absl::StatusOr<std::uint64_t> PostgresWriter::PutClassifier(const ClassifierInfo& info,
                                                            absl::string_view bytes) {
  STRATA_ASSIGN_OR_RETURN(
      const std::uint64_t id,
      Number("UPDATE truth_map SET last_model = last_model + 1 WHERE map = $1 RETURNING "
             "last_model"));
  STRATA_ASSIGN_OR_RETURN(
      const std::uint64_t put,
      Change("INSERT INTO truth_model (map, id, name, created_us, job, description, size_bytes) "
             "VALUES ($1, $2, $3, $4, $5, $6, $7) ON CONFLICT DO NOTHING",
             id,
             info.name,
             absl::ToUnixMicros(info.created),
             info.job,
             info.description,
             static_cast<std::uint64_t>(bytes.size())));
  if (put == 0) {
    return absl::AlreadyExistsError(
        absl::StrCat("classifier ", info.name, " exists; choose another name, or delete it"));
  }
  STRATA_RETURN_IF_ERROR(PutClassifierParts(id, info, bytes));
  return id;
}

absl::Status PostgresWriter::PutClassifierParts(std::uint64_t id,
                                                const ClassifierInfo& info,
                                                absl::string_view bytes) {
  for (const auto& [name, value] : info.parameters) {
    STRATA_RETURN_IF_ERROR(RunSql(
        "INSERT INTO truth_model_parameter (map, model, name, value) VALUES ($1, $2, $3, $4)",
        id,
        name,
        value));
  }
  for (const auto& [name, value] : info.scores) {
    STRATA_RETURN_IF_ERROR(
        RunSql("INSERT INTO truth_model_score (map, model, name, value) VALUES ($1, $2, $3, $4)",
               id,
               name,
               value));
  }
  for (std::uint32_t piece = 0; piece * kPieceBytes < bytes.size(); ++piece) {
    STRATA_RETURN_IF_ERROR(
        RunSql("INSERT INTO truth_model_piece (map, model, piece, bytes) VALUES ($1, $2, $3, $4)",
               id,
               piece,
               Bytea{bytes.substr(piece * kPieceBytes, kPieceBytes)}));
  }
  return absl::OkStatus();
}

absl::Status PostgresWriter::DeleteClassifier(std::uint64_t id) {
  return RunAll({"DELETE FROM truth_model_parameter WHERE map = $1 AND model = $2",
                 "DELETE FROM truth_model_score WHERE map = $1 AND model = $2",
                 "DELETE FROM truth_model_piece WHERE map = $1 AND model = $2",
                 "DELETE FROM truth_model WHERE map = $1 AND id = $2"},
                id);
}

absl::Status PostgresWriter::PutKind(const KindRow& row, absl::string_view shape) {
  STRATA_ASSIGN_OR_RETURN(
      const std::uint64_t put,
      Change("INSERT INTO truth_kind (map, id, name, info, shape) VALUES ($1, $2, $3, $4, $5) ON "
             "CONFLICT DO NOTHING",
             row.id,
             row.name,
             Bytea{row.info},
             Bytea{shape}));
  return put > 0 ? absl::OkStatus() : KindExists(row.name);
}

absl::Status PostgresWriter::RenameKind(std::uint64_t id, absl::string_view name) {
  STRATA_ASSIGN_OR_RETURN(
      const std::uint64_t others,
      Number(
          "SELECT count(*) FROM truth_kind WHERE map = $1 AND name = $3 AND id <> $2", id, name));
  if (others > 0) return KindExists(name);
  return RunSql("UPDATE truth_kind SET name = $3 WHERE map = $1 AND id = $2", id, name);
}

absl::Status PostgresWriter::DeleteKind(std::uint64_t id) {
  return RunSql("DELETE FROM truth_kind WHERE map = $1 AND id = $2", id);
}

absl::Status PostgresWriter::PutFoundKind(const KindRow& row, absl::string_view shape) {
  return RunSql(
      "INSERT INTO derived_kind (map, id, info, shape) VALUES ($1, $2, $3, $4) ON CONFLICT (map, "
      "id) DO UPDATE SET info = excluded.info, shape = excluded.shape",
      row.id,
      Bytea{row.info},
      Bytea{shape});
}

}  // namespace strata
