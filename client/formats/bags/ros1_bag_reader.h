// Bags of ROS 1, version 2.0 (http://wiki.ros.org/Bags/Format/2.0): chunks plain, bz2 or lz4; the
// index is not needed.
#ifndef STRATA_CLIENT_FORMATS_BAGS_ROS1_BAG_READER_H_
#define STRATA_CLIENT_FORMATS_BAGS_ROS1_BAG_READER_H_

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "client/formats/bags/bag_file.h"
#include "client/formats/bags/bag_reader.h"

namespace strata {

inline constexpr absl::string_view kRos1Magic = "#ROSBAG V2.0\n";

// The chunks have no checksums: what is unpacked but damaged shows where it is parsed, if at all.
class Ros1BagReader final : public BagReader {
 public:
  static absl::StatusOr<std::unique_ptr<BagReader>> Open(const std::filesystem::path& path);

  absl::Status Visit(Visitor visit) override;
  absl::StatusOr<std::string> Read(const MessagePlace& place) override;
  double progress() const override;

 private:
  // What of the fields of a record's header counts here.
  struct Header {
    std::uint8_t op = 0;
    std::uint32_t connection = 0;
    std::uint64_t index_at = 0;
    std::uint32_t size = 0;
    std::int64_t time_ns = 0;
    std::string topic, type, compression;
  };
  // A record of the file: its data begin at `data_at`, and `there` of `length` bytes are there.
  struct Record {
    std::uint64_t at = 0;
    Header header;
    std::uint64_t data_at = 0;
    std::uint64_t length = 0, there = 0;
  };

  explicit Ros1BagReader(BagFile file) : file_(std::move(file)) {}
  static std::optional<Header> ParseHeader(absl::string_view fields);

  absl::StatusOr<std::optional<Record>> RecordAt(std::uint64_t at);
  absl::Status VisitRecord(const Record& record, Visitor visit);
  absl::Status VisitChunk(const Record& record, Visitor visit);
  absl::Status VisitContent(const Header& header,
                            absl::string_view data,
                            const MessagePlace& place,
                            Visitor visit);
  // As McapReader::LoadChunk.
  absl::Status LoadChunk(const Record& record);

  BagFile file_;
  std::map<std::uint32_t, std::size_t> connections_;  // their topics
  std::uint64_t behind_ = 0;                          // bytes of the file
  std::string content_, unpacked_;
  absl::string_view records_;            // of the chunk, in content_ or unpacked_
  std::optional<std::uint64_t> loaded_;  // byte of the chunk whose records they are
};

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_BAGS_ROS1_BAG_READER_H_
