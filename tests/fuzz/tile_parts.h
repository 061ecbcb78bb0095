// The bytes of a tile taken apart into its columns, so that a fuzzer may change what is inside of
// zstd frames and behind checksums.
#ifndef STRATA_TESTS_FUZZ_TILE_PARTS_H_
#define STRATA_TESTS_FUZZ_TILE_PARTS_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/strings/string_view.h"
#include <fuzzer/FuzzedDataProvider.h>

#include "core/codec/blob.h"

namespace strata::fuzz {

// core/codec/FORMAT.md, "Tile" and what follows it.
struct TileParts {
  std::string address;             // and, of a surface tile, the version
  std::vector<std::string> cells;  // the two columns of the occupancy
  std::string flags;               // of an MLS tile: colour, number of votes
  std::vector<std::string> columns;
  std::string raw;
};

// `bytes` as an encoder wrote them; ends the process if they are not.
TileParts TakeApart(BlobKind kind, absl::string_view bytes);
std::string PutTogether(BlobKind kind, std::uint16_t version, const TileParts& parts);
// Changes bytes, lengths and order of some parts.
void Damage(FuzzedDataProvider& input, TileParts& parts);

}  // namespace strata::fuzz

#endif  // STRATA_TESTS_FUZZ_TILE_PARTS_H_
