// Edits that are asked for beside who has a map, and his answers.
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/cord.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"

#include "core/codec/bytes.h"
#include "core/common/retry_delay.h"
#include "core/common/status.h"
#include "core/storage/postgresql/postgres_reader.h"
#include "core/storage/postgresql/postgres_writer.h"

namespace strata {
namespace {

void PutBytes(std::string& out, absl::string_view bytes) {
  PutVarint(out, bytes.size());
  out.append(bytes.data(), bytes.size());
}

std::string TakeBytes(ByteReader& reader) { return std::string(reader.Take(reader.Varint())); }

// Code and message, then payloads: type and value each. Not as text: a message may be no UTF-8.
std::string EncodeAnswer(const absl::Status& answer) {
  std::string bytes;
  PutVarint(bytes, static_cast<std::uint64_t>(answer.code()));
  PutBytes(bytes, answer.message());
  answer.ForEachPayload([&bytes](absl::string_view type, const absl::Cord& value) {
    PutBytes(bytes, type);
    PutBytes(bytes, std::string(value));
  });
  return bytes;
}

absl::StatusOr<std::optional<absl::Status>> DecodeAnswer(absl::string_view bytes) {
  ByteReader reader(bytes);
  const auto code = static_cast<absl::StatusCode>(reader.Varint());
  absl::Status answer(code, TakeBytes(reader));
  while (reader.ok() && reader.remaining() > 0) {
    const std::string type = TakeBytes(reader);
    answer.SetPayload(type, absl::Cord(TakeBytes(reader)));
  }
  if (!reader.ok()) return absl::DataLossError("store: the answer to an edit cannot be read");
  return std::optional<absl::Status>(std::move(answer));
}

}  // namespace

absl::StatusOr<std::optional<EditRequest>> PostgresReader::FindEdit(std::uint64_t after,
                                                                    std::uint64_t until) {
  STRATA_ASSIGN_OR_RETURN(
      Rows row,
      Ask("SELECT number, kind, trajectory, sequence, value, begun FROM map_edit WHERE map = $1 "
          "AND "
          "number > $2 AND number <= $3 AND answer IS NULL AND kind <> $4 AND made > "
          "clock_timestamp() - interval '1 hour' ORDER BY number LIMIT 1",
          after,
          until,
          static_cast<int>(EditKind::kDeleteMap)));
  if (!row.Next()) return std::nullopt;
  EditRequest edit;
  edit.number = row.Unsigned(0);
  edit.kind = static_cast<EditKind>(row.Int(1));
  edit.scan = {row.Text(2), row.Unsigned(3)};
  edit.value = std::string(row.Bytes(4));
  edit.begun = static_cast<std::uint32_t>(row.Unsigned(5));
  return edit;
}

absl::StatusOr<std::uint64_t> PostgresReader::LastEdit() {
  return AskForNumber(
      Ask("SELECT max(number) FROM map_edit WHERE map = $1 AND answer IS NULL AND kind <> $2",
          static_cast<int>(EditKind::kDeleteMap)));
}

absl::StatusOr<std::optional<absl::Status>> PostgresReader::FindAnswer(std::uint64_t edit) {
  STRATA_ASSIGN_OR_RETURN(
      Rows row,
      Ask("SELECT answer IS NOT NULL, answer FROM map_edit WHERE map = $1 AND number = $2", edit));
  if (!row.Next()) return NoEdit(edit);
  if (!row.Bool(0)) return std::nullopt;
  return DecodeAnswer(row.Bytes(1));
}

absl::StatusOr<std::uint64_t> PostgresWriter::PutEdit(const EditRequest& edit) {
  if (connection_ == nullptr) return absl::InternalError("store: a change outside a commit");
  STRATA_RETURN_IF_ERROR(RunSql(
      "DELETE FROM map_edit WHERE map = $1 AND made < clock_timestamp() - interval '1 hour'"));
  absl::StatusOr<Rows> row = connection_->Query(
      "INSERT INTO map_edit (map, kind, trajectory, sequence, value) SELECT $1, $2, $3, $4, $5 "
      "WHERE (SELECT count(*) FROM map_edit WHERE map = $1 AND answer IS NULL) < $6 RETURNING "
      "number",
      map_,
      static_cast<int>(edit.kind),
      edit.scan.trajectory,
      edit.scan.sequence,
      Bytea{edit.value},
      kMostEdits);
  if (!row.ok() && broken_.ok()) broken_ = row.status();
  STRATA_RETURN_IF_ERROR(row.status());
  if (row->Next()) return row->Unsigned(0);
  return WithRetryDelay(
      absl::ResourceExhaustedError(absl::StrCat(
          "map ", opened_.name, ": ", kMostEdits, " edits wait, the most there may; retry later")),
      absl::Seconds(1));
}

absl::Status PostgresWriter::BeginEdit(std::uint64_t edit) {
  return RunSql("UPDATE map_edit SET begun = begun + 1 WHERE map = $1 AND number = $2", edit);
}

absl::Status PostgresWriter::AnswerEdit(std::uint64_t edit, const absl::Status& answer) {
  const std::string bytes = EncodeAnswer(answer);
  STRATA_ASSIGN_OR_RETURN(
      const std::uint64_t answered,
      Change("UPDATE map_edit SET answer = $3 WHERE map = $1 AND number = $2 AND answer IS NULL",
             edit,
             Bytea{bytes}));
  if (answered > 0) return absl::OkStatus();
  return absl::AbortedError(absl::StrCat("edit ", edit, " was withdrawn"));
}

absl::StatusOr<bool> PostgresWriter::WithdrawEdit(std::uint64_t edit) {
  STRATA_ASSIGN_OR_RETURN(
      const std::uint64_t withdrawn,
      Change("DELETE FROM map_edit WHERE map = $1 AND number = $2 AND answer IS NULL", edit));
  return withdrawn > 0;
}

absl::Status PostgresWriter::ForgetEdit(std::uint64_t edit) {
  return RunSql("DELETE FROM map_edit WHERE map = $1 AND number = $2", edit);
}

}  // namespace strata
