#include "client/formats/bags/ros1_bag_reader.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

#include "client/formats/bags/chunked_bag_reader.h"
#include "client/formats/bags/unpack.h"
#include "client/formats/parsing/byte_cursor.h"
#include "core/common/status.h"

namespace strata {
namespace {

constexpr std::uint8_t kOpMessage = 0x02;
constexpr std::uint8_t kOpBagHeader = 0x03;
constexpr std::uint8_t kOpChunk = 0x05;
constexpr std::uint8_t kOpConnection = 0x07;

// Of a header's fields; a connection's type description is data, not header.
constexpr std::uint32_t kMaxRos1Header = std::uint32_t{1} << 20;

template <typename T>
T NumberIn(absl::string_view bytes) {
  return ByteCursor(bytes).Get<T>();
}

std::int64_t Ros1Nanoseconds(absl::string_view bytes) {
  ByteCursor cursor(bytes);
  const std::int64_t seconds = cursor.Get<std::uint32_t>();
  return seconds * 1'000'000'000 + cursor.Get<std::uint32_t>();
}

// What of the fields of a record's header counts here.
struct RecordHeader {
  std::uint8_t op = 0;
  std::uint32_t connection = 0;
  std::uint64_t index_at = 0;
  std::uint32_t size = 0;
  std::int64_t time_ns = 0;
  absl::string_view topic, type, compression;
};

std::optional<RecordHeader> ParseHeader(absl::string_view fields) {
  RecordHeader header;
  ByteCursor cursor(fields);
  while (cursor.remaining() > 0) {
    const absl::string_view field = cursor.TakeSized<std::uint32_t>();
    const std::size_t equals = field.find('=');
    if (!cursor.ok() || equals == absl::string_view::npos) return std::nullopt;
    const absl::string_view name = field.substr(0, equals);
    const absl::string_view value = field.substr(equals + 1);
    if (name == "op") header.op = NumberIn<std::uint8_t>(value);
    if (name == "conn") header.connection = NumberIn<std::uint32_t>(value);
    if (name == "index_pos") header.index_at = NumberIn<std::uint64_t>(value);
    if (name == "size") header.size = NumberIn<std::uint32_t>(value);
    if (name == "time") header.time_ns = Ros1Nanoseconds(value);
    if (name == "topic") header.topic = value;
    if (name == "type") header.type = value;
    if (name == "compression") header.compression = value;
  }
  return header;
}

}  // namespace

absl::StatusOr<std::unique_ptr<BagReader>> Ros1BagReader::Open(const std::filesystem::path& path) {
  STRATA_ASSIGN_OR_RETURN(BagFile file, BagFile::Open(path));
  return std::unique_ptr<BagReader>(new Ros1BagReader(std::move(file)));
}

Ros1BagReader::Ros1BagReader(BagFile file)
    : ChunkedBagReader(
          std::move(file),
          {.first_record = kRos1Magic.size(), .chunk = kOpChunk, .message = kOpMessage}) {}

absl::StatusOr<std::optional<Ros1BagReader::Record>> Ros1BagReader::HeadAt(std::uint64_t at) {
  if (at >= file().size()) return std::nullopt;
  std::string bytes;
  STRATA_RETURN_IF_ERROR(file().Read(at, sizeof(std::uint32_t), bytes));
  const auto header_size = NumberIn<std::uint32_t>(bytes);
  Record record;
  if (bytes.size() == sizeof(std::uint32_t) && header_size <= kMaxRos1Header) {
    const std::uint64_t head = header_size + sizeof(std::uint32_t);
    STRATA_RETURN_IF_ERROR(file().Read(at + sizeof(std::uint32_t), head, bytes));
    if (bytes.size() < head) {
      AddCutHead();
      return std::nullopt;
    }
    record.fields = bytes.substr(0, header_size);
  }
  const std::optional<RecordHeader> header = ParseHeader(record.fields);
  if (!header.has_value() || header->op == 0) {
    AddNoHead(at);
    return std::nullopt;
  }
  record.op = header->op;
  record.at = at;
  record.length = NumberIn<std::uint32_t>(absl::string_view(bytes).substr(header_size));
  record.content_at = at + 2 * sizeof(std::uint32_t) + header_size;
  return record;
}

std::optional<Ros1BagReader::Piece> Ros1BagReader::NextPiece(ByteCursor& chunk) const {
  Piece piece;
  piece.fields = chunk.TakeSized<std::uint32_t>();
  piece.content = chunk.TakeSized<std::uint32_t>();
  const std::optional<RecordHeader> header = chunk.ok() ? ParseHeader(piece.fields) : std::nullopt;
  if (!header.has_value()) return std::nullopt;
  piece.op = header->op;
  return piece;
}

bool Ros1BagReader::Wants(const Record& record) {
  if (record.op == kOpBagHeader && ParseHeader(record.fields)->index_at == 0) {
    AddDamage("it was not closed");
  }
  return record.op == kOpConnection || record.op == kOpMessage;
}

absl::Status Ros1BagReader::UnpackChunk(const Record& record,
                                        absl::string_view content,
                                        std::string& unpacked,
                                        absl::string_view& records) const {
  const RecordHeader header = *ParseHeader(record.fields);
  absl::Status status;
  if (header.compression == "none") {
    records = content;
  } else {
    status = Unpack(header.compression, content, header.size, unpacked);
    records = unpacked;
  }
  if (record.there < record.length) {
    return absl::DataLossError("is cut short; its first messages are read");
  }
  if (status.ok()) return status;
  return absl::DataLossError(absl::StrCat(status.message(), "; what came before it is read"));
}

absl::Status Ros1BagReader::VisitPiece(const Piece& piece,
                                       const MessagePlace& place,
                                       Visitor visit) {
  const RecordHeader header = *ParseHeader(piece.fields);
  if (piece.op == kOpConnection) {
    const std::optional<RecordHeader> about = ParseHeader(piece.content);
    connections_[header.connection] =
        TopicNumber(header.topic, about.has_value() ? about->type : "", MessageEncoding::kRos1);
  }
  if (piece.op != kOpMessage) return absl::OkStatus();
  const auto topic = connections_.find(header.connection);
  if (topic == connections_.end()) {
    AddDamageAt(std::max(place.chunk, place.at), "a message of no topic is left out");
    return absl::OkStatus();
  }
  return visit(
      {.topic = topic->second, .time_ns = header.time_ns, .bytes = piece.content, .place = place});
}

}  // namespace strata
