// Prepared tiles as a map's file keeps them: what they are made of, and how damage to them is seen.
#ifndef STRATA_CORE_ENGINE_TILES_KEPT_TILES_H_
#define STRATA_CORE_ENGINE_TILES_KEPT_TILES_H_

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/common/hash_map.h"
#include "core/mls/tile_key.h"
#include "core/planning/tile_source.h"
#include "core/storage/records.h"
#include "core/world/robot_profile.h"

namespace strata {

// Versions of all level-0 tiles of one state.
using TileVersionMap = HashMap<TileKey, std::uint64_t>;
TileVersionMap VersionsOfTiles(const std::vector<SurfaceTileRow>& rows);
TileVersions VersionsAround(const TileVersionMap& versions, const TileKey& key);

// PreparedTileRow::made_of: kPreparationForm, the nine versions and the profile.
std::string MadeOf(const TileVersions& versions, const RobotProfile& profile);
// The row of a tile that was packed: with a checksum over all of it.
PreparedTileRow SealTile(const TileKey& key, std::string made_of, std::string packed);
// What was packed; DATA_LOSS unless `bytes` are those of such a row.
absl::StatusOr<std::string> UnsealTile(const TileKey& key,
                                       absl::string_view made_of,
                                       std::string bytes);

// Whether preparing its tile again would give the same row.
bool IsCurrent(const PreparedTileRow& row,
               const TileVersionMap& versions,
               const RobotProfile& profile);
// In order: those of `versions` without a row that is current, and those of `rows` that are not
// there any more.
std::vector<TileKey> StaleTiles(const TileVersionMap& versions,
                                const std::vector<PreparedTileRow>& rows,
                                const RobotProfile& profile);

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_TILES_KEPT_TILES_H_
