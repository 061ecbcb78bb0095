// ROS messages and the files that hold them, as their specifications say: what readers are tried
// on.
#ifndef STRATA_TESTS_SUPPORT_BAG_WRITER_H_
#define STRATA_TESTS_SUPPORT_BAG_WRITER_H_

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "absl/strings/string_view.h"
#include <Eigen/Core>

#include "core/geometry/pose.h"

namespace strata::testing {

enum class Layout : std::uint8_t { kCdr, kCdrBigEndian, kCdr2, kRos1 };

// Appends values as a layout has them.
class MessageWriter {
 public:
  explicit MessageWriter(Layout layout);

  template <typename T>
  MessageWriter& Put(T value) {
    const std::size_t step = std::min(sizeof(T), largest_step_);
    while ((bytes_.size() - head_) % step != 0) bytes_.push_back('\0');
    auto raw = std::bit_cast<std::array<char, sizeof(T)>>(value);
    if (layout_ == Layout::kCdrBigEndian) std::reverse(raw.begin(), raw.end());
    bytes_.append(raw.data(), raw.size());
    return *this;
  }
  MessageWriter& Text(absl::string_view text);
  MessageWriter& Bytes(absl::string_view bytes);
  MessageWriter& Header(std::int64_t stamp_ns, absl::string_view frame);
  MessageWriter& Place(const Pose& pose);  // position, quaternion
  const std::string& bytes() const { return bytes_; }

 private:
  const Layout layout_;
  std::size_t largest_step_;
  std::size_t head_ = 0;
  std::string bytes_;
};

// Points x, y, z and intensity, floats of 16 bytes a point; `rows` > 1 makes a grid. With a `t_ns`
// for each point there is a field t of four bytes more, as Ouster's driver has it.
std::string CloudMessage(Layout layout,
                         std::int64_t stamp_ns,
                         absl::string_view frame,
                         const std::vector<Eigen::Vector4f>& points,
                         std::uint32_t rows = 1,
                         const std::vector<std::uint32_t>& t_ns = {});
// A laser's line from `first_rad` on; no intensities.
std::string LaserMessage(Layout layout,
                         std::int64_t stamp_ns,
                         absl::string_view frame,
                         float first_rad,
                         float step_rad,
                         float step_s,
                         const std::vector<float>& ranges_m);
std::string JointMessage(Layout layout,
                         std::int64_t stamp_ns,
                         const std::map<std::string, double>& positions);
std::string OdometryMessage(Layout layout,
                            std::int64_t stamp_ns,
                            absl::string_view frame,
                            absl::string_view child,
                            const Pose& pose);
std::string PoseMessage(Layout layout,
                        std::int64_t stamp_ns,
                        absl::string_view frame,
                        const Pose& pose);
// One transform.
std::string TransformMessage(Layout layout,
                             std::int64_t stamp_ns,
                             absl::string_view frame,
                             absl::string_view child,
                             const Pose& pose);

// By "zstd", "lz4" (a frame) or "bz2"; by anything else as it is.
std::string Packed(const std::string& method, const std::string& bytes);

struct BagEntry {
  std::string topic;
  std::string type;  // with /msg/ for ROS 2
  std::int64_t time_ns = 0;
  std::string bytes;
};

struct McapForm {
  std::string compression = {};  // "", "lz4", "zstd"
  bool chunks = true;
  bool checksums = true;
  bool index = true;       // and all else behind the data
  bool attachment = true;  // and metadata, between the messages
  std::size_t chunk_bytes = std::size_t{1} << 20;
};
std::string McapBytes(const std::vector<BagEntry>& entries, const McapForm& form = {});

// `compression`: "none", "bz2", "lz4".
std::string Ros1BagBytes(const std::vector<BagEntry>& entries,
                         const std::string& compression = "none",
                         std::size_t chunk_bytes = std::size_t{768} << 10);

// A rosbag2 file; false if SQLite does not want to.
bool WriteDb3(const std::filesystem::path& path, const std::vector<BagEntry>& entries);

}  // namespace strata::testing

#endif  // STRATA_TESTS_SUPPORT_BAG_WRITER_H_
