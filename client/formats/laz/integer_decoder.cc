#include "client/formats/laz/integer_decoder.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "client/formats/laz/arithmetic_decoder.h"

namespace strata {
namespace {

constexpr std::uint32_t kModelledBits = 8;

}  // namespace

IntegerDecoder::IntegerDecoder(std::uint32_t bits, std::size_t contexts)
    : lengths_(contexts, bits + 1), high_bits_(bits + 1) {}

std::int32_t IntegerDecoder::Next(ArithmeticDecoder& decoder,
                                  std::int32_t predicted,
                                  std::size_t context) {
  length_ = decoder.Symbol(lengths_[context]);
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(predicted) +
                                   static_cast<std::uint32_t>(Difference(decoder)));
}

// Of length k: −2ᵏ + 1 to −2ᵏ⁻¹ and 2ᵏ⁻¹ + 1 to 2ᵏ, counted from the lowest; of length 0: 0 and 1.
std::int32_t IntegerDecoder::Difference(ArithmeticDecoder& decoder) {
  if (length_ == 0) return decoder.Bit(one_bit_) ? 1 : 0;
  if (length_ == 32) return std::numeric_limits<std::int32_t>::min();
  SymbolModel& model = high_bits_[length_];
  const std::uint32_t modelled = std::min(length_, kModelledBits);
  if (!model.ready()) model = SymbolModel(1U << modelled);
  std::uint32_t bits = decoder.Symbol(model);
  if (length_ > modelled) {
    const std::uint32_t low = length_ - modelled;
    bits = bits << low | decoder.Bits(static_cast<int>(low));
  }
  const std::uint32_t half = 1U << (length_ - 1);
  return static_cast<std::int32_t>(bits >= half ? bits + 1 : bits - (2 * half - 1));
}

}  // namespace strata
