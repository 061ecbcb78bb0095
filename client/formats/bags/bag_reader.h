// A file of recorded ROS messages, whatever its container: MCAP, rosbag2's SQLite, ROS 1's bag.
#ifndef STRATA_CLIENT_FORMATS_BAGS_BAG_READER_H_
#define STRATA_CLIENT_FORMATS_BAGS_BAG_READER_H_

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "client/formats/bags/ros_topic.h"

namespace strata {

// Where a message lies in its file: for its reader only.
struct MessagePlace {
  std::uint64_t chunk = 0;  // byte of the record it lies in, or 0
  std::uint64_t at = 0;     // byte of its record there, or its row
};

struct BagMessage {
  std::size_t topic = 0;     // of BagReader::topics()
  std::int64_t time_ns = 0;  // since 1970, when it was recorded
  absl::string_view bytes;   // until the visitor returns
  MessagePlace place;
};

// Holds one chunk of the file and one message at a time, of at most 1 GiB each, whatever the file
// says. Not thread-safe.
class BagReader {
 public:
  using Visitor = absl::FunctionRef<absl::Status(const BagMessage&)>;

  virtual ~BagReader() = default;
  // Every message that can be read, in the order of the file; ends with the first error of `visit`.
  // What cannot be read is left out and said in damage(). UNAVAILABLE if the disk fails.
  virtual absl::Status Visit(Visitor visit) = 0;
  // The bytes of a message that was visited. DATA_LOSS if they are no longer there.
  virtual absl::StatusOr<std::string> Read(const MessagePlace& place) = 0;
  // Share of the file that is behind the message visited last, in [0, 1].
  virtual double progress() const = 0;

  // Those seen so far; after Visit, all that have a message or are announced.
  const std::vector<BagTopic>& topics() const { return topics_; }
  // One line a fault, with the byte where it is, and where the file ends too early.
  const std::vector<std::string>& damage() const { return damage_; }

 protected:
  // The number of a topic, a new one if it is not known. The type may be of ROS 1 or 2.
  std::size_t TopicNumber(absl::string_view name, absl::string_view type, MessageEncoding encoding);
  // The first lines only.
  void AddDamage(std::string line);
  // The file ends at byte `end`, within the record of byte `at`, which says that it has so many.
  void AddCutShort(std::uint64_t end, std::uint64_t at, std::uint64_t bytes);
  void ClearDamage() { damage_.clear(); }

 private:
  std::vector<BagTopic> topics_;
  std::map<std::string, std::size_t> numbers_;  // of topics, by name, type and encoding
  std::vector<std::string> damage_;
};

// Whether the first bytes of a file are those of a bag. ROS 1's before version 2.0 are, too;
// opening one says that it is not read.
bool IsBagFile(const std::filesystem::path& path);

// By the first bytes. NOT_FOUND; UNAVAILABLE if it cannot be read; INVALID_ARGUMENT, naming the
// file, if it is no bag or none that is read.
absl::StatusOr<std::unique_ptr<BagReader>> OpenBagFile(const std::filesystem::path& path);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_BAGS_BAG_READER_H_
