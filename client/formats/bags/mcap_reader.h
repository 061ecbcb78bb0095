// MCAP (https://mcap.dev/spec): chunks plain, lz4 or zstd, or messages without chunks; the index at
// the end is not needed.
#ifndef STRATA_CLIENT_FORMATS_BAGS_MCAP_READER_H_
#define STRATA_CLIENT_FORMATS_BAGS_MCAP_READER_H_

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

inline constexpr absl::string_view kMcapMagic("\x89MCAP0\r\n", 8);

// A chunk whose CRC does not fit is left out; of one that the file ends in, what can be unpacked is
// read. Attachments and metadata are passed over.
class McapReader final : public BagReader {
 public:
  static absl::StatusOr<std::unique_ptr<BagReader>> Open(const std::filesystem::path& path);

  absl::Status Visit(Visitor visit) override;
  absl::StatusOr<std::string> Read(const MessagePlace& place) override;
  double progress() const override;

 private:
  // A record of the file, with as much of its content as the file has.
  struct Record {
    std::uint8_t opcode = 0;
    std::uint64_t at = 0;
    std::uint64_t length = 0;  // as it says
    std::uint64_t there = 0;   // of it, in the file
  };

  explicit McapReader(BagFile file) : file_(std::move(file)) {}

  // The record at byte `at`; nullopt where none can begin, which is damage.
  absl::StatusOr<std::optional<Record>> RecordAt(std::uint64_t at);
  absl::Status VisitRecord(const Record& record, Visitor visit);
  absl::Status VisitChunk(const Record& record, Visitor visit);
  absl::Status VisitContent(std::uint8_t opcode,
                            absl::string_view content,
                            const MessagePlace& place,
                            Visitor visit);
  // The records of the chunk at byte `at`, from the file or from the time before. DATA_LOSS: what
  // can be had of them is in `records_` all the same, nothing if they are not as they were written.
  absl::Status LoadChunk(const Record& record);
  void AddSchema(absl::string_view content);
  void AddChannel(absl::string_view content);

  BagFile file_;
  std::map<std::uint16_t, std::string> schemas_;   // their names
  std::map<std::uint16_t, std::size_t> channels_;  // their topics
  std::uint64_t behind_ = 0;                       // bytes of the file
  std::string content_;                            // of a record
  std::string unpacked_;
  absl::string_view records_;            // of the chunk, in content_ or unpacked_
  std::optional<std::uint64_t> loaded_;  // byte of the chunk whose records they are
};

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_BAGS_MCAP_READER_H_
