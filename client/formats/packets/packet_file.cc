#include "client/formats/packets/packet_file.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <optional>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include <pcap/pcap.h>

#include "client/formats/parsing/byte_cursor.h"

namespace strata {
namespace {

constexpr std::uint16_t kIpV4 = 0x0800;
constexpr std::uint16_t kVlan = 0x8100;
constexpr std::uint8_t kUdp = 17;
constexpr std::uint16_t kFragmentPlace = 0x1FFF;  // 0: the first, which has the ports
constexpr std::size_t kAddressesBytes = 12;       // of Ethernet
constexpr std::size_t kCookedBytes = 14;          // before the type, of Linux "any"
constexpr std::size_t kCooked2Bytes = 18;         // behind the type, of its second version
constexpr std::size_t kIpBytes = 20;
constexpr std::size_t kUdpBytes = 8;

// What is behind the link's own header, if that is IPv4.
absl::string_view IpOf(int link, absl::string_view packet) {
  ByteCursor cursor(packet, true);
  if (link == DLT_RAW) return cursor.TakeRest();
  if (link == DLT_EN10MB) cursor.Take(kAddressesBytes);
  if (link == DLT_LINUX_SLL) cursor.Take(kCookedBytes);
  auto type = cursor.Get<std::uint16_t>();
  if (link == DLT_LINUX_SLL2) cursor.Take(kCooked2Bytes);
  if (type == kVlan) {
    cursor.Take(sizeof(std::uint16_t));
    type = cursor.Get<std::uint16_t>();
  }
  return type == kIpV4 ? cursor.TakeRest() : absl::string_view();
}

// Fills address, port and payload.
bool TakeUdp(absl::string_view ip, UdpPacket& packet) {
  ByteCursor cursor(ip, true);
  const auto version = cursor.Get<std::uint8_t>();
  cursor.Take(5);
  const auto fragment = cursor.Get<std::uint16_t>();
  cursor.Take(1);
  const auto protocol = cursor.Get<std::uint8_t>();
  cursor.Take(2);
  packet.address = cursor.Get<std::uint32_t>();
  cursor.Take(4);
  const std::size_t head = std::size_t{4} * (version & 15);
  if (version >> 4 != 4 || head < kIpBytes || protocol != kUdp) return false;
  if ((fragment & kFragmentPlace) != 0) return false;
  cursor.Take(head - kIpBytes + 2);
  packet.port = cursor.Get<std::uint16_t>();
  const auto bytes = cursor.Get<std::uint16_t>();
  cursor.Take(2);
  if (!cursor.ok() || bytes < kUdpBytes) return false;
  packet.payload = cursor.Take(std::min<std::size_t>(bytes - kUdpBytes, cursor.remaining()));
  return true;
}

}  // namespace

void PacketFile::Close::operator()(pcap* file) const { pcap_close(file); }

absl::StatusOr<PacketFile> PacketFile::Open(const std::filesystem::path& path) {
  std::array<char, PCAP_ERRBUF_SIZE> why{};
  pcap* const opened = pcap_open_offline(path.c_str(), why.data());
  if (opened == nullptr) {
    return absl::InvalidArgumentError(absl::StrCat("no file of packets (pcap): ", why.data()));
  }
  PacketFile file(opened);
  file.link_ = pcap_datalink(opened);
  for (const int link : {DLT_EN10MB, DLT_LINUX_SLL, DLT_LINUX_SLL2, DLT_RAW}) {
    if (file.link_ == link) return file;
  }
  return absl::InvalidArgumentError(
      absl::StrCat("packets of link type ",
                   file.link_,
                   "; Ethernet (1), Linux 'any' (113, 276) and IP (101) are read"));
}

std::optional<UdpPacket> PacketFile::Next() {
  pcap_pkthdr* head = nullptr;
  const unsigned char* bytes = nullptr;
  UdpPacket packet;
  while (true) {
    packet.place = ftello(pcap_file(file_.get()));
    if (pcap_next_ex(file_.get(), &head, &bytes) != 1) return std::nullopt;
    packet.captured = absl::TimeFromTimeval(head->ts);
    const absl::string_view whole(reinterpret_cast<const char*>(bytes), head->caplen);
    if (TakeUdp(IpOf(link_, whole), packet)) return packet;
  }
}

void PacketFile::Seek(std::int64_t place) { fseeko(pcap_file(file_.get()), place, SEEK_SET); }

}  // namespace strata
