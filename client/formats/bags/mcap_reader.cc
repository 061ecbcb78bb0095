#include "client/formats/bags/mcap_reader.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include <zlib.h>

#include "client/formats/bags/byte_cursor.h"
#include "client/formats/bags/unpack.h"
#include "core/common/status.h"

namespace strata {
namespace {

constexpr std::uint8_t kFooter = 0x02;
constexpr std::uint8_t kSchema = 0x03;
constexpr std::uint8_t kChannel = 0x04;
constexpr std::uint8_t kMessage = 0x05;
constexpr std::uint8_t kChunk = 0x06;
constexpr std::uint8_t kDataEnd = 0x0F;

constexpr std::uint64_t kRecordHead = 9;  // opcode and length
// Of a message's record before its bytes: channel, sequence, two times.
constexpr std::uint64_t kMessageHead = 22;

bool IsOfInterest(std::uint8_t opcode) {
  return opcode == kSchema || opcode == kChannel || opcode == kMessage || opcode == kChunk;
}

std::int64_t ClampedNanoseconds(std::uint64_t time_ns) {
  constexpr std::uint64_t kMost = std::numeric_limits<std::int64_t>::max();
  return static_cast<std::int64_t>(std::min(time_ns, kMost));
}

std::uint32_t Crc32Of(absl::string_view bytes) {
  return static_cast<std::uint32_t>(
      crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

std::string AtByte(std::uint64_t at, absl::string_view what) {
  return absl::StrCat("byte ", at, ": ", what);
}

}  // namespace

absl::StatusOr<std::unique_ptr<BagReader>> McapReader::Open(const std::filesystem::path& path) {
  STRATA_ASSIGN_OR_RETURN(BagFile file, BagFile::Open(path));
  return std::unique_ptr<BagReader>(new McapReader(std::move(file)));
}

double McapReader::progress() const {
  return static_cast<double>(behind_) /
         static_cast<double>(std::max<std::uint64_t>(file_.size(), 1));
}

absl::StatusOr<std::optional<McapReader::Record>> McapReader::RecordAt(std::uint64_t at) {
  std::string head;
  STRATA_RETURN_IF_ERROR(file_.Read(at, kRecordHead, head));
  if (head.empty()) {
    AddDamage(absl::StrCat("ends at byte ", at, " without the end of its data: it was not closed"));
    return std::nullopt;
  }
  ByteCursor cursor(head);
  Record record;
  record.at = at;
  record.opcode = cursor.Get<std::uint8_t>();
  record.length = cursor.Get<std::uint64_t>();
  if (!cursor.ok()) {
    AddDamage(absl::StrCat("ends at byte ", file_.size(), " in the middle of a record"));
    return std::nullopt;
  }
  if (record.opcode == 0) {
    AddDamage(AtByte(at, "no record begins here; what follows is not read"));
    return std::nullopt;
  }
  record.there = std::min(record.length, file_.size() - std::min(file_.size(), at + kRecordHead));
  return record;
}

absl::Status McapReader::Visit(Visitor visit) {
  ClearDamage();
  loaded_.reset();
  std::uint64_t at = kMcapMagic.size();
  while (true) {
    STRATA_ASSIGN_OR_RETURN(const std::optional<Record> record, RecordAt(at));
    if (!record.has_value() || record->opcode == kDataEnd || record->opcode == kFooter) break;
    behind_ = at + kRecordHead + record->there;
    if (IsOfInterest(record->opcode)) STRATA_RETURN_IF_ERROR(VisitRecord(*record, visit));
    if (record->there < record->length) {
      AddCutShort(file_.size(), at, record->length);
      break;
    }
    at = behind_;
  }
  behind_ = file_.size();
  return absl::OkStatus();
}

absl::Status McapReader::VisitRecord(const Record& record, Visitor visit) {
  if (record.opcode == kChunk) return VisitChunk(record, visit);
  if (record.there < record.length) return absl::OkStatus();
  if (record.length > kMaxBagPieceBytes) {
    AddDamage(AtByte(record.at, absl::StrCat("a record of ", record.length, " bytes is left out")));
    return absl::OkStatus();
  }
  STRATA_RETURN_IF_ERROR(file_.Read(record.at + kRecordHead, record.length, content_));
  loaded_.reset();
  return VisitContent(record.opcode, content_, {.chunk = 0, .at = record.at}, visit);
}

absl::Status McapReader::VisitChunk(const Record& record, Visitor visit) {
  const absl::Status loaded = LoadChunk(record);
  if (absl::IsUnavailable(loaded)) return loaded;
  if (!loaded.ok()) AddDamage(AtByte(record.at, absl::StrCat("a chunk ", loaded.message())));
  ByteCursor cursor(records_);
  while (cursor.remaining() > 0) {
    const std::uint64_t at = cursor.position();
    const auto opcode = cursor.Get<std::uint8_t>();
    const absl::string_view content = cursor.TakeSized<std::uint64_t>();
    if (!cursor.ok()) {
      if (loaded.ok()) AddDamage(AtByte(record.at, "a chunk ends in the middle of a record"));
      break;
    }
    STRATA_RETURN_IF_ERROR(VisitContent(opcode, content, {.chunk = record.at, .at = at}, visit));
  }
  return absl::OkStatus();
}

absl::Status McapReader::LoadChunk(const Record& record) {
  if (loaded_ == record.at) return absl::OkStatus();
  records_ = {};
  loaded_.reset();
  if (record.there > kMaxBagPieceBytes) {
    return absl::DataLossError(absl::StrCat("of ", record.length, " bytes is left out"));
  }
  STRATA_RETURN_IF_ERROR(file_.Read(record.at + kRecordHead, record.there, content_));
  ByteCursor cursor(content_);
  cursor.Take(2 * sizeof(std::uint64_t));  // first and last time
  const auto size = cursor.Get<std::uint64_t>();
  const auto crc = cursor.Get<std::uint32_t>();
  const absl::string_view method = cursor.TakeSized<std::uint32_t>();
  const auto packed_size = cursor.Get<std::uint64_t>();
  if (!cursor.ok()) return absl::DataLossError("is cut short");
  const bool cut = packed_size > cursor.remaining();
  const absl::string_view packed = cut ? cursor.TakeRest() : cursor.Take(packed_size);
  absl::Status status;
  if (method.empty()) {
    records_ = packed;
  } else {
    status = Unpack(method, packed, size, unpacked_);
    records_ = unpacked_;
  }
  if (cut) return absl::DataLossError("is cut short; its first messages are read");
  if (status.ok() && crc != 0 && Crc32Of(records_) != crc) {
    status = absl::DataLossError("has another checksum than it says");
  }
  if (!status.ok()) {
    records_ = {};
    return absl::DataLossError(absl::StrCat(status.message(), ": it is left out"));
  }
  loaded_ = record.at;
  return absl::OkStatus();
}

void McapReader::AddSchema(absl::string_view content) {
  ByteCursor cursor(content);
  const auto id = cursor.Get<std::uint16_t>();
  const absl::string_view name = cursor.TakeSized<std::uint32_t>();
  if (cursor.ok()) schemas_[id] = std::string(name);
}

void McapReader::AddChannel(absl::string_view content) {
  ByteCursor cursor(content);
  const auto id = cursor.Get<std::uint16_t>();
  const auto schema = cursor.Get<std::uint16_t>();
  const absl::string_view topic = cursor.TakeSized<std::uint32_t>();
  const absl::string_view encoding = cursor.TakeSized<std::uint32_t>();
  if (!cursor.ok()) return;
  const auto type = schemas_.find(schema);
  channels_[id] = TopicNumber(topic,
                              type == schemas_.end() ? absl::string_view() : type->second,
                              MessageEncodingOf(encoding));
}

absl::Status McapReader::VisitContent(std::uint8_t opcode,
                                      absl::string_view content,
                                      const MessagePlace& place,
                                      Visitor visit) {
  if (opcode == kSchema) AddSchema(content);
  if (opcode == kChannel) AddChannel(content);
  if (opcode != kMessage) return absl::OkStatus();
  ByteCursor cursor(content);
  const auto channel = channels_.find(cursor.Get<std::uint16_t>());
  cursor.Get<std::uint32_t>();  // sequence
  const auto log_time_ns = cursor.Get<std::uint64_t>();
  cursor.Get<std::uint64_t>();  // when it was published
  if (!cursor.ok() || channel == channels_.end()) {
    AddDamage(AtByte(std::max(place.chunk, place.at),
                     cursor.ok() ? "a message of no channel is left out"
                                 : "a message is too short for its times"));
    return absl::OkStatus();
  }
  return visit({.topic = channel->second,
                .time_ns = ClampedNanoseconds(log_time_ns),
                .bytes = cursor.TakeRest(),
                .place = place});
}

absl::StatusOr<std::string> McapReader::Read(const MessagePlace& place) {
  const std::uint64_t at = place.chunk == 0 ? place.at : place.chunk;
  STRATA_ASSIGN_OR_RETURN(const std::optional<Record> record, RecordAt(at));
  const absl::Status lost =
      absl::DataLossError(absl::StrCat(file_.name(), ": ", AtByte(at, "no message any more")));
  if (!record.has_value() || record->opcode != (place.chunk == 0 ? kMessage : kChunk)) return lost;
  absl::string_view content;
  if (place.chunk == 0) {
    if (record->length > kMaxBagPieceBytes) return lost;
    STRATA_RETURN_IF_ERROR(file_.Read(at + kRecordHead, record->length, content_));
    loaded_.reset();
    content = content_;
  } else {
    const absl::Status loaded = LoadChunk(*record);
    if (absl::IsUnavailable(loaded)) return loaded;  // else what is there may have it
    ByteCursor cursor(records_);
    cursor.Take(place.at);
    if (cursor.Get<std::uint8_t>() != kMessage) return lost;
    content = cursor.TakeSized<std::uint64_t>();
  }
  if (content.size() < kMessageHead) return lost;
  return std::string(content.substr(kMessageHead));
}

}  // namespace strata
