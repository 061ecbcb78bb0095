// Packets that a network carried, as tcpdump and Wireshark keep them (pcap, pcapng).
#ifndef STRATA_CLIENT_FORMATS_PACKETS_PACKET_FILE_H_
#define STRATA_CLIENT_FORMATS_PACKETS_PACKET_FILE_H_

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"

struct pcap;

namespace strata {

// What one UDP packet carried; valid until the next one is read.
struct UdpPacket {
  std::int64_t place = 0;     // of the packet in the file, for Seek()
  absl::Time captured;        // by the clock of who wrote the file
  std::uint32_t address = 0;  // IPv4 of the sender
  std::uint16_t port = 0;     // that it was sent to
  absl::string_view payload;
};

class PacketFile {
 public:
  // INVALID_ARGUMENT if it is no such file, or of a link that is neither Ethernet, Linux "any" nor
  // bare IP.
  static absl::StatusOr<PacketFile> Open(const std::filesystem::path& path);

  // The next UDP packet over IPv4, as much as there is of it; nothing at the end. Others are passed
  // over. A last record that is cut short, as of a recording that was broken off, is none.
  std::optional<UdpPacket> Next();
  // Goes to a packet that was read before, from this file or as it was opened earlier.
  void Seek(std::int64_t place);

 private:
  struct Close {
    void operator()(pcap* file) const;
  };

  explicit PacketFile(pcap* file) : file_(file) {}

  std::unique_ptr<pcap, Close> file_;
  int link_ = 0;
};

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_PACKETS_PACKET_FILE_H_
