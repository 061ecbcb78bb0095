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

#include "client/formats/bags/byte_cursor.h"
#include "client/formats/bags/unpack.h"
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

std::string AtRos1Byte(std::uint64_t at, absl::string_view what) {
  return absl::StrCat("byte ", at, ": ", what);
}

}  // namespace

absl::StatusOr<std::unique_ptr<BagReader>> Ros1BagReader::Open(const std::filesystem::path& path) {
  STRATA_ASSIGN_OR_RETURN(BagFile file, BagFile::Open(path));
  return std::unique_ptr<BagReader>(new Ros1BagReader(std::move(file)));
}

double Ros1BagReader::progress() const {
  return static_cast<double>(behind_) /
         static_cast<double>(std::max<std::uint64_t>(file_.size(), 1));
}

std::optional<Ros1BagReader::Header> Ros1BagReader::ParseHeader(absl::string_view fields) {
  Header header;
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
    if (name == "topic") header.topic = std::string(value);
    if (name == "type") header.type = std::string(value);
    if (name == "compression") header.compression = std::string(value);
  }
  return header;
}

absl::StatusOr<std::optional<Ros1BagReader::Record>> Ros1BagReader::RecordAt(std::uint64_t at) {
  if (at >= file_.size()) return std::nullopt;
  std::string bytes;
  STRATA_RETURN_IF_ERROR(file_.Read(at, sizeof(std::uint32_t), bytes));
  const auto header_size = NumberIn<std::uint32_t>(bytes);
  std::optional<Header> header;
  if (bytes.size() == sizeof(std::uint32_t) && header_size <= kMaxRos1Header) {
    STRATA_RETURN_IF_ERROR(
        file_.Read(at + sizeof(std::uint32_t), header_size + sizeof(std::uint32_t), bytes));
    if (bytes.size() == header_size + sizeof(std::uint32_t)) {
      header = ParseHeader(absl::string_view(bytes).substr(0, header_size));
    } else {
      AddDamage(absl::StrCat("ends at byte ", file_.size(), " in the middle of a record"));
      return std::nullopt;
    }
  }
  if (!header.has_value() || header->op == 0) {
    AddDamage(AtRos1Byte(at, "no record begins here; what follows is not read"));
    return std::nullopt;
  }
  Record record;
  record.at = at;
  record.header = *std::move(header);
  record.length = NumberIn<std::uint32_t>(absl::string_view(bytes).substr(header_size));
  record.data_at = at + 2 * sizeof(std::uint32_t) + header_size;
  record.there = std::min(record.length, file_.size() - std::min(file_.size(), record.data_at));
  return record;
}

absl::Status Ros1BagReader::Visit(Visitor visit) {
  ClearDamage();
  loaded_.reset();
  std::uint64_t at = kRos1Magic.size();
  while (true) {
    STRATA_ASSIGN_OR_RETURN(const std::optional<Record> record, RecordAt(at));
    if (!record.has_value()) break;
    behind_ = record->data_at + record->there;
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

absl::Status Ros1BagReader::VisitRecord(const Record& record, Visitor visit) {
  const std::uint8_t op = record.header.op;
  if (op == kOpBagHeader && record.header.index_at == 0) AddDamage("it was not closed");
  if (op == kOpChunk) return VisitChunk(record, visit);
  if (op != kOpConnection && op != kOpMessage) return absl::OkStatus();
  if (record.there < record.length) return absl::OkStatus();
  if (record.length > kMaxBagPieceBytes) {
    AddDamage(
        AtRos1Byte(record.at, absl::StrCat("a record of ", record.length, " bytes is left out")));
    return absl::OkStatus();
  }
  STRATA_RETURN_IF_ERROR(file_.Read(record.data_at, record.length, content_));
  loaded_.reset();
  return VisitContent(record.header, content_, {.chunk = 0, .at = record.at}, visit);
}

absl::Status Ros1BagReader::VisitChunk(const Record& record, Visitor visit) {
  const absl::Status loaded = LoadChunk(record);
  if (absl::IsUnavailable(loaded)) return loaded;
  if (!loaded.ok()) AddDamage(AtRos1Byte(record.at, absl::StrCat("a chunk ", loaded.message())));
  ByteCursor cursor(records_);
  while (cursor.remaining() > 0) {
    const std::uint64_t at = cursor.position();
    const absl::string_view fields = cursor.TakeSized<std::uint32_t>();
    const absl::string_view data = cursor.TakeSized<std::uint32_t>();
    const std::optional<Header> header = cursor.ok() ? ParseHeader(fields) : std::nullopt;
    if (!header.has_value()) {
      if (loaded.ok()) AddDamage(AtRos1Byte(record.at, "a chunk ends in the middle of a record"));
      break;
    }
    STRATA_RETURN_IF_ERROR(VisitContent(*header, data, {.chunk = record.at, .at = at}, visit));
  }
  return absl::OkStatus();
}

absl::Status Ros1BagReader::LoadChunk(const Record& record) {
  if (loaded_ == record.at) return absl::OkStatus();
  records_ = {};
  loaded_.reset();
  if (record.there > kMaxBagPieceBytes) {
    return absl::DataLossError(absl::StrCat("of ", record.length, " bytes is left out"));
  }
  STRATA_RETURN_IF_ERROR(file_.Read(record.data_at, record.there, content_));
  absl::Status status;
  if (record.header.compression == "none") {
    records_ = content_;
  } else {
    status = Unpack(record.header.compression, content_, record.header.size, unpacked_);
    records_ = unpacked_;
  }
  if (record.there < record.length) {
    return absl::DataLossError("is cut short; its first messages are read");
  }
  if (!status.ok()) {
    return absl::DataLossError(absl::StrCat(status.message(), "; what came before it is read"));
  }
  loaded_ = record.at;
  return absl::OkStatus();
}

absl::Status Ros1BagReader::VisitContent(const Header& header,
                                         absl::string_view data,
                                         const MessagePlace& place,
                                         Visitor visit) {
  if (header.op == kOpConnection) {
    const std::optional<Header> about = ParseHeader(data);
    connections_[header.connection] =
        TopicNumber(header.topic, about.has_value() ? about->type : "", MessageEncoding::kRos1);
  }
  if (header.op != kOpMessage) return absl::OkStatus();
  const auto topic = connections_.find(header.connection);
  if (topic == connections_.end()) {
    AddDamage(AtRos1Byte(std::max(place.chunk, place.at), "a message of no topic is left out"));
    return absl::OkStatus();
  }
  return visit({.topic = topic->second, .time_ns = header.time_ns, .bytes = data, .place = place});
}

absl::StatusOr<std::string> Ros1BagReader::Read(const MessagePlace& place) {
  const std::uint64_t at = place.chunk == 0 ? place.at : place.chunk;
  STRATA_ASSIGN_OR_RETURN(const std::optional<Record> record, RecordAt(at));
  const absl::Status lost =
      absl::DataLossError(absl::StrCat(file_.name(), ": ", AtRos1Byte(at, "no message any more")));
  if (!record.has_value()) return lost;
  if (place.chunk == 0) {
    if (record->header.op != kOpMessage || record->length > kMaxBagPieceBytes) return lost;
    loaded_.reset();
    STRATA_RETURN_IF_ERROR(file_.Read(record->data_at, record->length, content_));
    return content_;
  }
  if (record->header.op != kOpChunk) return lost;
  const absl::Status loaded = LoadChunk(*record);
  if (absl::IsUnavailable(loaded)) return loaded;  // else what is there may have it
  ByteCursor cursor(records_);
  cursor.Take(place.at);
  const absl::string_view fields = cursor.TakeSized<std::uint32_t>();
  const absl::string_view data = cursor.TakeSized<std::uint32_t>();
  const std::optional<Header> header = ParseHeader(fields);
  if (!cursor.ok() || !header.has_value() || header->op != kOpMessage) return lost;
  return std::string(data);
}

}  // namespace strata
