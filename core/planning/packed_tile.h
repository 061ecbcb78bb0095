// Prepared tiles as bytes, to be kept on disk.
#ifndef STRATA_CORE_PLANNING_PACKED_TILE_H_
#define STRATA_CORE_PLANNING_PACKED_TILE_H_

#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/mls/tile_key.h"
#include "core/planning/least_dangers.h"
#include "core/planning/prepared_tile.h"

namespace strata {

// Some 3 bytes a surface: a format number, the size of cells, zstd of the tile's LeastDangers, zstd
// of its columns, and XXH3-64 of all before.
std::string PackTile(const PreparedTile& tile, double cell_size_m);
// The same for whoever has the LeastDangers, right or wrong.
std::string PackTile(const PreparedTile& tile, const LeastDangers& least, double cell_size_m);

// The tile that was packed, bit for bit. DATA_LOSS for all that is no intact tile of this format
// and size of cells: whatever the bytes are, what is made of them can be searched.
absl::StatusOr<PreparedTile> UnpackTile(absl::string_view packed, double cell_size_m);

struct PackedLeastDangers {
  TileKey key;
  LeastDangers least{};
};
// What UnpackTile() checks against the patches, by itself; DATA_LOSS as there.
absl::StatusOr<PackedLeastDangers> UnpackLeastDangers(absl::string_view packed, double cell_size_m);

}  // namespace strata

#endif  // STRATA_CORE_PLANNING_PACKED_TILE_H_
