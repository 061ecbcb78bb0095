// What both kinds of tile begin with: their address.
#ifndef STRATA_CORE_CODEC_TILE_HEADER_H_
#define STRATA_CORE_CODEC_TILE_HEADER_H_

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

#include "core/codec/bytes.h"
#include "core/mls/tile_key.h"

namespace strata {

inline void PutTileHeader(std::string& out, const TileKey& key) {
  PutFixed(out, static_cast<std::uint8_t>(key.level));
  PutFixed(out, key.x);
  PutFixed(out, key.y);
}

inline absl::Status TakeTileHeader(ByteReader& reader, TileKey& key) {
  key.level = reader.Fixed<std::uint8_t>();
  key.x = reader.Fixed<std::int32_t>();
  key.y = reader.Fixed<std::int32_t>();
  if (reader.ok() && key.level <= kMaxLevel) return absl::OkStatus();
  return absl::DataLossError(absl::StrCat("tile: level ", key.level, " or header cut short"));
}

}  // namespace strata

#endif  // STRATA_CORE_CODEC_TILE_HEADER_H_
