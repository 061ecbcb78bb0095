// Recordings in every container, and messages in every encoding.
#include <array>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <string>
#include <vector>

#include <fuzzer/FuzzedDataProvider.h>

#include "client/formats/bags/bag_reader.h"
#include "client/formats/bags/bag_scans.h"
#include "client/formats/bags/ros_messages.h"
#include "client/formats/scan_list.h"
#include "tests/fuzz/input_file.h"
#include "tests/fuzz/require.h"
#include "tests/support/temp_dir.h"

namespace strata::fuzz {
namespace {

constexpr std::size_t kMostClouds = 20;

void TryCloud(const absl::StatusOr<PointCloud>& cloud) {
  RequireGoodRefusal(cloud.status());
  if (cloud.ok()) Require(ValidateCloud(*cloud).ok(), "a cloud that was read is valid");
}

// As a command would: what it is asked for is there or is named.
void TryRecording(const std::string& path) {
  for (const char* poses_from : {"", "/odom", "tf:odom->lidar"}) {
    BagScanOptions options;
    options.topic = "/points";
    options.poses_from = poses_from;
    options.every.distance_m = 0.0;
    options.tell = [](const std::string& line) { Require(!line.empty(), "what is told says so"); };
    const auto scans = ListBagScans({path}, options);
    RequireGoodRefusal(scans.status());
    if (!scans.ok()) continue;
    for (std::size_t i = 0; i < scans->size() && i < kMostClouds; ++i) {
      TryCloud(ReadScanFile((*scans)[i]));
    }
  }
}

// SQLite opens what has a name of its own.
void TryDatabase(const std::string& bytes) {
  static const testing::TempDir dir;
  const std::string path = (dir.path() / "a.db3").string();
  std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes;
  TryRecording(path);
}

void TryMessage(FuzzedDataProvider& input) {
  constexpr std::array kTypes = {kPointCloudType,
                                 kLaserScanType,
                                 kJointStateType,
                                 "nav_msgs/Odometry",
                                 "geometry_msgs/PoseStamped",
                                 "tf2_msgs/TFMessage"};
  const BagTopic topic = {"/t",
                          input.PickValueInArray(kTypes),
                          input.ConsumeBool() ? MessageEncoding::kCdr : MessageEncoding::kRos1};
  const std::string bytes = input.ConsumeRemainingBytesAsString();
  if (topic.type == kPointCloudType) {
    RequireGoodRefusal(ReadRosCloudHead(bytes, topic.encoding).status());
    TryCloud(ReadRosCloud(bytes, topic.encoding));
  } else if (topic.type == kLaserScanType) {
    const auto scan = ReadRosLaserScan(bytes, topic.encoding);
    RequireGoodRefusal(scan.status());
    if (scan.ok()) TryCloud(scan->line);
  } else if (topic.type == kJointStateType) {
    RequireGoodRefusal(ReadRosJointState(bytes, topic.encoding).status());
  } else {
    RequireGoodRefusal(ReadRosPoses(topic, bytes).status());
  }
}

}  // namespace
}  // namespace strata::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzedDataProvider input(data, size);
  switch (input.ConsumeIntegralInRange(0, 2)) {
    case 0:
      strata::fuzz::TryMessage(input);
      break;
    case 1:
      strata::fuzz::TryDatabase(input.ConsumeRemainingBytesAsString());
      break;
    default:
      strata::fuzz::TryRecording(
          strata::fuzz::InputFile(input.ConsumeRemainingBytesAsString()).path());
  }
  return 0;
}
