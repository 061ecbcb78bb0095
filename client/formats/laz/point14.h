// POINT14: what every point of record formats 6 to 10 has, in nine layers.
#ifndef STRATA_CLIENT_FORMATS_LAZ_POINT14_H_
#define STRATA_CLIENT_FORMATS_LAZ_POINT14_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "client/formats/laz/arithmetic_decoder.h"
#include "client/formats/laz/layered_items.h"

namespace strata {

inline constexpr std::size_t kPoint14Layers = 9;
// A scanner may have several: each is predicted by itself.
inline constexpr std::size_t kScannerChannels = 4;
// The version that has all items of a point in its channel. In the one before it the others learn
// of the channel where it changes only, and stand in channel 0 else; and they predict the first
// value after a change to a channel that was there already from the last of where they were before,
// and keep the new value there.
inline constexpr std::uint16_t kRemembersChannels = 4;

class Point14 final : public LayeredItem {
 public:
  // REQUIRES: as many layers.
  Point14(std::uint16_t version,
          std::vector<ArithmeticDecoder> layers,
          const char* first,
          std::size_t& channel);
  ~Point14() override;

  void Next(std::size_t& channel, char* item) override;
  bool ok() const override;

 private:
  struct Fields;
  struct Channel;
  struct Change;

  Change NextChange();
  void NextReturn(const Change& change, Channel& channel);
  void NextPlace(const Change& change, Channel& channel);
  void NextFlags(Channel& channel);
  void NextRest(const Change& change, Channel& channel);

  bool tells_channel_;
  std::vector<ArithmeticDecoder> layers_;
  std::array<std::unique_ptr<Channel>, kScannerChannels> channels_;
  std::size_t current_ = 0;
};

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_LAZ_POINT14_H_
