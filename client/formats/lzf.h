// The LZF format of binary_compressed PCD files.
#ifndef STRATA_CLIENT_FORMATS_LZF_H_
#define STRATA_CLIENT_FORMATS_LZF_H_

#include <cstddef>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace strata {

// `size` bytes out of `packed`. INVALID_ARGUMENT if that does not come out, or if no input so short
// can give so much (nothing is allocated then).
absl::StatusOr<std::string> DecompressLzf(absl::string_view packed, std::size_t size);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_LZF_H_
