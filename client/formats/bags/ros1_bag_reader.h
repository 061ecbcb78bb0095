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

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "client/formats/bags/bag_file.h"
#include "client/formats/bags/bag_reader.h"
#include "client/formats/bags/chunked_bag_reader.h"
#include "client/formats/parsing/byte_cursor.h"

namespace strata {

inline constexpr absl::string_view kRos1Magic = "#ROSBAG V2.0\n";

// The chunks have no checksums: what is unpacked but damaged shows where it is parsed, if at all.
class Ros1BagReader final : public ChunkedBagReader {
 public:
  static absl::StatusOr<std::unique_ptr<BagReader>> Open(const std::filesystem::path& path);

 private:
  explicit Ros1BagReader(BagFile file);

  absl::StatusOr<std::optional<Record>> HeadAt(std::uint64_t at) override;
  std::optional<Piece> NextPiece(ByteCursor& chunk) const override;
  bool Wants(const Record& record) override;
  absl::Status VisitPiece(const Piece& piece, const MessagePlace& place, Visitor visit) override;
  absl::Status UnpackChunk(const Record& record,
                           absl::string_view content,
                           std::string& unpacked,
                           absl::string_view& records) const override;

  std::map<std::uint32_t, std::size_t> connections_;  // their topics
};

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_BAGS_ROS1_BAG_READER_H_
