// Bags that are records one after another, some of which are packed chunks of further records: MCAP
// and ROS 1's.
#ifndef STRATA_CLIENT_FORMATS_BAGS_CHUNKED_BAG_READER_H_
#define STRATA_CLIENT_FORMATS_BAGS_CHUNKED_BAG_READER_H_

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "client/formats/bags/bag_file.h"
#include "client/formats/bags/bag_reader.h"
#include "client/formats/parsing/byte_cursor.h"

namespace strata {

// Walks file and chunks; what is derived of it knows how a record and a chunk are laid out.
class ChunkedBagReader : public BagReader {
 public:
  absl::Status Visit(Visitor visit) final;
  absl::StatusOr<std::string> Read(const MessagePlace& place) final;
  double progress() const final;

 protected:
  struct Layout {
    std::uint64_t first_record = 0;  // its byte in the file
    std::uint8_t chunk = 0;          // what records of chunks and of messages have as `op`
    std::uint8_t message = 0;
    std::size_t message_head = 0;  // bytes of a message's content before the message
  };
  // A record of the file, with as much of its content as the file has.
  struct Record {
    std::uint8_t op = 0;
    std::uint64_t at = 0;
    std::string fields;            // of its head, if it has any
    std::uint64_t content_at = 0;  // byte of the file
    std::uint64_t length = 0;      // as it says
    std::uint64_t there = 0;       // of it, in the file
  };
  // A whole record in memory.
  struct Piece {
    std::uint8_t op = 0;
    absl::string_view fields, content;
  };

  ChunkedBagReader(BagFile file, const Layout& layout) : file_(std::move(file)), layout_(layout) {}

  // The record at byte `at`; nullopt behind the last one, and where none can begin, which is
  // damage. `there` is set by who calls.
  virtual absl::StatusOr<std::optional<Record>> HeadAt(std::uint64_t at) = 0;
  // The next record of a chunk; nullopt if that is none or not whole.
  virtual std::optional<Piece> NextPiece(ByteCursor& chunk) const = 0;
  // Whether the content of a record that is no chunk counts. Notes what its head says.
  virtual bool Wants(const Record& record) = 0;
  // Notes what it says, and visits it if it is a message.
  virtual absl::Status VisitPiece(const Piece& piece, const MessagePlace& place, Visitor visit) = 0;
  // `records` become those of a chunk, in `content` or `unpacked`. DATA_LOSS: what can be had of
  // them all the same, nothing if they are not as they were written.
  virtual absl::Status UnpackChunk(const Record& record,
                                   absl::string_view content,
                                   std::string& unpacked,
                                   absl::string_view& records) const = 0;

  const BagFile& file() const { return file_; }
  void AddDamageAt(std::uint64_t at, absl::string_view what);
  // The file ends before a record's head does, or has none where one should begin.
  void AddCutHead();
  void AddNoHead(std::uint64_t at);

 private:
  absl::StatusOr<std::optional<Record>> RecordAt(std::uint64_t at);
  absl::Status VisitRecord(const Record& record, Visitor visit);
  absl::Status VisitChunk(const Record& record, Visitor visit);
  // Into records_, from the file or from the time before. Errors are UnpackChunk's and the disk's.
  absl::Status LoadChunk(const Record& record);
  // The content of the record of a message, in memory until something else is read.
  absl::StatusOr<absl::string_view> MessageContent(const Record& record, const MessagePlace& place);

  BagFile file_;
  Layout layout_;
  std::uint64_t behind_ = 0;  // bytes of the file
  std::string content_;       // of a record
  std::string unpacked_;
  absl::string_view records_;            // of the chunk, in content_ or unpacked_
  std::optional<std::uint64_t> loaded_;  // byte of the chunk whose records they are
};

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_BAGS_CHUNKED_BAG_READER_H_
