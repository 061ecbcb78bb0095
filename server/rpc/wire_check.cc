#include "server/rpc/wire_check.h"

#include <algorithm>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/synchronization/mutex.h"
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/message.h>
#include <google/protobuf/wire_format_lite.h>

#include "core/common/status.h"
#include "strata/v1/bounds.pb.h"

namespace strata::server {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::internal::WireFormatLite;
using google::protobuf::io::CodedInputStream;

// As protobuf's own parser.
constexpr int kMaxDepth = 100;
// What malloc adds to a block, rounding included.
constexpr std::size_t kBlockBytes = 24;
// A string on the heap, without its characters.
constexpr std::size_t kStringBytes = sizeof(std::string) + 2 * kBlockBytes;
// An entry of an array that has grown to twice what it holds.
constexpr std::size_t kPointerBytes = 2 * sizeof(void*);
// A node of a map and its share of the table, beside the entry.
constexpr std::size_t kMapNodeBytes = 128;
constexpr std::size_t kUnknownFieldBytes = 2 * 16 + kStringBytes;

struct Shape;

struct Field {
  const FieldDescriptor* descriptor;
  WireFormatLite::WireType wire_type;  // of one item
  const Shape* message;                // null: not a message
  std::size_t max_items;               // 0: not repeated, or any number
  std::size_t index;                   // among the repeated fields of all messages
};

// A message type, as the walk needs it.
struct Shape {
  std::size_t bytes = 0;  // of an empty message
  std::vector<Field> fields;

  const Field* Find(int number) const {
    const auto found = std::find_if(fields.begin(), fields.end(), [&](const Field& field) {
      return field.descriptor->number() == number;
    });
    return found == fields.end() ? nullptr : &*found;
  }
};

// Made once a type. Thread-safe.
class Shapes {
 public:
  const Shape& Of(const Descriptor& type) {
    absl::MutexLock lock(&mutex_);
    return Make(type);
  }

 private:
  const Shape& Make(const Descriptor& type) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    const auto [found, fresh] = shapes_.try_emplace(&type);
    Shape& shape = found->second;
    if (!fresh) return shape;
    shape.bytes = google::protobuf::MessageFactory::generated_factory()
                      ->GetPrototype(&type)
                      ->SpaceUsedLong() +
                  kBlockBytes;
    for (int i = 0; i < type.field_count(); ++i) {
      const FieldDescriptor& field = *type.field(i);
      const auto wire_type = WireFormatLite::WireTypeForFieldType(
          static_cast<WireFormatLite::FieldType>(field.type()));
      const Shape* message =
          field.message_type() == nullptr ? nullptr : &Make(*field.message_type());
      shape.fields.push_back({&field,
                              wire_type,
                              message,
                              field.options().GetExtension(v1::max_items),
                              field.is_repeated() ? ++repeated_ : 0});
    }
    return shape;
  }

  absl::Mutex mutex_;
  std::map<const Descriptor*, Shape> shapes_ ABSL_GUARDED_BY(mutex_);  // its nodes stay in place
  std::size_t repeated_ ABSL_GUARDED_BY(mutex_) = 0;
};

Shapes& AllShapes() {
  static auto* const shapes = new Shapes();
  return *shapes;
}

absl::Status NoMessage() {
  return absl::InvalidArgumentError("the request's bytes are no message of its type");
}

class Walk {
 public:
  explicit Walk(CodedInputStream& in) : in_(in) {}

  // One message up to the end or the limit of the bytes.
  absl::Status Message(const Shape& shape, int depth) {
    if (depth > kMaxDepth) return NoMessage();
    bytes_ += shape.bytes;
    while (const std::uint32_t tag = in_.ReadTag()) {
      const int number = WireFormatLite::GetTagFieldNumber(tag);
      const WireFormatLite::WireType type = WireFormatLite::GetTagWireType(tag);
      if (number == 0) return NoMessage();
      const Field* field = shape.Find(number);
      if (field != nullptr && type == field->wire_type) {
        STRATA_RETURN_IF_ERROR(Item(*field, depth));
      } else if (field != nullptr && type == WireFormatLite::WIRETYPE_LENGTH_DELIMITED &&
                 field->descriptor->is_packable()) {
        STRATA_RETURN_IF_ERROR(Packed(*field));
      } else {
        STRATA_RETURN_IF_ERROR(Unknown(type));
      }
    }
    return in_.ConsumedEntireMessage() ? absl::OkStatus() : NoMessage();
  }
  std::size_t bytes() const { return bytes_; }

 private:
  absl::Status Item(const Field& field, int depth) {
    STRATA_RETURN_IF_ERROR(Count(field, 1));
    if (field.wire_type != WireFormatLite::WIRETYPE_LENGTH_DELIMITED) {
      if (field.descriptor->is_repeated()) bytes_ += kPointerBytes;
      return Skip(field.wire_type);
    }
    int length = 0;
    if (!in_.ReadVarintSizeAsInt(&length)) return NoMessage();
    bytes_ += kPointerBytes;
    if (field.message == nullptr) {
      bytes_ += kStringBytes + static_cast<std::size_t>(length);
      return in_.Skip(length) ? absl::OkStatus() : NoMessage();
    }
    if (field.descriptor->is_map()) bytes_ += kMapNodeBytes;
    const CodedInputStream::Limit limit = in_.PushLimit(length);
    STRATA_RETURN_IF_ERROR(Message(*field.message, depth + 1));
    // What ends before its length is cut short.
    if (in_.BytesUntilLimit() != 0) return NoMessage();
    in_.PopLimit(limit);
    return absl::OkStatus();
  }
  absl::Status Packed(const Field& field) {
    int length = 0;
    if (!in_.ReadVarintSizeAsInt(&length)) return NoMessage();
    const std::size_t item_bytes = field.wire_type == WireFormatLite::WIRETYPE_FIXED64   ? 8
                                   : field.wire_type == WireFormatLite::WIRETYPE_FIXED32 ? 4
                                                                                         : 1;
    const std::size_t most = static_cast<std::size_t>(length) / item_bytes;
    STRATA_RETURN_IF_ERROR(Count(field, most));
    bytes_ += most * kPointerBytes;
    return in_.Skip(length) ? absl::OkStatus() : NoMessage();
  }
  absl::Status Unknown(WireFormatLite::WireType type) {
    if (++unknown_ > kMaxUnknownFields) {
      return absl::InvalidArgumentError(absl::StrCat("the request has more than ",
                                                     kMaxUnknownFields,
                                                     " fields that this server does not know"));
    }
    bytes_ += kUnknownFieldBytes;
    if (type != WireFormatLite::WIRETYPE_LENGTH_DELIMITED) return Skip(type);
    int length = 0;
    if (!in_.ReadVarintSizeAsInt(&length)) return NoMessage();
    bytes_ += static_cast<std::size_t>(length);
    return in_.Skip(length) ? absl::OkStatus() : NoMessage();
  }
  absl::Status Skip(WireFormatLite::WireType type) {
    std::uint64_t ignored = 0;
    switch (type) {
      case WireFormatLite::WIRETYPE_VARINT:
        return in_.ReadVarint64(&ignored) ? absl::OkStatus() : NoMessage();
      case WireFormatLite::WIRETYPE_FIXED64:
        return in_.Skip(8) ? absl::OkStatus() : NoMessage();
      case WireFormatLite::WIRETYPE_FIXED32:
        return in_.Skip(4) ? absl::OkStatus() : NoMessage();
      default:  // the contract has no groups
        return NoMessage();
    }
  }
  // Also over several messages of one request: a field that is sent twice is merged.
  absl::Status Count(const Field& field, std::size_t items) {
    if (field.index == 0 || field.max_items == 0) return absl::OkStatus();
    const std::size_t all = counts_[field.index] += items;
    if (all <= field.max_items) return absl::OkStatus();
    return absl::InvalidArgumentError(absl::StrCat(field.descriptor->name(),
                                                   ": ",
                                                   all,
                                                   " or more; at most ",
                                                   field.max_items,
                                                   " in one request, ask in parts"));
  }

  CodedInputStream& in_;
  std::size_t bytes_ = 0;
  std::size_t unknown_ = 0;
  std::map<std::size_t, std::size_t> counts_;  // by Field::index
};

}  // namespace

absl::StatusOr<std::size_t> ParsedBytes(const Descriptor& type,
                                        google::protobuf::io::ZeroCopyInputStream& bytes) {
  CodedInputStream in(&bytes);
  Walk walk(in);
  STRATA_RETURN_IF_ERROR(walk.Message(AllShapes().Of(type), 0));
  return walk.bytes();
}

}  // namespace strata::server
