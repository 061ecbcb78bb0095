// Whole numbers out of an arithmetic coder, as what they differ by from a prediction: first in how
// many bits the difference is, then the bits, of which the eight highest are modelled.
#ifndef STRATA_CLIENT_FORMATS_LAZ_INTEGER_DECODER_H_
#define STRATA_CLIENT_FORMATS_LAZ_INTEGER_DECODER_H_

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "client/formats/laz/arithmetic_decoder.h"

namespace strata {

// The part of a context that comes of the length of another number's difference: the even number
// below it, up to a most.
inline std::size_t EvenLength(std::uint32_t length, std::uint32_t most) {
  return std::min(length, most) & ~std::uint32_t{1};
}

class IntegerDecoder {
 public:
  // Numbers of `bits` bits, 8, 16 or 32; how long differences are is modelled in each context.
  IntegerDecoder(std::uint32_t bits, std::size_t contexts);

  // The number, modulo 2^bits.
  std::int32_t Next(ArithmeticDecoder& decoder, std::int32_t predicted, std::size_t context = 0);
  // In how many bits the last difference was.
  std::uint32_t length() const { return length_; }

 private:
  std::int32_t Difference(ArithmeticDecoder& decoder);

  std::uint32_t length_ = 0;
  SymbolModels lengths_;
  BitModel one_bit_;
  std::vector<SymbolModel> high_bits_;  // by length
};

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_LAZ_INTEGER_DECODER_H_
