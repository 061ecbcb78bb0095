// Colours of 16 bits a channel as LAZ has them (RGB12, RGB14, the NIR of RGBNIR14): which of their
// bytes changed, and by how much.
#ifndef STRATA_CLIENT_FORMATS_LAZ_COLOUR_DECODER_H_
#define STRATA_CLIENT_FORMATS_LAZ_COLOUR_DECODER_H_

#include <array>
#include <cstdint>

#include "client/formats/laz/arithmetic_decoder.h"

namespace strata {

using Channels = std::array<std::uint16_t, 3>;

class ColourDecoder {
 public:
  ColourDecoder();
  // Behind `last`.
  Channels Next(ArithmeticDecoder& decoder, const Channels& last);

 private:
  SymbolModel changed_;
  SymbolModels differences_;
};

class InfraredDecoder {
 public:
  InfraredDecoder();
  std::uint16_t Next(ArithmeticDecoder& decoder, std::uint16_t last);

 private:
  SymbolModel changed_;
  SymbolModels differences_;
};

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_LAZ_COLOUR_DECODER_H_
