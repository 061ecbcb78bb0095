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

#include "client/formats/bags/chunked_bag_reader.h"
#include "client/formats/bags/mcap_records.h"
#include "client/formats/bags/unpack.h"
#include "client/formats/parsing/byte_cursor.h"
#include "core/common/status.h"

namespace strata {
namespace {

// Of a message's record before its bytes: channel, sequence, two times.
constexpr std::uint64_t kMessageHead = 22;

std::int64_t ClampedNanoseconds(std::uint64_t time_ns) {
  constexpr std::uint64_t kMost = std::numeric_limits<std::int64_t>::max();
  return static_cast<std::int64_t>(std::min(time_ns, kMost));
}

}  // namespace

absl::StatusOr<std::unique_ptr<BagReader>> McapReader::Open(const std::filesystem::path& path) {
  STRATA_ASSIGN_OR_RETURN(BagFile file, BagFile::Open(path));
  return std::unique_ptr<BagReader>(new McapReader(std::move(file)));
}

McapReader::McapReader(BagFile file)
    : ChunkedBagReader(std::move(file),
                       {.first_record = kMcapMagic.size(),
                        .chunk = kMcapChunk,
                        .message = kMcapMessage,
                        .message_head = kMessageHead}) {}

absl::StatusOr<std::optional<McapReader::Record>> McapReader::HeadAt(std::uint64_t at) {
  std::string head;
  STRATA_RETURN_IF_ERROR(file().Read(at, kMcapRecordHead, head));
  if (head.empty()) {
    AddDamage(absl::StrCat("ends at byte ", at, " without the end of its data: it was not closed"));
    return std::nullopt;
  }
  ByteCursor cursor(head);
  Record record;
  record.at = at;
  record.op = cursor.Get<std::uint8_t>();
  record.content_at = at + kMcapRecordHead;
  record.length = cursor.Get<std::uint64_t>();
  if (!cursor.ok()) {
    AddCutHead();
    return std::nullopt;
  }
  if (record.op == 0) {
    AddNoHead(at);
    return std::nullopt;
  }
  if (record.op == kMcapDataEnd || record.op == kMcapFooter) return std::nullopt;
  return record;
}

std::optional<McapReader::Piece> McapReader::NextPiece(ByteCursor& chunk) const {
  Piece piece;
  piece.op = chunk.Get<std::uint8_t>();
  piece.content = chunk.TakeSized<std::uint64_t>();
  return chunk.ok() ? std::optional<Piece>(piece) : std::nullopt;
}

bool McapReader::Wants(const Record& record) {
  return record.op == kMcapSchema || record.op == kMcapChannel || record.op == kMcapMessage;
}

absl::Status McapReader::UnpackChunk(const Record& /*record*/,
                                     absl::string_view content,
                                     std::string& unpacked,
                                     absl::string_view& records) const {
  ByteCursor cursor(content);
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
    records = packed;
  } else {
    status = Unpack(method, packed, size, unpacked);
    records = unpacked;
  }
  if (cut) return absl::DataLossError("is cut short; its first messages are read");
  if (status.ok() && crc != 0 && Crc32Of(records) != crc) {
    status = absl::DataLossError("has another checksum than it says");
  }
  if (status.ok()) return status;
  records = {};
  return absl::DataLossError(absl::StrCat(status.message(), ": it is left out"));
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

absl::Status McapReader::VisitPiece(const Piece& piece, const MessagePlace& place, Visitor visit) {
  if (piece.op == kMcapSchema) AddSchema(piece.content);
  if (piece.op == kMcapChannel) AddChannel(piece.content);
  if (piece.op != kMcapMessage) return absl::OkStatus();
  ByteCursor cursor(piece.content);
  const auto channel = channels_.find(cursor.Get<std::uint16_t>());
  cursor.Get<std::uint32_t>();  // sequence
  const auto log_time_ns = cursor.Get<std::uint64_t>();
  cursor.Get<std::uint64_t>();  // when it was published
  if (!cursor.ok() || channel == channels_.end()) {
    AddDamageAt(std::max(place.chunk, place.at),
                cursor.ok() ? "a message of no channel is left out"
                            : "a message is too short for its times");
    return absl::OkStatus();
  }
  return visit({.topic = channel->second,
                .time_ns = ClampedNanoseconds(log_time_ns),
                .bytes = cursor.TakeRest(),
                .place = place});
}

}  // namespace strata
