// Truth about what things are: classes, labels, classifiers.
#include <cstddef>
#include <cstdint>
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
#include "core/storage/rows.h"
#include "core/storage/sqlite/database.h"
#include "core/storage/sqlite/sqlite_reader.h"
#include "core/storage/sqlite/sqlite_writer.h"

namespace strata {
namespace {

constexpr std::size_t kPieceBytes = std::size_t{1} << 20;

}  // namespace

absl::StatusOr<std::vector<MapClass>> SqliteReader::ListClasses() {
  STRATA_ASSIGN_OR_RETURN(
      Statement row, database_.Prepare("SELECT id, name, colour FROM truth_class ORDER BY id"));
  std::vector<MapClass> classes;
  STRATA_RETURN_IF_ERROR(ForEachRow(row, [&] {
    classes.push_back(ReadMapClass(row));
    return absl::OkStatus();
  }));
  return classes;
}

absl::Status SqliteWriter::PutOrigin(const GeodeticOrigin& origin) {
  return RunSql(
      "UPDATE truth_map SET has_origin = 1, latitude_rad = ?1, longitude_rad = ?2, altitude_m = ?3 "
      "WHERE id = 1",
      origin.latitude_rad,
      origin.longitude_rad,
      origin.altitude_m);
}

absl::Status SqliteWriter::PutClass(const MapClass& map_class) {
  const absl::Status put = RunSql(
      "INSERT INTO truth_class (id, name, colour) VALUES (?1, ?2, ?3) "
      "ON CONFLICT (id) DO UPDATE SET name = ?2, colour = ?3",
      std::uint32_t{map_class.id},
      map_class.name,
      ColourToColumn(map_class.colour));
  if (!absl::IsAlreadyExists(put)) return put;
  return absl::AlreadyExistsError(
      absl::StrCat("class name ", map_class.name, " is another class's; choose another"));
}

absl::StatusOr<std::optional<std::string>> SqliteReader::FindLabels(ScanNumber number,
                                                                    LabelOrigin origin,
                                                                    std::uint32_t piece) {
  STRATA_ASSIGN_OR_RETURN(
      Statement row,
      database_.Prepare(
          "SELECT bytes FROM truth_label WHERE scan = ?1 AND origin = ?2 AND piece = ?3"));
  row.Bind(number, static_cast<int>(origin), piece);
  STRATA_ASSIGN_OR_RETURN(const bool found, row.Step());
  if (!found) return std::optional<std::string>();
  return std::optional<std::string>(row.Text(0));
}

absl::Status SqliteWriter::PutLabels(ScanNumber number,
                                     LabelOrigin origin,
                                     std::uint64_t model,
                                     const std::vector<std::string>& pieces) {
  STRATA_RETURN_IF_ERROR(RunSql(
      "DELETE FROM truth_label WHERE scan = ?1 AND origin = ?2", number, static_cast<int>(origin)));
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    STRATA_RETURN_IF_ERROR(
        RunSql("INSERT INTO truth_label (scan, origin, piece, bytes) VALUES (?1, ?2, ?3, ?4)",
               number,
               static_cast<int>(origin),
               static_cast<std::uint32_t>(i),
               Blob{pieces[i]}));
  }
  if (origin == LabelOrigin::kPerson) {
    return RunSql(
        "UPDATE truth_scan SET person_labels = ?2 WHERE number = ?1", number, !pieces.empty());
  }
  return origin == LabelOrigin::kModel
             ? RunSql("UPDATE truth_scan SET label_model = ?2 WHERE number = ?1", number, model)
             : RunSql("UPDATE truth_scan SET faded_points = ?2 WHERE number = ?1", number, model);
}

absl::StatusOr<std::vector<ClassifierInfo>> SqliteReader::ListClassifiers() {
  STRATA_ASSIGN_OR_RETURN(
      Statement row,
      database_.Prepare("SELECT " STRATA_CLASSIFIER_COLUMNS " FROM truth_model ORDER BY id"));
  std::vector<ClassifierInfo> classifiers;
  STRATA_RETURN_IF_ERROR(ForEachRow(row, [&]() -> absl::Status {
    classifiers.push_back(ReadClassifier(row));
    return ReadClassifierDetails(classifiers.back());
  }));
  return classifiers;
}

absl::Status SqliteReader::ReadClassifierDetails(ClassifierInfo& info) {
  STRATA_ASSIGN_OR_RETURN(
      Statement parameter,
      database_.Prepare("SELECT name, value FROM truth_model_parameter WHERE model = ?1"));
  parameter.Bind(info.id);
  STRATA_RETURN_IF_ERROR(ForEachRow(parameter, [&] {
    info.parameters[parameter.Text(0)] = parameter.Text(1);
    return absl::OkStatus();
  }));
  STRATA_ASSIGN_OR_RETURN(
      Statement score,
      database_.Prepare("SELECT name, value FROM truth_model_score WHERE model = ?1"));
  score.Bind(info.id);
  return ForEachRow(score, [&] {
    info.scores[score.Text(0)] = score.Real(1);
    return absl::OkStatus();
  });
}

absl::StatusOr<std::string> SqliteReader::GetClassifier(std::uint64_t id) {
  STRATA_ASSIGN_OR_RETURN(
      Statement row,
      database_.Prepare("SELECT bytes FROM truth_model_piece WHERE model = ?1 ORDER BY piece"));
  row.Bind(id);
  std::string bytes;
  STRATA_RETURN_IF_ERROR(ForEachRow(row, [&] {
    const absl::string_view piece = row.Bytes(0);
    bytes.append(piece.data(), piece.size());
    return absl::OkStatus();
  }));
  return bytes;
}

absl::StatusOr<std::uint64_t> SqliteWriter::PutClassifier(const ClassifierInfo& info,
                                                          absl::string_view bytes) {
  const absl::Status put = RunSql(
      "INSERT INTO truth_model (name, created_us, job, description, size_bytes) VALUES (?1, "
      "?2, ?3, ?4, ?5)",
      info.name,
      absl::ToUnixMicros(info.created),
      info.job,
      info.description,
      static_cast<std::uint64_t>(bytes.size()));
  if (absl::IsAlreadyExists(put)) {
    return absl::AlreadyExistsError(
        absl::StrCat("classifier ", info.name, " exists; choose another name, or delete it"));
  }
  STRATA_RETURN_IF_ERROR(put);
  STRATA_ASSIGN_OR_RETURN(const std::int64_t id, database_.Pragma("SELECT last_insert_rowid()"));
  for (const auto& [name, value] : info.parameters) {
    STRATA_RETURN_IF_ERROR(
        RunSql("INSERT INTO truth_model_parameter (model, name, value) VALUES (?1, ?2, ?3)",
               id,
               name,
               value));
  }
  for (const auto& [name, value] : info.scores) {
    STRATA_RETURN_IF_ERROR(RunSql(
        "INSERT INTO truth_model_score (model, name, value) VALUES (?1, ?2, ?3)", id, name, value));
  }
  for (std::uint32_t piece = 0; piece * kPieceBytes < bytes.size(); ++piece) {
    STRATA_RETURN_IF_ERROR(
        RunSql("INSERT INTO truth_model_piece (model, piece, bytes) VALUES (?1, ?2, ?3)",
               id,
               piece,
               Blob{bytes.substr(piece * kPieceBytes, kPieceBytes)}));
  }
  return static_cast<std::uint64_t>(id);
}

absl::Status SqliteWriter::DeleteClassifier(std::uint64_t id) {
  for (const char* sql : {"DELETE FROM truth_model_parameter WHERE model = ?1",
                          "DELETE FROM truth_model_score WHERE model = ?1",
                          "DELETE FROM truth_model_piece WHERE model = ?1",
                          "DELETE FROM truth_model WHERE id = ?1"}) {
    STRATA_RETURN_IF_ERROR(RunSql(sql, id));
  }
  return absl::OkStatus();
}

}  // namespace strata
