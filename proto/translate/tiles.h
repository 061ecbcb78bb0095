// Tiles between the core's words and the wire's. The reader of an EncodedTile checks its bytes.
#ifndef STRATA_PROTO_TRANSLATE_TILES_H_
#define STRATA_PROTO_TRANSLATE_TILES_H_

#include "absl/status/statusor.h"

#include "core/api/tiles.h"
#include "core/mls/tile_key.h"
#include "strata/v1/tiles.pb.h"

namespace strata::translate {

v1::TileKey ToProto(const TileKey& key);
v1::EncodedTile ToProto(api::EncodedTile tile);
v1::TileInfo ToProto(const api::TileInfo& tile);
v1::TileArea ToProto(const api::TileArea& area);
v1::HeldTile ToProto(const api::HeldTile& held);
v1::FetchTilesResponse ToProto(const api::TileUpdate& update);

// INVALID_ARGUMENT for a level outside 0 to kMaxLevel.
absl::StatusOr<TileKey> FromProto(const v1::TileKey& key);
absl::StatusOr<api::EncodedTile> FromProto(const v1::EncodedTile& tile);
absl::StatusOr<api::TileInfo> FromProto(const v1::TileInfo& tile);
// INVALID_ARGUMENT also for bounds beyond ±2^31 or the wrong way round.
absl::StatusOr<api::TileArea> FromProto(const v1::TileArea& area);
absl::StatusOr<api::HeldTile> FromProto(const v1::HeldTile& held);
absl::StatusOr<api::TileUpdate> FromProto(const v1::FetchTilesResponse& update);

}  // namespace strata::translate

#endif  // STRATA_PROTO_TRANSLATE_TILES_H_
