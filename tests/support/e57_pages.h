// Pages of an E57 file, by bits and from the standard: nothing shared with the reader.
#ifndef STRATA_TESTS_SUPPORT_E57_PAGES_H_
#define STRATA_TESTS_SUPPORT_E57_PAGES_H_

#include <cstddef>
#include <cstdint>
#include <string>

#include "absl/strings/string_view.h"

namespace strata::testing {

inline constexpr std::size_t kE57PageBytes = 1024;
inline constexpr std::size_t kE57PagePayload = 1020;

// CRC-32C, bit by bit.
inline std::uint32_t E57Checksum(absl::string_view bytes) {
  std::uint32_t crc = 0xFFFFFFFF;
  for (const char byte : bytes) {
    crc ^= static_cast<unsigned char>(byte);
    for (int i = 0; i < 8; ++i) crc = (crc >> 1) ^ ((crc & 1) != 0 ? 0x82F63B78U : 0U);
  }
  return ~crc;
}

// Makes the checksums of all whole pages right.
inline void SealE57Pages(std::string& file) {
  for (std::size_t at = 0; at + kE57PageBytes <= file.size(); at += kE57PageBytes) {
    const std::uint32_t crc = E57Checksum(absl::string_view(file).substr(at, kE57PagePayload));
    for (std::size_t k = 0; k < 4; ++k) {
      file[at + kE57PagePayload + k] = static_cast<char>(crc >> (24 - 8 * k));
    }
  }
}

// The place with checksums of one without.
inline std::uint64_t PhysicalE57(std::uint64_t logical) {
  return logical / kE57PagePayload * kE57PageBytes + logical % kE57PagePayload;
}

// A file of these bytes, the last page filled up with zeros.
inline std::string E57PagesOf(absl::string_view logical) {
  std::string file;
  for (std::size_t at = 0; at < logical.size(); at += kE57PagePayload) {
    const absl::string_view page = logical.substr(at, kE57PagePayload);
    file.append(page.data(), page.size());
    file.append(kE57PageBytes - page.size(), '\0');
  }
  SealE57Pages(file);
  return file;
}

}  // namespace strata::testing

#endif  // STRATA_TESTS_SUPPORT_E57_PAGES_H_
