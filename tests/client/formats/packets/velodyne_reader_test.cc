// Files of a Velodyne's packets, planted and recorded, beside tests/support/velodyne_points.py,
// which shares nothing with what reads them.
#include "client/formats/packets/velodyne_reader.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/formats/file_bytes.h"
#include "client/formats/motion/placed_scans.h"
#include "client/formats/scan_list.h"
#include "client/formats/scan_reader.h"
#include "core/cloud/point_cloud.h"
#include "tests/client/formats/hostile_files.h"
#include "tests/support/data_dir.h"
#include "tests/support/paths.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata {
namespace {

using ::strata::testing::PutAt;
using ::strata::testing::StatusIs;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr std::uint8_t kVlp16 = 0x22;
constexpr std::uint8_t kHdl32e = 0x21;

struct Planted {
  std::uint8_t model = kVlp16;
  std::uint8_t mode = 0x37;
  std::size_t packets = 0;
  int step = 40;                    // from block to block [0.01°]
  std::uint32_t stamp = 1'000'000;  // of the first packet [µs]
  std::uint32_t packet_us = 1327;   // from one to the next
};

std::string Block(int azimuth, std::mt19937_64& random) {
  std::string block;
  PutAt<std::uint16_t>(block, 0, 0xEEFF);
  PutAt(block, 2, static_cast<std::uint16_t>(azimuth % 36000));
  for (std::size_t i = 0; i < 32; ++i) {
    const std::uint64_t drawn = random();
    PutAt(block, 4 + 3 * i, static_cast<std::uint16_t>(drawn % 5 == 0 ? 0 : drawn >> 8));
    PutAt(block, 6 + 3 * i, static_cast<std::uint8_t>(drawn >> 32));
  }
  return block;
}

// Of one IPv4 packet over Ethernet, from 192.168.1.`host`.
std::string Record(const std::string& payload,
                   std::uint32_t captured_us,
                   std::uint16_t port = 2368,
                   std::uint8_t host = 201) {
  std::string frame(42, '\0');
  frame[12] = 8;
  frame[14] = 0x45;
  frame[23] = 17;
  const std::array<std::uint8_t, 4> address = {192, 168, 1, host};
  for (std::size_t i = 0; i < 4; ++i) frame[26 + i] = static_cast<char>(address[i]);
  const auto put = [&frame](std::size_t at, std::size_t value) {
    frame[at] = static_cast<char>(value >> 8);
    frame[at + 1] = static_cast<char>(value);
  };
  put(36, port);
  put(38, payload.size() + 8);
  frame += payload;
  std::string record;
  PutAt<std::uint32_t>(record, 0, 1'700'000'000);
  PutAt<std::uint32_t>(record, 4, captured_us);
  PutAt(record, 8, static_cast<std::uint32_t>(frame.size()));
  PutAt(record, 12, static_cast<std::uint32_t>(frame.size()));
  return record + frame;
}

std::string PcapHead() {
  std::string head;
  PutAt<std::uint32_t>(head, 0, 0xA1B2C3D4);
  PutAt<std::uint16_t>(head, 4, 2);
  PutAt<std::uint16_t>(head, 6, 4);
  PutAt<std::uint32_t>(head, 16, 65535);
  PutAt<std::uint32_t>(head, 20, 1);
  return head;
}

std::string PcapOf(const Planted& planted, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::string file = PcapHead();
  int azimuth = 300;
  for (std::size_t packet = 0; packet < planted.packets; ++packet) {
    std::string payload;
    for (std::size_t i = 0; i < 12; ++i) {
      const bool second = planted.mode == 0x39 && i % 2 == 1;
      if (second) {
        std::string again = payload.substr(payload.size() - 100);
        for (std::size_t k = 0; k < 32; k += 2) again[4 + 3 * k] = static_cast<char>(random());
        payload += again;
      } else {
        payload += Block(azimuth, random);
        azimuth += planted.step;
      }
    }
    const auto stamp = (std::uint64_t{planted.stamp} + packet * planted.packet_us) % 3'600'000'000;
    PutAt(payload, 1200, static_cast<std::uint32_t>(stamp));
    PutAt(payload, 1204, planted.mode);
    PutAt(payload, 1205, planted.model);
    file += Record(payload, static_cast<std::uint32_t>(packet * planted.packet_us));
  }
  return file;
}

struct OraclePoint {
  std::size_t revolution = 0;
  std::array<double, 5> values = {};  // x, y, z, reflectivity, time
};

std::vector<OraclePoint> OraclePoints(const std::filesystem::path& path) {
  const std::string command = absl::StrCat("/usr/bin/python3 ",
                                           testing::SourcePath("tests/support/velodyne_points.py"),
                                           " '",
                                           path.string(),
                                           "'");
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"), &pclose);
  std::vector<OraclePoint> points;
  OraclePoint point;
  auto& [x, y, z, reflectivity, time] = point.values;
  while (fscanf(pipe.get(),
                "%zu %lf %lf %lf %lf %lf",
                &point.revolution,
                &x,
                &y,
                &z,
                &reflectivity,
                &time) == 6) {
    points.push_back(point);
  }
  return points;
}

void ExpectOraclePoints(const std::filesystem::path& path, std::size_t revolutions) {
  const std::vector<OraclePoint> oracle = OraclePoints(path);
  STRATA_ASSERT_OK_AND_ASSIGN(const auto stations, ListVelodyneStations(path));
  EXPECT_EQ(stations.size(), revolutions);
  std::size_t next = 0;
  for (std::size_t i = 0; i < stations.size(); ++i) {
    STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud cloud, stations[i].read());
    ASSERT_EQ(cloud.intensity.size(), cloud.size());
    ASSERT_EQ(cloud.time.size(), cloud.size());
    for (std::size_t k = 0; k < cloud.size(); ++k, ++next) {
      ASSERT_LT(next, oracle.size());
      const OraclePoint& truth = oracle[next];
      ASSERT_EQ(truth.revolution, i);
      ASSERT_LT((cloud.points[k].cast<double>() -
                 Eigen::Vector3d(truth.values[0], truth.values[1], truth.values[2]))
                    .norm(),
                2e-5)
          << k;
      ASSERT_EQ(cloud.intensity[k], truth.values[3]);
      ASSERT_NEAR(cloud.time[k], truth.values[4], 1e-8);
    }
  }
  EXPECT_EQ(next, oracle.size());
}

class VelodyneReaderTest : public ::testing::Test {
 protected:
  std::filesystem::path Write(const std::string& bytes) const {
    const std::filesystem::path path = dir_.path() / "drive.pcap";
    STRATA_EXPECT_OK(WriteFileBytes(path, bytes));
    return path;
  }

  testing::TempDir dir_;
};

TEST_F(VelodyneReaderTest, PlantedPacketsAreWhatTheManualsSay) {
  // Two whole turns each, and parts of two more.
  ExpectOraclePoints(Write(PcapOf({.packets = 230}, 1)), 2);
  ExpectOraclePoints(Write(PcapOf({.mode = 0x39, .packets = 460, .packet_us = 663}, 2)), 2);
  ExpectOraclePoints(
      Write(PcapOf({.model = kHdl32e, .packets = 550, .step = 17, .packet_us = 553}, 3)), 2);
}

// The same packets behind another header of their link.
std::string OverLink(const std::string& pcap, std::uint16_t link, const std::string& head) {
  std::string out = pcap.substr(0, 24);
  PutAt(out, 20, link);
  constexpr std::size_t kEthernet = 14;
  for (std::size_t at = 24; at < pcap.size();) {
    std::uint32_t size = 0;
    std::memcpy(&size, pcap.data() + at + 8, sizeof size);
    std::string record = pcap.substr(at, 16);
    const auto changed = static_cast<std::uint32_t>(size - kEthernet + head.size());
    PutAt(record, 8, changed);
    PutAt(record, 12, changed);
    out += record + head + pcap.substr(at + 16 + kEthernet, size - kEthernet);
    at += 16 + size;
  }
  return out;
}

TEST_F(VelodyneReaderTest, PacketsAreFoundOverOtherLinks) {
  const std::string ethernet = PcapOf({.packets = 160}, 10);
  STRATA_ASSERT_OK_AND_ASSIGN(auto stations, ListVelodyneStations(Write(ethernet)));
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud truth, stations.at(0).read());
  const std::string type("\x08\x00", 2);
  const std::string vlan("\x81\x00\x00\x05", 4);
  for (const std::string& pcap : {OverLink(ethernet, 1, std::string(12, 'm') + vlan + type),
                                  OverLink(ethernet, 113, std::string(14, 'c') + type),
                                  OverLink(ethernet, 276, type + std::string(18, 'c')),
                                  OverLink(ethernet, 101, "")}) {
    STRATA_ASSERT_OK_AND_ASSIGN(stations, ListVelodyneStations(Write(pcap)));
    STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud cloud, stations.at(0).read());
    EXPECT_EQ(cloud.points, truth.points);
  }
}

TEST_F(VelodyneReaderTest, TheHourOfTheSensorEnds) {
  ExpectOraclePoints(Write(PcapOf({.packets = 230, .stamp = 3'599'850'000}, 4)), 2);
}

TEST_F(VelodyneReaderTest, ASectorThatIsLeftOutIsNotTurnedThrough) {
  Planted planted{.packets = 150};
  std::string file = PcapOf(planted, 5);
  // What lies between 90° and 270° is not sent.
  for (std::size_t at = 24 + 16 + 42; at < file.size(); at += 16 + 42 + 1206) {
    for (std::size_t block = 0; block < 12; ++block) {
      std::uint16_t azimuth = 0;
      std::memcpy(&azimuth, file.data() + at + 100 * block + 2, 2);
      const int kept = azimuth / 2 + (azimuth >= 18000 ? 18000 : 0);
      PutAt(file, at + 100 * block + 2, static_cast<std::uint16_t>(kept % 36000));
    }
  }
  ExpectOraclePoints(Write(file), 1);
}

TEST_F(VelodyneReaderTest, ScansHaveNumbersAndTimes) {
  const auto path = Write(PcapOf({.packets = 230}, 6));
  EXPECT_THAT(ListScans({path}, {}),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("2 scans and no poses")));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto scans, ListScans({path}, {.poses = kNoPoses}));
  ASSERT_EQ(scans.size(), 2U);
  EXPECT_EQ(scans[1].path.filename(), "drive.pcap:1");
  const absl::Duration turn = *scans[1].time - *scans[0].time;
  EXPECT_NEAR(absl::ToDoubleSeconds(turn), 75 * 1327e-6, 1e-6);  // 900 blocks
  const auto poses = dir_.path() / "poses.txt";
  STRATA_ASSERT_OK(WriteFileBytes(poses, "0 0 1 0 0 0 0 0 1\n1 0 2 0 0 0 0 0 1\n"));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto placed, ListScans({path}, {.poses = poses}));
  EXPECT_EQ(placed[1].T_map_scan.translation().x(), 2);
  // A trajectory goes by the times that the scans have, since their names are none.
  auto timed = scans;
  STRATA_ASSERT_OK(TimeByName(timed));
  EXPECT_EQ(timed[1].time, scans[1].time);
  const auto tum = dir_.path() / "poses.tum";
  const double seconds = absl::ToDoubleSeconds(*scans[1].time - absl::UnixEpoch());
  STRATA_ASSERT_OK(WriteFileBytes(tum, absl::StrFormat("%.6f 3 0 0 0 0 0 1\n", seconds + 5e-4)));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto by_time, ListScans({path}, {.poses = tum}));
  EXPECT_EQ(by_time[1].T_map_scan.translation().x(), 3);
  EXPECT_THAT(by_time[0].pose_status,
              StatusIs(absl::StatusCode::kNotFound, HasSubstr("no pose of time 1700000000.")));
  EXPECT_THAT(ReadScan(path),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("holds 2 scans")));
}

TEST_F(VelodyneReaderTest, RefusalsSayWhatItIs) {
  const auto expect = [this](const std::string& bytes, const std::string& message) {
    EXPECT_THAT(ListVelodyneStations(Write(bytes)),
                StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr(message)));
  };
  expect("", "no file of packets (pcap)");
  expect("LASF, which is none at all, and long enough", "no file of packets (pcap)");
  expect(PcapHead(), "no UDP packet");
  expect(PcapOf({.packets = 80}, 7), "no whole revolution in 80 packets");
  expect(PcapOf({.model = 0x28, .packets = 1}, 7),
         "a VLP-32C (factory byte 0x28); VLP-16 (0x22) and");
  expect(PcapOf({.model = 0x77, .packets = 1}, 7), "a sensor not known (factory byte 0x77)");
  expect(PcapHead() + Record(std::string(8448, 'x'), 0, 7502),
         "'ouster-cli source IN.pcap save OUT.pcd'");
  expect(PcapHead() + Record("hello", 0, 53),
         "none of 1 UDP packets is a Velodyne's of 1206 bytes; the first goes to port 53");
  std::string two = PcapOf({.packets = 2}, 7);
  two[24 + 16 + 29] = 7;
  expect(two, "packets of several sensors, 192.168.1.7 and 192.168.1.201; 'tcpdump -r");
  std::string no_flag = PcapOf({.packets = 1}, 7);
  no_flag[24 + 16 + 42] = 0;
  expect(no_flag, "block 0 of a packet has no flag");
  std::string other_link = PcapHead();
  other_link[20] = 127;
  expect(other_link, "link type 127");
}

TEST_F(VelodyneReaderTest, DamageIsAStatus) {
  std::string file = PcapOf({.packets = 18, .step = 400}, 8);
  const auto read = [this](const std::string& bytes) -> absl::StatusOr<PointCloud> {
    STRATA_ASSIGN_OR_RETURN(const auto stations, ListVelodyneStations(Write(bytes)));
    return stations.back().read();
  };
  STRATA_ASSERT_OK(read(file));
  std::mt19937_64 random(9);
  for (int i = 0; i < 500; ++i) {
    std::string damaged = file;
    const std::uint64_t where = random();
    damaged[where % (i % 2 == 0 ? 200 : damaged.size())] = static_cast<char>(random());
    if (i % 5 == 0) damaged.resize(random() % damaged.size());
    const auto cloud = read(damaged);
    if (cloud.ok()) {
      EXPECT_TRUE(ValidateCloud(*cloud).ok());
    } else {
      EXPECT_EQ(cloud.status().code(), absl::StatusCode::kInvalidArgument) << cloud.status();
    }
  }
}

TEST_F(VelodyneReaderTest, RecordedPacketsAreWhatTheManualSays) {
  STRATA_REQUIRE_DATA(path, "importer_samples");
  ExpectOraclePoints(path / "velodyne_hdl32.pcap", 2);
  EXPECT_THAT(ListVelodyneStations(path / "ouster_OS1-128_n3.pcap"),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("packets of an Ouster")));
}

}  // namespace
}  // namespace strata
