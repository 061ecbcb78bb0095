#include "client/formats/packets/velodyne_reader.h"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/time/time.h"

#include "client/formats/packets/packet_file.h"
#include "client/formats/packets/velodyne_packet.h"
#include "client/formats/parsing/cloud_builder.h"
#include "client/formats/survey/station.h"
#include "core/cloud/point_cloud.h"
#include "core/common/status.h"

namespace strata {
namespace {

constexpr int kHalfTurn = 18000;          // [0.01°]
constexpr double kHourUs = 3600.0 * 1e6;  // after which the sensor's clock begins anew
constexpr std::uint16_t kOusterPort = 7502;

std::string AddressText(std::uint32_t address) {
  return absl::StrCat(
      address >> 24, ".", address >> 16 & 255, ".", address >> 8 & 255, ".", address & 255);
}

// Walks through the blocks of one sensor.
class VelodyneBlocks {
 public:
  // What a block is in the file.
  struct Place {
    std::int64_t packet = 0;
    std::size_t block = 0;
  };

  explicit VelodyneBlocks(PacketFile file) : file_(std::move(file)) {}

  void Seek(const Place& place) {
    file_.Seek(place.packet);
    packet_.reset();
    block_ = place.block;
  }

  // Goes to the next block; false at the end.
  absl::StatusOr<bool> Next() {
    if (packet_.has_value()) ++block_;
    if (packet_.has_value() && block_ < kVelodyneBlocks) return true;
    if (packet_.has_value()) block_ = 0;
    return NextPacket();
  }

  VelodynePacket packet() const { return VelodynePacket(packet_->payload); }
  std::size_t block() const { return block_; }
  Place place() const { return {packet_->place, block_}; }
  absl::Time captured() const { return packet_->captured; }
  // UDP packets that were no data of the sensor, and the last of them.
  std::size_t others() const { return others_; }
  const std::optional<UdpPacket>& other() const { return other_; }

 private:
  absl::StatusOr<bool> NextPacket() {
    while ((packet_ = file_.Next()).has_value()) {
      if (packet_->payload.size() == kVelodyneBytes) {
        STRATA_RETURN_IF_ERROR(packet().Check());
        STRATA_RETURN_IF_ERROR(CheckSender());
        return true;
      }
      ++others_;
      if (!other_.has_value() || packet_->port == kOusterPort) other_ = packet_;
    }
    return false;
  }

  absl::Status CheckSender() {
    const std::uint32_t address = packet_->address;
    if (!sender_.has_value()) sender_ = address;
    if (*sender_ == address) return absl::OkStatus();
    return absl::InvalidArgumentError(absl::StrCat("packets of several sensors, ",
                                                   AddressText(*sender_),
                                                   " and ",
                                                   AddressText(address),
                                                   "; 'tcpdump -r IN.pcap -w OUT.pcap src host ",
                                                   AddressText(*sender_),
                                                   "' takes those of one"));
  }

  PacketFile file_;
  std::optional<UdpPacket> packet_;
  std::size_t block_ = 0;
  std::optional<std::uint32_t> sender_;
  std::size_t others_ = 0;
  std::optional<UdpPacket> other_;
};

// Whether the head passed azimuth 0 between two blocks.
bool Passed(std::uint16_t before, std::uint16_t now) { return now + kHalfTurn < before; }

absl::StatusOr<PointCloud> ReadRevolution(const std::filesystem::path& path,
                                          const VelodyneBlocks::Place& begin) {
  STRATA_ASSIGN_OR_RETURN(PacketFile file, PacketFile::Open(path));
  VelodyneBlocks blocks(std::move(file));
  blocks.Seek(begin);
  using enum Meaning;
  STRATA_ASSIGN_OR_RETURN(CloudBuilder builder,
                          CloudBuilder::Create({kX, kY, kZ, kIntensity, kTime}));
  builder.HoldFloats();
  std::optional<double> start_us;
  std::uint16_t before = 0;
  while (true) {
    STRATA_ASSIGN_OR_RETURN(const bool more, blocks.Next());
    if (!more) break;
    const std::uint16_t azimuth = blocks.packet().azimuth(blocks.block());
    if (start_us.has_value() && Passed(before, azimuth)) break;
    const double now_us = blocks.packet().time_us(blocks.block());
    if (!start_us.has_value()) start_us = now_us;
    const double hours_us = now_us < *start_us - kHourUs / 2 ? kHourUs : 0.0;
    blocks.packet().AddBlock(blocks.block(), *start_us - hours_us, builder);
    before = azimuth;
  }
  return std::move(builder).Build();
}

absl::Status NoRevolution(const VelodyneBlocks& blocks, std::size_t packets) {
  if (packets > 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("no whole revolution in ", packets, " packets: the recording is too short"));
  }
  if (!blocks.other().has_value()) return absl::InvalidArgumentError("no UDP packet");
  const UdpPacket& other = *blocks.other();
  if (other.port == kOusterPort) {
    return absl::InvalidArgumentError(
        "holds packets of an Ouster (UDP port 7502), which are not read; 'ouster-cli source "
        "IN.pcap "
        "save OUT.pcd' of Ouster's SDK makes PCD of them");
  }
  return absl::InvalidArgumentError(absl::StrCat("none of ",
                                                 blocks.others(),
                                                 " UDP packets is a Velodyne's of ",
                                                 kVelodyneBytes,
                                                 " bytes; the first goes to port ",
                                                 other.port));
}

}  // namespace

absl::StatusOr<std::vector<Station>> ListVelodyneStations(const std::filesystem::path& path) {
  STRATA_ASSIGN_OR_RETURN(PacketFile file, PacketFile::Open(path));
  VelodyneBlocks blocks(std::move(file));
  std::vector<Station> stations;
  std::size_t packets = 0;
  std::optional<std::uint16_t> before;
  while (true) {
    STRATA_ASSIGN_OR_RETURN(const bool more, blocks.Next());
    if (!more) break;
    if (blocks.block() == 0) ++packets;
    const std::uint16_t azimuth = blocks.packet().azimuth(blocks.block());
    if (before.has_value() && Passed(*before, azimuth)) {
      Station& station = stations.emplace_back();
      station.time = blocks.captured();
      station.read = [path, begin = blocks.place()] { return ReadRevolution(path, begin); };
    }
    before = azimuth;
  }
  // The last one that began has no end.
  if (!stations.empty()) stations.pop_back();
  if (stations.empty()) return NoRevolution(blocks, packets);
  return stations;
}

}  // namespace strata
