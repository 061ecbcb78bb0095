// What the chunks of bags are packed with.
#ifndef STRATA_CLIENT_FORMATS_BAGS_UNPACK_H_
#define STRATA_CLIENT_FORMATS_BAGS_UNPACK_H_

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace strata {

// Makes `unpacked` of `packed` by "lz4" (frames, as MCAP and ROS 1 have them), "zstd" or "bz2".
// `size` is what the file says will come of it; memory grows with what comes. Where it fails
// `unpacked` holds what came before. DATA_LOSS for bytes that are not so packed or make another
// size, INVALID_ARGUMENT for another method or a size beyond kMaxBagPieceBytes.
absl::Status Unpack(absl::string_view method,
                    absl::string_view packed,
                    std::uint64_t size,
                    std::string& unpacked);

// A message in CDR, which begins with a zero, or what rosbag2 has packed it as (zstd, with
// --compression-mode message): the message, in `unpacked` in the second case. As Unpack.
absl::StatusOr<absl::string_view> UnpackedMessage(absl::string_view bytes, std::string& unpacked);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_BAGS_UNPACK_H_
