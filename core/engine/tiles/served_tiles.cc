#include "core/engine/tiles/served_tiles.h"

#include <cstddef>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "absl/status/status.h"

#include "core/codec/blob.h"
#include "core/codec/surface_tile_codec.h"
#include "core/common/status.h"
#include "core/engine/tiles/tile_check.h"

namespace strata {
namespace {

// Version of the row that readers of `view` get, without reading its bytes; 0 where there is none.
absl::StatusOr<std::uint64_t> VersionOf(StorageReader& reader,
                                        const TileKey& key,
                                        const MapView& view) {
  const TileRange itself{key.level, key.x, std::int64_t{key.x} + 1, key.y, std::int64_t{key.y} + 1};
  STRATA_ASSIGN_OR_RETURN(const std::vector<SurfaceTileRow> rows,
                          reader.ListSurfaceTiles(itself, view.tile_version));
  return rows.empty() ? 0 : rows.front().version;
}

}  // namespace

absl::StatusOr<ServedTiles::Handle> ServedTiles::Find(const TileKey& key, const MapView& view) {
  const std::shared_ptr<const Known> known = known_.Find(key);
  if (known != nullptr && Serves(*known, view)) return known->tile;
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core_.Reader());
  if (known != nullptr && known->until < view.tile_version) {
    STRATA_ASSIGN_OR_RETURN(const std::uint64_t version, VersionOf(*reader, key, view));
    if (version == known->tile->version) {
      Keep(key, {known->tile, view.tile_version});
      return known->tile;
    }
  }
  STRATA_ASSIGN_OR_RETURN(Handle tile, Read(*reader, key, view));
  if (tile != nullptr) Keep(key, {tile, view.tile_version});
  return tile;
}

absl::StatusOr<ServedTiles::Handle> ServedTiles::Read(StorageReader& reader,
                                                      const TileKey& key,
                                                      const MapView& view) {
  STRATA_ASSIGN_OR_RETURN(std::optional<SurfaceTileRow> row,
                          reader.FindSurfaceTile(key, view.tile_version));
  if (!row.has_value()) return Handle();
  const absl::Status intact =
      OpenBlob(BlobKind::kSurfaceTile, kSurfaceTileVersion, row->bytes).status();
  if (!intact.ok()) return DamagedTile(key, intact);
  return std::make_shared<const Tile>(Tile{row->version, std::move(row->bytes)});
}

ServedTiles::Handle ServedTiles::FindAtHand(const TileKey& key, const MapView& view) {
  const std::shared_ptr<const Known> known = known_.Find(key);
  return known != nullptr && Serves(*known, view) ? known->tile : nullptr;
}

void ServedTiles::Keep(const TileKey& key, Known known) {
  const std::size_t bytes = sizeof(Known) + sizeof(Tile) + known.tile->bytes.capacity();
  // The older one of two at once may stay: it serves older views, and is looked up again.
  const auto there = known_.Find(key);
  if (there != nullptr && there->until > known.until) return;
  known_.Put(key, std::make_shared<const Known>(std::move(known)), bytes);
}

}  // namespace strata
