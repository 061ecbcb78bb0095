// One data packet of a Velodyne VLP-16 or HDL-32E: distances, and from which direction each came
// (VLP-16 User Manual 63-9243, 9; HDL-32E User Manual 63-9113).
#ifndef STRATA_CLIENT_FORMATS_PACKETS_VELODYNE_PACKET_H_
#define STRATA_CLIENT_FORMATS_PACKETS_VELODYNE_PACKET_H_

#include <cstddef>
#include <cstdint>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

#include "client/formats/parsing/cloud_builder.h"

namespace strata {

inline constexpr std::size_t kVelodyneBytes = 1206;  // of a data packet's payload
inline constexpr std::size_t kVelodyneBlocks = 12;   // shots of all lasers, or two of 16

// The payload of a data packet.
class VelodynePacket {
 public:
  // REQUIRES: kVelodyneBytes of them, which outlive it.
  explicit VelodynePacket(absl::string_view payload) : payload_(payload) {}

  // INVALID_ARGUMENT naming the sensor, as its factory byte says, if it is another one, and blocks
  // that are none.
  absl::Status Check() const;

  // Where the head points to when the block's first laser fires, clockwise from above [0.01°].
  std::uint16_t azimuth(std::size_t block) const;
  // When that is, in the hour by the sensor's clock [µs].
  double time_us(std::size_t block) const;

  // Adds the returns of a block to a builder of x, y, z, intensity and time, in the sensor's frame:
  // x to where the azimuth is 0, z up; times are those of the shots, less `start_us` [s]. Of two
  // returns of a shot that are the same one counts.
  void AddBlock(std::size_t block, double start_us, CloudBuilder& builder) const;

 private:
  bool IsVlp16() const;
  bool HasTwoReturns() const;
  double StepOf(std::size_t block) const;
  absl::string_view Shot(std::size_t block, std::size_t i) const;

  absl::string_view payload_;
};

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_PACKETS_VELODYNE_PACKET_H_
