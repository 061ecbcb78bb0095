#include "client/formats/bags/chunked_bag_reader.h"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

#include "client/formats/parsing/byte_cursor.h"
#include "core/common/status.h"

namespace strata {
namespace {

std::string AtByte(std::uint64_t at, absl::string_view what) {
  return absl::StrCat("byte ", at, ": ", what);
}

}  // namespace

void ChunkedBagReader::AddDamageAt(std::uint64_t at, absl::string_view what) {
  AddDamage(AtByte(at, what));
}

void ChunkedBagReader::AddCutHead() {
  AddDamage(absl::StrCat("ends at byte ", file_.size(), " in the middle of a record"));
}

void ChunkedBagReader::AddNoHead(std::uint64_t at) {
  AddDamageAt(at, "no record begins here; what follows is not read");
}

double ChunkedBagReader::progress() const {
  return static_cast<double>(behind_) /
         static_cast<double>(std::max<std::uint64_t>(file_.size(), 1));
}

absl::StatusOr<std::optional<ChunkedBagReader::Record>> ChunkedBagReader::RecordAt(
    std::uint64_t at) {
  STRATA_ASSIGN_OR_RETURN(std::optional<Record> record, HeadAt(at));
  if (record.has_value()) {
    record->there =
        std::min(record->length, file_.size() - std::min(file_.size(), record->content_at));
  }
  return record;
}

absl::Status ChunkedBagReader::Visit(Visitor visit) {
  ClearDamage();
  loaded_.reset();
  std::uint64_t at = layout_.first_record;
  while (true) {
    STRATA_ASSIGN_OR_RETURN(const std::optional<Record> record, RecordAt(at));
    if (!record.has_value()) break;
    behind_ = record->content_at + record->there;
    STRATA_RETURN_IF_ERROR(VisitRecord(*record, visit));
    if (record->there < record->length) {
      AddCutShort(file_.size(), at, record->length);
      break;
    }
    at = behind_;
  }
  behind_ = file_.size();
  return absl::OkStatus();
}

absl::Status ChunkedBagReader::VisitRecord(const Record& record, Visitor visit) {
  if (record.op == layout_.chunk) return VisitChunk(record, visit);
  if (!Wants(record) || record.there < record.length) return absl::OkStatus();
  if (record.length > kMaxBagPieceBytes) {
    AddDamageAt(record.at, absl::StrCat("a record of ", record.length, " bytes is left out"));
    return absl::OkStatus();
  }
  STRATA_RETURN_IF_ERROR(file_.Read(record.content_at, record.length, content_));
  loaded_.reset();
  return VisitPiece({record.op, record.fields, content_}, {.chunk = 0, .at = record.at}, visit);
}

absl::Status ChunkedBagReader::VisitChunk(const Record& record, Visitor visit) {
  const absl::Status loaded = LoadChunk(record);
  if (absl::IsUnavailable(loaded)) return loaded;
  if (!loaded.ok()) AddDamageAt(record.at, absl::StrCat("a chunk ", loaded.message()));
  ByteCursor cursor(records_);
  while (cursor.remaining() > 0) {
    const std::uint64_t at = cursor.position();
    const std::optional<Piece> piece = NextPiece(cursor);
    if (!piece.has_value()) {
      if (loaded.ok()) AddDamageAt(record.at, "a chunk ends in the middle of a record");
      break;
    }
    STRATA_RETURN_IF_ERROR(VisitPiece(*piece, {.chunk = record.at, .at = at}, visit));
  }
  return absl::OkStatus();
}

absl::Status ChunkedBagReader::LoadChunk(const Record& record) {
  if (loaded_ == record.at) return absl::OkStatus();
  records_ = {};
  loaded_.reset();
  if (record.there > kMaxBagPieceBytes) {
    return absl::DataLossError(absl::StrCat("of ", record.length, " bytes is left out"));
  }
  STRATA_RETURN_IF_ERROR(file_.Read(record.content_at, record.there, content_));
  STRATA_RETURN_IF_ERROR(UnpackChunk(record, content_, unpacked_, records_));
  loaded_ = record.at;
  return absl::OkStatus();
}

absl::StatusOr<absl::string_view> ChunkedBagReader::MessageContent(const Record& record,
                                                                   const MessagePlace& place) {
  if (place.chunk == 0) {
    if (record.length > kMaxBagPieceBytes) return absl::DataLossError("too long");
    loaded_.reset();
    STRATA_RETURN_IF_ERROR(file_.Read(record.content_at, record.length, content_));
    return content_;
  }
  const absl::Status loaded = LoadChunk(record);
  if (absl::IsUnavailable(loaded)) return loaded;  // else what is there may have it
  ByteCursor cursor(records_);
  cursor.Take(place.at);
  const std::optional<Piece> piece = NextPiece(cursor);
  if (!piece.has_value() || piece->op != layout_.message) return absl::DataLossError("no message");
  return piece->content;
}

absl::StatusOr<std::string> ChunkedBagReader::Read(const MessagePlace& place) {
  const std::uint64_t at = place.chunk == 0 ? place.at : place.chunk;
  const std::uint8_t op = place.chunk == 0 ? layout_.message : layout_.chunk;
  STRATA_ASSIGN_OR_RETURN(const std::optional<Record> record, RecordAt(at));
  absl::StatusOr<absl::string_view> content = absl::DataLossError("no record");
  if (record.has_value() && record->op == op) content = MessageContent(*record, place);
  if (absl::IsUnavailable(content.status())) return content.status();
  if (!content.ok() || content->size() < layout_.message_head) {
    return absl::DataLossError(absl::StrCat(file_.name(), ": ", AtByte(at, "no message any more")));
  }
  return std::string(content->substr(layout_.message_head));
}

}  // namespace strata
