// What a request would become, seen before it is parsed.
#ifndef STRATA_SERVER_RPC_WIRE_CHECK_H_
#define STRATA_SERVER_RPC_WIRE_CHECK_H_

#include <cstddef>

#include "absl/status/statusor.h"
#include <google/protobuf/descriptor.h>
#include <google/protobuf/io/zero_copy_stream.h>

namespace strata::server {

// Fields that the contract does not know, of a newer client; in one request.
inline constexpr std::size_t kMaxUnknownFields = 1000;

// Reads `bytes` over without keeping anything of them, and says how many bytes of memory a message
// of `type` takes that is parsed from them; it may take less. INVALID_ARGUMENT for bytes that are
// no message (not all such bytes are found), for a field with more items than its `max_items`
// (bounds.proto), which is named, and for more than kMaxUnknownFields. Thread-safe.
absl::StatusOr<std::size_t> ParsedBytes(const google::protobuf::Descriptor& type,
                                        google::protobuf::io::ZeroCopyInputStream& bytes);

}  // namespace strata::server

#endif  // STRATA_SERVER_RPC_WIRE_CHECK_H_
