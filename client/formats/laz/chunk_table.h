// Where the chunks of a LAZ file are, and how many points each has.
#ifndef STRATA_CLIENT_FORMATS_LAZ_CHUNK_TABLE_H_
#define STRATA_CLIENT_FORMATS_LAZ_CHUNK_TABLE_H_

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"

#include "client/formats/laz/laz_format.h"
#include "client/formats/parsing/byte_source.h"

namespace strata {

struct LazChunk {
  std::uint64_t at = 0;
  std::uint64_t bytes = 0;
  std::uint64_t points = 0;
};

// Of a file whose `points` points begin at `points_at`; the chunks that have any, in the order of
// the file, within it, and none with more than 200 points a byte, which bounds how long reading
// takes and what it makes. A file that is not chunked is one chunk. UNAVAILABLE; INVALID_ARGUMENT
// naming what does not fit, and where the table is missing.
absl::StatusOr<std::vector<LazChunk>> ReadChunkTable(ByteSource& source,
                                                     std::uint64_t points_at,
                                                     std::uint64_t points,
                                                     const LazFormat& format);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_LAZ_CHUNK_TABLE_H_
