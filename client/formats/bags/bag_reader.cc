#include "client/formats/bags/bag_reader.h"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <system_error>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

#include "client/formats/bags/mcap_reader.h"
#include "client/formats/bags/mcap_records.h"
#include "client/formats/bags/ros1_bag_reader.h"
#include "client/formats/bags/sqlite_bag_reader.h"

namespace strata {
namespace {

// More are a file that means harm; the numbers of further ones are that of the last.
constexpr std::size_t kMaxTopics = 10'000;
constexpr std::size_t kMaxDamageLines = 10;

constexpr absl::string_view kAnyRos1 = "#ROSBAG V";

std::string FirstBytes(const std::filesystem::path& path) {
  std::string bytes(16, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(file.gcount()));
  return bytes;
}

}  // namespace

std::size_t BagReader::TopicNumber(absl::string_view name,
                                   absl::string_view type,
                                   MessageEncoding encoding) {
  BagTopic topic = {PrintableName(name), PrintableName(type), encoding};
  const std::size_t msg = topic.type.find("/msg/");
  if (msg != std::string::npos) topic.type.erase(msg, 4);
  const std::string key =
      absl::StrCat(topic.name, "\n", topic.type, "\n", static_cast<int>(encoding));
  const auto known = numbers_.find(key);
  if (known != numbers_.end()) return known->second;
  if (topics_.size() < kMaxTopics) {
    numbers_[key] = topics_.size();
    topics_.push_back(std::move(topic));
  }
  return topics_.size() - 1;
}

void BagReader::AddDamage(std::string line) {
  if (damage_.size() < kMaxDamageLines) {
    damage_.push_back(std::move(line));
  } else if (damage_.size() == kMaxDamageLines) {
    damage_.emplace_back("and more");
  }
}

void BagReader::AddCutShort(std::uint64_t end, std::uint64_t at, std::uint64_t bytes) {
  AddDamage(absl::StrCat("ends at byte ",
                         end,
                         " within the record of byte ",
                         at,
                         ", which says that it has ",
                         bytes,
                         " bytes"));
}

bool IsBagFile(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return false;
  const std::string bytes = FirstBytes(path);
  return absl::StartsWith(bytes, kMcapMagic) || absl::StartsWith(bytes, kAnyRos1) ||
         absl::StartsWith(bytes, kSqliteMagic);
}

absl::StatusOr<std::unique_ptr<BagReader>> OpenBagFile(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::exists(path, error)) {
    return absl::NotFoundError(absl::StrCat(path.string(), ": no such file"));
  }
  const std::string bytes = FirstBytes(path);
  if (absl::StartsWith(bytes, kMcapMagic)) return McapReader::Open(path);
  if (absl::StartsWith(bytes, kRos1Magic)) return Ros1BagReader::Open(path);
  if (absl::StartsWith(bytes, kSqliteMagic)) return SqliteBagReader::Open(path);
  if (absl::StartsWith(bytes, kAnyRos1)) {
    return absl::InvalidArgumentError(absl::StrCat(
        path.string(), ": a bag older than version 2.0; 'rosbag fix' of ROS 1 makes a new one"));
  }
  return absl::InvalidArgumentError(
      absl::StrCat(path.string(),
                   ": no bag by its first bytes; expected MCAP, rosbag2's SQLite or ROS 1's bag"));
}

}  // namespace strata
