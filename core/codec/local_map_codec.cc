#include "core/codec/local_map_codec.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

#include "core/codec/mls_tile_codec.h"
#include "core/common/status.h"
#include "core/mls/mls_map.h"

namespace strata {
namespace {

constexpr std::size_t kLengthBytes = 4;

std::size_t ReadLength(absl::string_view bytes) {
  std::uint32_t length = 0;
  for (std::size_t i = 0; i < kLengthBytes; ++i) {
    length |= std::uint32_t{static_cast<std::uint8_t>(bytes[i])} << (8 * i);
  }
  return length;
}

}  // namespace

absl::StatusOr<std::string> EncodeLocalMap(const MlsMap& map, std::size_t max_patches) {
  if (const std::size_t patches = map.patch_count(); patches > max_patches) {
    return absl::InvalidArgumentError(absl::StrCat("local map of ",
                                                   patches,
                                                   " patches; at most ",
                                                   max_patches,
                                                   ", split the scan or take larger cells"));
  }
  std::string bytes;
  for (const MlsTile& tile : map.tiles) {
    STRATA_ASSIGN_OR_RETURN(const std::string encoded, EncodeMlsTile(tile));
    for (std::size_t i = 0; i < kLengthBytes; ++i) {
      bytes.push_back(static_cast<char>((encoded.size() >> (8 * i)) & 0xFF));
    }
    bytes += encoded;
  }
  return bytes;
}

absl::StatusOr<MlsMap> DecodeLocalMap(absl::string_view bytes, const MlsParameters& parameters) {
  MlsMap map;
  map.parameters = parameters;
  STRATA_RETURN_IF_ERROR(VisitLocalMap(bytes, {}, [&map](MlsTile tile) {
    map.tiles.push_back(std::move(tile));
    return absl::OkStatus();
  }));
  return map;
}

absl::Status VisitLocalMap(absl::string_view bytes,
                           const LocalMapBounds& bounds,
                           absl::FunctionRef<absl::Status(MlsTile)> visit) {
  std::optional<TileKey> previous;
  std::size_t patches = 0;
  while (!bytes.empty()) {
    if (bytes.size() < kLengthBytes || ReadLength(bytes) > bytes.size() - kLengthBytes) {
      return absl::DataLossError("local map: cut short");
    }
    const std::size_t length = ReadLength(bytes);
    STRATA_ASSIGN_OR_RETURN(
        MlsTile tile,
        DecodeMlsTileWithin(bounds.max_tile_bytes, bytes.substr(kLengthBytes, length)));
    if (previous.has_value() && !(*previous < tile.key)) {
      return absl::DataLossError("local map: tiles out of order");
    }
    previous = tile.key;
    patches += tile.patches.size();
    if (patches > bounds.max_patches) {
      return absl::ResourceExhaustedError(
          absl::StrCat("local map: more than ", bounds.max_patches, " patches"));
    }
    STRATA_RETURN_IF_ERROR(visit(std::move(tile)));
    bytes.remove_prefix(kLengthBytes + length);
  }
  return absl::OkStatus();
}

}  // namespace strata
