// Bags that ROS 2 wrote (../shared/data/rosbag2_samples): each reads without damage, and of those
// that exist in both containers the twins have the same topics, counts and bytes.
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <iterator>
#include <map>
#include <string>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/formats/bags/bag_reader.h"
#include "client/formats/bags/bag_scans.h"
#include "tests/support/data_dir.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

namespace fs = std::filesystem;

struct TopicSum {
  std::uint64_t messages = 0;
  std::uint64_t bytes = 0;
  std::uint64_t sum = 0;  // of all bytes, each times the place in its message
  friend bool operator==(const TopicSum&, const TopicSum&) = default;
};
using BagSum = std::map<std::string, TopicSum>;  // by topic and type; without those of no message

void AddBag(const fs::path& path, BagSum& sum) {
  STRATA_ASSERT_OK_AND_ASSIGN(const auto reader, OpenBagFile(path));
  STRATA_ASSERT_OK(reader->Visit([&](const BagMessage& message) {
    const BagTopic& topic = reader->topics()[message.topic];
    TopicSum& of = sum[absl::StrCat(topic.name, " ", topic.type)];
    ++of.messages;
    of.bytes += message.bytes.size();
    for (std::size_t i = 0; i < message.bytes.size(); ++i) {
      of.sum += (i + 1) * static_cast<unsigned char>(message.bytes[i]);
    }
    return absl::OkStatus();
  }));
  EXPECT_THAT(reader->damage(), ::testing::IsEmpty()) << path;
}

std::uint64_t MessagesOf(const BagSum& sum) {
  std::uint64_t messages = 0;
  for (const auto& [topic, of] : sum) messages += of.messages;
  return messages;
}

// Counted by a reader of its own (Python: struct, sqlite3, zstandard).
constexpr std::pair<const char*, std::uint64_t> kMessages[] = {
    {"ros2bag_test_resources_empty_bag_empty_bag_0.db3", 0},
    {"rosbag2_cpp_test_rosbag2_cpp_bags_only_services.mcap", 12},
    {"rosbag2_cpp_test_rosbag2_cpp_bags_only_topics.mcap", 7},
    {"rosbag2_cpp_test_rosbag2_cpp_bags_topics_and_services.db3", 13},
    {"rosbag2_cpp_test_rosbag2_cpp_bags_topics_and_services.mcap", 13},
    {"rosbag2_py_test_resources_mcap_convert_a_rewriter_a_0.mcap", 150},
    {"rosbag2_py_test_resources_mcap_convert_b_rewriter_b_0.mcap", 75},
    {"rosbag2_py_test_resources_mcap_reindex_test_bags_multiple_files_multiple_files_0.mcap", 1324},
    {"rosbag2_py_test_resources_mcap_reindex_test_bags_multiple_files_multiple_files_1.mcap", 1324},
    {"rosbag2_py_test_resources_mcap_reindex_test_bags_multiple_files_multiple_files_2.mcap", 529},
    {"rosbag2_py_test_resources_mcap_talker_talker.mcap", 20},
    {"rosbag2_py_test_resources_mcap_wbag_wbag_0.mcap", 1246},
    {"rosbag2_py_test_resources_mcap_wbag_wbag_1.mcap", 1240},
    {"rosbag2_py_test_resources_mcap_wbag_wbag_2.mcap", 1240},
    {"rosbag2_py_test_resources_mcap_wbag_wbag_3.mcap", 1240},
    {"rosbag2_py_test_resources_mcap_wbag_wbag_4.mcap", 1108},
    {"rosbag2_py_test_resources_sqlite3_convert_a_rewriter_a_0.db3", 150},
    {"rosbag2_py_test_resources_sqlite3_convert_b_rewriter_b_0.db3", 75},
    {"rosbag2_py_test_resources_sqlite3_reindex_test_bags_multiple_files_multiple_files_0.db3",
     1324},
    {"rosbag2_py_test_resources_sqlite3_reindex_test_bags_multiple_files_multiple_files_1.db3",
     1324},
    {"rosbag2_py_test_resources_sqlite3_reindex_test_bags_multiple_files_multiple_files_2.db3",
     529},
    {"rosbag2_py_test_resources_sqlite3_talker_talker.db3", 20},
    {"rosbag2_py_test_resources_sqlite3_wbag_wbag_0.db3", 1246},
    {"rosbag2_py_test_resources_sqlite3_wbag_wbag_1.db3", 1240},
    {"rosbag2_py_test_resources_sqlite3_wbag_wbag_2.db3", 1240},
    {"rosbag2_py_test_resources_sqlite3_wbag_wbag_3.db3", 1240},
    {"rosbag2_py_test_resources_sqlite3_wbag_wbag_4.db3", 1108},
    {"rosbag2_tests_resources_mcap_bag_with_topics_and_service_events_bag_with_topics_and_service_"
     "events.mcap",
     10},
    {"rosbag2_tests_resources_mcap_cdr_test_cdr_test_0.mcap", 7},
    {"rosbag2_tests_resources_mcap_wrong_rmw_test_wrong_rmw_test_0.mcap", 7},
    {"rosbag2_tests_resources_sqlite3_bag_with_topics_and_service_events_bag_with_topics_and_"
     "service_events.db3",
     10},
    {"rosbag2_tests_resources_sqlite3_cdr_test_cdr_test_0.db3", 7},
    {"rosbag2_tests_resources_sqlite3_wrong_rmw_test_wrong_rmw_test_0.db3", 7},
    {"rosbag2_transport_test_resources_mcap_rewriter_a_rewriter_a_0.mcap", 150},
    {"rosbag2_transport_test_resources_mcap_rewriter_b_rewriter_b_0.mcap", 75},
    {"rosbag2_transport_test_resources_mcap_test_bag_for_seek_test_bag_for_seek_0.mcap", 5},
    {"rosbag2_transport_test_resources_sqlite3_rewriter_a_rewriter_a_0.db3", 150},
    {"rosbag2_transport_test_resources_sqlite3_rewriter_b_rewriter_b_0.db3", 75},
    {"rosbag2_transport_test_resources_sqlite3_test_bag_for_seek_test_bag_for_seek_0.db3", 5},
};

TEST(RecordedBagsTest, EveryFileHasItsMessages) {
  STRATA_REQUIRE_DATA(path, "rosbag2_samples");
  std::size_t files = 0;
  for (const auto& [name, messages] : kMessages) {
    SCOPED_TRACE(name);
    BagSum sum;
    AddBag(path / name, sum);
    EXPECT_EQ(MessagesOf(sum), messages);
    ++files;
  }
  EXPECT_EQ(files, 39U);
}

TEST(RecordedBagsTest, TwinsAreTheSame) {
  STRATA_REQUIRE_DATA(path, "rosbag2_samples");
  std::size_t twins = 0;
  for (const auto& [name, messages] : kMessages) {
    const std::string twin =
        absl::StrReplaceAll(name, {{"_mcap_", "_sqlite3_"}, {".mcap", ".db3"}});
    if (twin == name || !fs::exists(path / twin)) continue;
    SCOPED_TRACE(name);
    BagSum mcap;
    BagSum db3;
    AddBag(path / name, mcap);
    AddBag(path / twin, db3);
    EXPECT_EQ(MessagesOf(mcap), MessagesOf(db3));
    // Those with services were recorded twice: other bytes, but as many of each topic.
    const bool twice = absl::StrContains(name, "_and_service");
    EXPECT_TRUE(twice || mcap == db3);
    for (auto& [topic, sum] : mcap) sum.sum = 0;
    for (auto& [topic, sum] : db3) sum.sum = 0;
    EXPECT_TRUE(mcap == db3);
    ++twins;
  }
  EXPECT_EQ(twins, 18U);
}

// Returns that a reader of its own (Python: struct) counts in each two seconds of a laser that a
// robot carries level.
constexpr std::size_t kReturns[] = {
    24365, 22971, 22847, 22909, 22993, 23012, 21577, 23008, 22967, 23009, 23000, 22925};

TEST(RecordedBagsTest, SweepsOfALevelLaserHaveItsReturns) {
  STRATA_REQUIRE_DATA(path, "importer_samples");
  BagScanOptions options;
  options.topic = "/driver_laser_navigation/laser_scan";
  options.poses_from = "tf:map->base_footprint";
  options.every.distance_m = 0.0;
  STRATA_ASSERT_OK_AND_ASSIGN(const auto scans,
                              ListBagScans({path / "ros1_jarvis_laser.bag"}, options));
  ASSERT_EQ(scans.size(), std::size(kReturns));
  for (std::size_t i = 0; i < scans.size(); ++i) {
    STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud cloud, ReadScanFile(scans[i]));
    EXPECT_EQ(cloud.size(), kReturns[i]) << i;
    EXPECT_EQ(cloud.intensity.size(), kReturns[i]) << i;
    for (const Eigen::Vector3f& p : cloud.points) {
      ASSERT_NEAR(p.z(), cloud.sensor_origin.z(), 1e-3) << i;
    }
  }
}

}  // namespace
}  // namespace strata
