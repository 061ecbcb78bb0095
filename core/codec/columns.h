// Columns of whole numbers, each compressed by itself: the layer between the tile codecs and zstd.
//
// A number becomes a one-byte token and, when large, raw bits. Tokens of one column go to one zstd
// frame (entropy coding pays there); the raw bits of all columns share one bit string (they are
// noise, and compressing noise only costs time). Encoder and decoder have the same calls: each
// takes the value to write and hands back the value written or read, so that one templated walk
// over a tile does both.
#ifndef STRATA_CORE_CODEC_COLUMNS_H_
#define STRATA_CORE_CODEC_COLUMNS_H_

#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/codec/bytes.h"

namespace strata {

// Appends `bytes` compressed at zstd level 3, or stored, or as one repeated byte, whichever is
// smallest.
void PutColumn(std::string& out, absl::string_view bytes);
// The same for bytes that are mostly noise: looks for repetitions, the slow part of zstd, only
// where a sample of the bytes has some, and codes their frequencies alone otherwise.
void PutNoisyColumn(std::string& out, absl::string_view bytes);
// Reads what either wrote; `max_size` bounds what a hostile input may make it allocate.
// DATA_LOSS.
absl::Status TakeColumn(ByteReader& reader, std::size_t max_size, std::string& bytes);

// Token of a number: 0–127 stand for themselves; above, exponent and next bit are in the token and
// the lower bits follow raw.
inline constexpr int kDirectBits = 7;
struct Token {
  std::uint8_t token;
  int raw_bits;
};
inline Token TokenOf(std::uint64_t value) {
  if (value < (1U << kDirectBits)) return {static_cast<std::uint8_t>(value), 0};
  const int exponent = std::bit_width(value) - 1;
  const auto next_bit = static_cast<int>(value >> (exponent - 1) & 1);
  return {static_cast<std::uint8_t>((1 << kDirectBits) + 2 * (exponent - kDirectBits) + next_bit),
          exponent - 1};
}

class ColumnEncoder {
 public:
  explicit ColumnEncoder(int columns) : columns_(columns), bit_bytes_(columns) {}

  std::uint64_t Code(int column, std::uint64_t value) {
    const Token token = TokenOf(value);
    columns_[column].push_back(static_cast<char>(token.token));
    if (token.raw_bits > 0) PutBits(value, token.raw_bits);
    return value;
  }
  // A number as its difference to what both sides expect. Differences wrap around at 64 bits.
  std::int64_t CodeRelative(int column, std::int64_t value, std::int64_t expected) {
    Code(column, ZigZag(WrappingSubtract(value, expected)));
    return value;
  }
  // A number below 256 as itself, without raw bits.
  std::uint8_t CodeByte(int column, std::uint8_t value) {
    columns_[column].push_back(static_cast<char>(value));
    return value;
  }

  // A yes or no; eight of them share a byte, so that their column may take less than a bit each.
  bool CodeBit(int column, bool bit) {
    BitByte& byte = bit_bytes_[column];
    if (byte.used == 0) columns_[column].push_back('\0');
    columns_[column].back() = static_cast<char>(columns_[column].back() | (bit << byte.used));
    byte.used = (byte.used + 1) & 7;
    return bit;
  }

  // Appends all columns and the raw bits.
  void Finish(std::string& out);

 private:
  void PutBits(std::uint64_t value, int count);

  struct BitByte {
    int used = 0;  // bits of the last byte, of 8
  };
  std::vector<std::string> columns_;
  std::vector<BitByte> bit_bytes_;
  std::string raw_;
  std::uint64_t pending_ = 0;  // bits not yet in raw_
  int pending_count_ = 0;      // < 8
};

// Reads the columns of a ColumnEncoder by the same sequence of calls; the values handed in are
// ignored, those handed back are the stored ones, of any magnitude. Past the end of a column it
// yields zeros and Finish() answers DATA_LOSS.
class ColumnDecoder {
 public:
  // Expects at most `max_tokens` in a column, and `max_bytes` of memory for all of them; what
  // announces more is DATA_LOSS before it is decompressed.
  static absl::StatusOr<ColumnDecoder> Open(
      ByteReader& reader,
      int columns,
      std::size_t max_tokens,
      std::size_t max_bytes = std::numeric_limits<std::size_t>::max());

  std::uint64_t Code(int column, std::uint64_t /*value*/) {
    const std::uint8_t token = NextByte(column);
    if (token < (1U << kDirectBits)) return token;
    const int exponent = kDirectBits + ((token - (1 << kDirectBits)) >> 1);
    if (exponent > 63) {
      ok_ = false;
      return 0;
    }
    return (std::uint64_t{2} | (token & 1U)) << (exponent - 1) | TakeBits(exponent - 1);
  }
  std::int64_t CodeRelative(int column, std::int64_t /*value*/, std::int64_t expected) {
    return WrappingAdd(UnZigZag(Code(column, 0)), expected);
  }
  std::uint8_t CodeByte(int column, std::uint8_t /*value*/) { return NextByte(column); }

  bool CodeBit(int column, bool /*bit*/) {
    Column& c = columns_[column];
    if (c.bits_left == 0) {
      c.bit_byte = NextByte(column);
      c.bits_left = 8;
    }
    const bool bit = (c.bit_byte & 1) != 0;
    c.bit_byte >>= 1;
    --c.bits_left;
    return bit;
  }

  // OK if every column and the raw bits were read to their end, no further.
  absl::Status Finish() const;

 private:
  std::uint8_t NextByte(int column) {
    Column& c = columns_[column];
    if (c.position == c.bytes.size()) {
      ok_ = false;
      return 0;
    }
    return static_cast<std::uint8_t>(c.bytes[c.position++]);
  }
  std::uint64_t TakeBits(int count);

  struct Column {
    std::string bytes;
    std::size_t position = 0;
    std::uint8_t bit_byte = 0;
    int bits_left = 0;
  };
  std::vector<Column> columns_;
  std::string raw_;
  std::size_t raw_position_ = 0;  // bits
  bool ok_ = true;
};

}  // namespace strata

#endif  // STRATA_CORE_CODEC_COLUMNS_H_
