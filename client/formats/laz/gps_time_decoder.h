// Times of GPS [s] as LAZ has them: bits of doubles, taken for whole numbers of 64 bits, as
// multiples of a difference that was seen before, in up to four sequences that alternate.
#ifndef STRATA_CLIENT_FORMATS_LAZ_GPS_TIME_DECODER_H_
#define STRATA_CLIENT_FORMATS_LAZ_GPS_TIME_DECODER_H_

#include <array>
#include <cstddef>
#include <cstdint>

#include "client/formats/laz/arithmetic_decoder.h"
#include "client/formats/laz/integer_decoder.h"

namespace strata {

class GpsTimeDecoder {
 public:
  // In GPSTIME11 a time may also be that of the point before; within POINT14 it is only there where
  // it is not.
  GpsTimeDecoder(bool may_stay, std::uint64_t first);

  std::uint64_t Next(ArithmeticDecoder& decoder);

 private:
  struct Sequence {
    std::uint64_t time = 0;
    std::int32_t step = 0;
    int unlike_steps = 0;  // one after the other
  };
  enum class Found : std::uint8_t { kTime, kOtherSequence };

  Found FirstStep(ArithmeticDecoder& decoder);
  Found Step(ArithmeticDecoder& decoder);
  void StepBy(ArithmeticDecoder& decoder, std::uint32_t code);
  void FarTime(ArithmeticDecoder& decoder);
  void Switch(std::uint32_t by) { current_ = (current_ + by) % sequences_.size(); }

  std::uint32_t stay_;  // how many codes say that nothing changes
  SymbolModel first_steps_;
  SymbolModel steps_;
  IntegerDecoder numbers_;
  std::array<Sequence, 4> sequences_;
  std::size_t current_ = 0;
  std::size_t newest_ = 0;
};

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_LAZ_GPS_TIME_DECODER_H_
