#include "core/engine/tiles/tile_check.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

#include "core/codec/mls_tile_codec.h"
#include "core/codec/surface_tile_codec.h"
#include "core/common/status.h"
#include "core/engine/map/reader_pool.h"
#include "core/engine/tiles/kept_tiles.h"
#include "core/mls/tile_key.h"
#include "core/storage/storage.h"

namespace strata {
namespace {

// Why the row cannot be read; OK where there is none.
template <typename Row, typename Decode>
absl::Status Readable(const Row& row, const TileKey& key, Decode decode) {
  STRATA_RETURN_IF_ERROR(row.status());
  if (!row->has_value()) return absl::OkStatus();
  STRATA_ASSIGN_OR_RETURN(const auto tile, decode((*row)->bytes));
  if (tile.key == key) return absl::OkStatus();
  return absl::DataLossError(absl::StrCat("holds tile ", tile.key.ToString()));
}

}  // namespace

absl::Status DamagedTile(const TileKey& key, const absl::Status& why) {
  return absl::DataLossError(absl::StrCat(
      "tile ", key.ToString(), " is damaged, a rebuild of the map mends it: ", why.message()));
}

absl::StatusOr<std::shared_ptr<const SurfaceTile>> ReadSurfaceTile(MapCore& core,
                                                                   const TileKey& key,
                                                                   std::uint64_t version) {
  std::optional<SurfaceTileRow> row;
  {
    STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core.Reader());
    STRATA_ASSIGN_OR_RETURN(row, reader->FindSurfaceTile(key, version));
  }
  return DecodeStoredTile(key, row);
}

absl::StatusOr<std::shared_ptr<const SurfaceTile>> DecodeStoredTile(
    const TileKey& key, const std::optional<SurfaceTileRow>& row) {
  if (!row.has_value()) return std::shared_ptr<const SurfaceTile>();
  absl::StatusOr<SurfaceTile> decoded = DecodeSurfaceTile(row->bytes);
  if (!decoded.ok()) return DamagedTile(key, decoded.status());
  if (decoded->key != key) return DamagedTile(key, absl::DataLossError("it is another tile"));
  return std::make_shared<const SurfaceTile>(*std::move(decoded));
}

absl::StatusOr<std::uint64_t> CheckTilesAlone(const SteadyView& view,
                                              JobContext& context,
                                              absl::FunctionRef<void(const std::string&)> report) {
  StorageReader& reader = *view.readers.front();
  const std::uint64_t version = view.clock.tile_version;
  std::uint64_t tiles = 0;
  const auto look = [&](const TileKey& key, const char* kind, const absl::Status& readable) {
    ++tiles;
    if (readable.ok()) return;
    report(absl::StrCat("tile ", key.ToString(), " (", kind, "): ", readable.message()));
  };
  STRATA_ASSIGN_OR_RETURN(const std::vector<MlsTileRow> rows, reader.ListMlsTiles(version));
  for (const MlsTileRow& row : rows) {
    STRATA_RETURN_IF_ERROR(context.Progress(0.4, "reading tiles"));
    look(row.key,
         "statistics",
         Readable(reader.FindMlsTile(row.key, version), row.key, DecodeMlsTile));
  }
  for (TileRange range; range.level <= kMaxLevel; ++range.level) {
    STRATA_ASSIGN_OR_RETURN(const std::vector<SurfaceTileRow> served,
                            reader.ListSurfaceTiles(range, version));
    for (const SurfaceTileRow& row : served) {
      STRATA_RETURN_IF_ERROR(context.Progress(0.7, "reading tiles"));
      look(row.key,
           "served",
           Readable(reader.FindSurfaceTile(row.key, version), row.key, DecodeSurfaceTile));
    }
  }
  return tiles;
}

absl::Status CheckKeptTiles(MapCore& core, const SteadyView& view, JobContext& context) {
  StorageReader& reader = *view.readers.front();
  STRATA_ASSIGN_OR_RETURN(const std::vector<PreparedTileRow> rows, reader.ListPreparedTiles());
  std::uint64_t damaged = 0;
  for (const PreparedTileRow& row : rows) {
    STRATA_RETURN_IF_ERROR(context.Progress(1.0, "reading prepared tiles"));
    STRATA_ASSIGN_OR_RETURN(std::optional<std::string> bytes,
                            reader.FindPreparedTile(row.key, row.made_of));
    if (bytes.has_value() && UnsealTile(row.key, row.made_of, *std::move(bytes)).ok()) continue;
    core.NoteUnreadable(row.key);
    ++damaged;
  }
  context.SetMetric("prepared_tiles", static_cast<double>(rows.size()));
  context.SetMetric("prepared_tiles_damaged", static_cast<double>(damaged));
  return absl::OkStatus();
}

}  // namespace strata
