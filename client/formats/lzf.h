// The LZF format of binary_compressed PCD files.
#ifndef STRATA_CLIENT_FORMATS_LZF_H_
#define STRATA_CLIENT_FORMATS_LZF_H_

#include <cstddef>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace strata {

// `size` bytes out of `packed`. A control byte c < 32 is followed by c + 1 literal bytes; else it
// is a copy of (c >> 5) + 2 bytes (7: plus the next byte) from (c & 31) · 256 + next byte + 1 back.
// INVALID_ARGUMENT naming the byte if that does not come out, or if no input so short can give so
// much (nothing is allocated then).
absl::StatusOr<std::string> DecompressLzf(absl::string_view packed, std::size_t size);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_LZF_H_
