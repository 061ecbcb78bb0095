// Numbers in the records of points, little-endian.
#ifndef STRATA_CLIENT_FORMATS_LAZ_ITEM_BYTES_H_
#define STRATA_CLIENT_FORMATS_LAZ_ITEM_BYTES_H_

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

namespace strata {

// REQUIRES: sizeof(T) bytes are there.
template <typename T>
T NumberOf(const char* bytes) {
  std::array<char, sizeof(T)> raw;
  std::memcpy(raw.data(), bytes, sizeof(T));
  if (std::endian::native == std::endian::big) std::reverse(raw.begin(), raw.end());
  return std::bit_cast<T>(raw);
}

template <typename T>
void SetNumber(T value, char* bytes) {
  auto raw = std::bit_cast<std::array<char, sizeof(T)>>(value);
  if (std::endian::native == std::endian::big) std::reverse(raw.begin(), raw.end());
  std::memcpy(bytes, raw.data(), sizeof(T));
}

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_LAZ_ITEM_BYTES_H_
