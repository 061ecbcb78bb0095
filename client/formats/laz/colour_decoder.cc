#include "client/formats/laz/colour_decoder.h"

#include <algorithm>
#include <cstdint>

#include "client/formats/laz/arithmetic_decoder.h"

namespace strata {
namespace {

// The symbol of what changed: two bits each of red, green and blue, low byte and high byte, and one
// for "red, green and blue are not the same".
constexpr std::uint32_t kRedBit = 0;
constexpr std::uint32_t kGreenBit = 2;
constexpr std::uint32_t kBlueBit = 4;
constexpr std::uint32_t kColouredBit = 6;

bool IsSet(std::uint32_t bits, std::uint32_t bit) { return (bits >> bit & 1) != 0; }

int ByteOf(std::uint16_t value, std::uint32_t half) { return value >> (8 * half) & 0xFF; }

void SetByte(std::uint32_t half, std::uint32_t byte, std::uint16_t& value) {
  const std::uint32_t shift = 8 * half;
  value = static_cast<std::uint16_t>((value & ~(0xFFU << shift)) | (byte & 0xFF) << shift);
}

// A byte of `value`: what was read behind what was predicted.
void ChangeByte(ArithmeticDecoder& decoder,
                SymbolModel& model,
                int predicted,
                std::uint32_t half,
                std::uint16_t& value) {
  const auto near = static_cast<std::uint32_t>(std::clamp(predicted, 0, 255));
  SetByte(half, near + decoder.Symbol(model), value);
}

}  // namespace

ColourDecoder::ColourDecoder() : changed_(128), differences_(6, 256) {}

Channels ColourDecoder::Next(ArithmeticDecoder& decoder, const Channels& last) {
  Channels next = last;
  const std::uint32_t changed = decoder.Symbol(changed_);
  for (const std::uint32_t half : {0U, 1U}) {
    if (!IsSet(changed, kRedBit + half)) continue;
    ChangeByte(decoder, differences_[kRedBit + half], ByteOf(last[0], half), half, next[0]);
  }
  if (!IsSet(changed, kColouredBit)) return {next[0], next[0], next[0]};
  for (const std::uint32_t half : {0U, 1U}) {
    int step = ByteOf(next[0], half) - ByteOf(last[0], half);
    if (IsSet(changed, kGreenBit + half)) {
      const int predicted = step + ByteOf(last[1], half);
      ChangeByte(decoder, differences_[kGreenBit + half], predicted, half, next[1]);
    }
    if (!IsSet(changed, kBlueBit + half)) continue;
    step = (step + ByteOf(next[1], half) - ByteOf(last[1], half)) / 2;
    const int predicted = step + ByteOf(last[2], half);
    ChangeByte(decoder, differences_[kBlueBit + half], predicted, half, next[2]);
  }
  return next;
}

InfraredDecoder::InfraredDecoder() : changed_(4), differences_(2, 256) {}

std::uint16_t InfraredDecoder::Next(ArithmeticDecoder& decoder, std::uint16_t last) {
  std::uint16_t next = last;
  const std::uint32_t changed = decoder.Symbol(changed_);
  for (const std::uint32_t half : {0U, 1U}) {
    if (IsSet(changed, half)) {
      ChangeByte(decoder, differences_[half], ByteOf(last, half), half, next);
    }
  }
  return next;
}

}  // namespace strata
