// Little-endian numbers in byte strings, whatever the machine; the reader treats its input as
// hostile.
#ifndef STRATA_CORE_CODEC_BYTES_H_
#define STRATA_CORE_CODEC_BYTES_H_

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <string>
#include <type_traits>

#include "absl/strings/string_view.h"

namespace strata {

// Appends `value` in sizeof(T) bytes, lowest first.
template <std::integral T>
void PutFixed(std::string& out, T value) {
  auto bits = static_cast<std::make_unsigned_t<T>>(value);
  for (std::size_t i = 0; i < sizeof(T); ++i) {
    out.push_back(static_cast<char>(static_cast<std::uint64_t>(bits) >> (8 * i) & 0xFF));
  }
}

// Appends `value` in base 128, lowest digit first, the high bit set on all but the last byte.
inline void PutVarint(std::string& out, std::uint64_t value) {
  for (; value >= 0x80; value >>= 7) out.push_back(static_cast<char>(value | 0x80));
  out.push_back(static_cast<char>(value));
}

// Signed ↔ unsigned with small magnitudes small: 0, -1, 1, -2 … ↔ 0, 1, 2, 3 …
constexpr std::uint64_t ZigZag(std::int64_t value) {
  return (static_cast<std::uint64_t>(value) << 1) ^ static_cast<std::uint64_t>(value >> 63);
}
constexpr std::int64_t UnZigZag(std::uint64_t value) {
  return static_cast<std::int64_t>(value >> 1) ^ -static_cast<std::int64_t>(value & 1);
}

// Sums and differences modulo 2⁶⁴: exact inverses of each other for any arguments.
constexpr std::int64_t WrappingAdd(std::int64_t a, std::int64_t b) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) + static_cast<std::uint64_t>(b));
}
constexpr std::int64_t WrappingSubtract(std::int64_t a, std::int64_t b) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) - static_cast<std::uint64_t>(b));
}

// Reads what the functions above wrote. Beyond the end it returns zeros and ok() turns false for
// good, so that a caller may check once after several reads. Keeps a view: the bytes must outlive
// it.
class ByteReader {
 public:
  explicit ByteReader(absl::string_view bytes) : bytes_(bytes) {}

  template <std::integral T>
  T Fixed() {
    const absl::string_view taken = Take(sizeof(T));
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < taken.size(); ++i) {
      bits |= std::uint64_t{static_cast<std::uint8_t>(taken[i])} << (8 * i);
    }
    return static_cast<T>(bits);
  }

  std::uint64_t Varint() {
    std::uint64_t value = 0;
    for (int shift = 0; shift < 64; shift += 7) {
      const auto byte = Fixed<std::uint8_t>();
      value |= std::uint64_t{byte & 0x7FU} << shift;
      if (byte < 0x80) return value;
    }
    ok_ = false;
    return 0;
  }

  // The next `size` bytes; empty and not ok() if fewer are left.
  absl::string_view Take(std::size_t size) {
    if (size > bytes_.size()) {
      ok_ = false;
      bytes_ = absl::string_view();
      return bytes_;
    }
    const absl::string_view taken = bytes_.substr(0, size);
    bytes_.remove_prefix(size);
    return taken;
  }

  bool ok() const { return ok_; }
  std::size_t remaining() const { return bytes_.size(); }

 private:
  absl::string_view bytes_;
  bool ok_ = true;
};

}  // namespace strata

#endif  // STRATA_CORE_CODEC_BYTES_H_
