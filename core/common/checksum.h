// Checksums of what is stored and sent. Stable across machines and versions (XXH3 of xxHash 0.8):
// part of the persistent format.
#ifndef STRATA_CORE_COMMON_CHECKSUM_H_
#define STRATA_CORE_COMMON_CHECKSUM_H_

#include <cstdint>
#include <string>

#include "absl/strings/string_view.h"

namespace strata {

// XXH3-64 of `bytes`: guards against damage, not against malice.
std::uint64_t Checksum64(absl::string_view bytes);

// A 128-bit content hash, computed piece by piece; equal bytes give equal digests however they were
// split.
class ContentHasher {
 public:
  ContentHasher();
  ~ContentHasher();
  ContentHasher(const ContentHasher&) = delete;
  ContentHasher& operator=(const ContentHasher&) = delete;

  void Add(absl::string_view bytes);
  // 32 lower-case hexadecimal digits of everything added so far.
  std::string HexDigest() const;

 private:
  void* state_;  // XXH3_state_t, kept out of the header
};

}  // namespace strata

#endif  // STRATA_CORE_COMMON_CHECKSUM_H_
