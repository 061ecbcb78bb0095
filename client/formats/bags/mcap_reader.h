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

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "client/formats/bags/bag_file.h"
#include "client/formats/bags/bag_reader.h"
#include "client/formats/bags/chunked_bag_reader.h"
#include "client/formats/parsing/byte_cursor.h"

namespace strata {

// A chunk whose CRC does not fit is left out; of one that the file ends in, what can be unpacked is
// read. Attachments and metadata are passed over.
class McapReader final : public ChunkedBagReader {
 public:
  static absl::StatusOr<std::unique_ptr<BagReader>> Open(const std::filesystem::path& path);

 private:
  explicit McapReader(BagFile file);

  absl::StatusOr<std::optional<Record>> HeadAt(std::uint64_t at) override;
  std::optional<Piece> NextPiece(ByteCursor& chunk) const override;
  bool Wants(const Record& record) override;
  absl::Status VisitPiece(const Piece& piece, const MessagePlace& place, Visitor visit) override;
  absl::Status UnpackChunk(const Record& record,
                           absl::string_view content,
                           std::string& unpacked,
                           absl::string_view& records) const override;
  void AddSchema(absl::string_view content);
  void AddChannel(absl::string_view content);

  std::map<std::uint16_t, std::string> schemas_;   // their names
  std::map<std::uint16_t, std::size_t> channels_;  // their topics
};

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_BAGS_MCAP_READER_H_
