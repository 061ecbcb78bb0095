#include "core/engine/tiles/tile_rows.h"

#include <cstdint>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/common/status.h"

namespace strata {

void TileRowKeys::Add(const MlsTileMap& changed, const std::vector<SurfaceTileRow>& rows) {
  for (const auto& [key, tile] : changed) (tile == nullptr ? gone : tiles).insert(key);
  for (const SurfaceTileRow& row : rows) surfaces.insert(row.key);
}

absl::StatusOr<std::vector<MlsTileRow>> EncodeTileRows(const MlsTileMap& changed,
                                                       std::uint64_t version,
                                                       double cell_size_m) {
  std::vector<MlsTileRow> rows;
  for (const auto& [key, tile] : changed) {
    if (tile == nullptr) continue;
    STRATA_ASSIGN_OR_RETURN(MlsTileRow row, MakeMlsTileRow(*tile, version, cell_size_m));
    rows.push_back(std::move(row));
  }
  return rows;
}

absl::Status PutTileRows(StorageWriter& writer,
                         const std::vector<MlsTileRow>& tiles,
                         const std::vector<SurfaceTileRow>& surfaces) {
  for (const MlsTileRow& row : tiles) STRATA_RETURN_IF_ERROR(writer.PutMlsTile(row));
  for (const SurfaceTileRow& row : surfaces) STRATA_RETURN_IF_ERROR(writer.PutSurfaceTile(row));
  return absl::OkStatus();
}

absl::Status RetireTileRows(StorageWriter& writer,
                            const TileRowKeys& keys,
                            std::uint64_t version,
                            std::uint64_t floor) {
  for (const TileKey& key : keys.gone) STRATA_RETURN_IF_ERROR(writer.DeleteMlsTile(key));
  for (const TileKey& key : keys.tiles) {
    STRATA_RETURN_IF_ERROR(writer.DeleteOlderMlsTiles(key, version));
  }
  for (const TileKey& key : keys.surfaces) {
    STRATA_RETURN_IF_ERROR(writer.CollectSurfaceTile(key, floor));
  }
  return absl::OkStatus();
}

}  // namespace strata
