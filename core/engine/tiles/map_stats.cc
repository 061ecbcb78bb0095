#include "core/engine/tiles/map_stats.h"

#include <cmath>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include <Eigen/Geometry>

#include "core/common/checksum.h"
#include "core/common/status.h"
#include "core/engine/tiles/kept_tiles.h"
#include "core/storage/records.h"
#include "core/storage/storage.h"

namespace strata {
namespace {

absl::Status AddScans(StorageReader& reader, MapStats& stats) {
  STRATA_ASSIGN_OR_RETURN(const ScanTotals totals, reader.GetScanTotals());
  stats.scans = totals.scans;
  stats.scans_pending = totals.pending;
  stats.scans_failed = totals.failed;
  stats.points = totals.points;
  stats.point_bytes = totals.point_bytes;
  return absl::OkStatus();
}

absl::Status AddTiles(StorageReader& reader, const MapClock& clock, MapStats& stats) {
  STRATA_ASSIGN_OR_RETURN(const std::vector<MlsTileRow> tiles,
                          reader.ListMlsTiles(clock.tile_version));
  ContentHasher hasher;
  Eigen::AlignedBox3d box;
  double spread_weight = 0.0;
  double spread_sum = 0.0;
  for (const MlsTileRow& tile : tiles) {
    hasher.Add(tile.key.ToString());
    hasher.Add(tile.digest);
    stats.patches += tile.patches;
    stats.occupied_cells += tile.cells;
    spread_weight += tile.spread_weight;
    spread_sum += tile.spread_sum;
    box.extend(tile.box);
  }
  stats.content_digest = hasher.HexDigest();
  stats.tiles = tiles.size();
  if (spread_weight > 0.0) stats.surface_spread_m = std::sqrt(spread_sum / spread_weight);
  if (!box.isEmpty()) {
    stats.box_min = box.min();
    stats.box_max = box.max();
  }
  STRATA_ASSIGN_OR_RETURN(const std::vector<SurfaceTileRow> served,
                          reader.ListSurfaceTiles(TileRange{}, clock.tile_version));
  for (const SurfaceTileRow& tile : served) stats.tile_bytes += tile.size_bytes;
  STRATA_ASSIGN_OR_RETURN(const MapInfo info, reader.GetMapInfo());
  const auto kept = reader.ListPreparedTiles();
  if (!kept.ok()) return absl::OkStatus();  // they can be done without
  const TileVersionMap versions = VersionsOfTiles(served);
  for (const PreparedTileRow& row : *kept) {
    if (IsCurrent(row, versions, info.parameters.default_profile)) ++stats.tiles_prepared;
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<MapStats> CollectStats(StorageReader& reader, const MapClock& clock) {
  MapStats stats;
  stats.epoch = clock.epoch;
  stats.commit_sequence = clock.commit_sequence;
  STRATA_RETURN_IF_ERROR(AddScans(reader, stats));
  STRATA_RETURN_IF_ERROR(AddTiles(reader, clock, stats));
  return stats;
}

}  // namespace strata
