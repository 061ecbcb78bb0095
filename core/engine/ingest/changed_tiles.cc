#include "core/engine/ingest/changed_tiles.h"

#include <algorithm>
#include <cstddef>
#include <map>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/common/status.h"
#include "core/engine/tiles/surface_tiles.h"

namespace strata {

absl::StatusOr<ChangedTiles::KeySet> ChangedTiles::Touched(StorageReader& reader) const {
  KeySet keys;
  for (const auto& [number, scan] : scans_) {
    STRATA_ASSIGN_OR_RETURN(const std::vector<TileKey> now, reader.TilesOfScan(number));
    keys.insert(now.begin(), now.end());
    keys.insert(scan.tiles.begin(), scan.tiles.end());
  }
  return keys;
}

absl::StatusOr<std::vector<PlacedScanRecord>> ChangedTiles::ScansOfBlock(
    StorageReader& reader, const KeySet& keys, std::map<ScanNumber, LabelChange>& changes) const {
  STRATA_ASSIGN_OR_RETURN(std::vector<PlacedScanRecord> scans,
                          ScansOfTiles(reader, keys, epoch_, options_.damaged));
  std::erase_if(scans, [this](const PlacedScanRecord& placed) {
    return scans_.contains(placed.scan.number);
  });
  const auto touches = [&keys](const TileKey& key) { return keys.contains(key); };
  for (const auto& [number, scan] : scans_) {
    if (std::none_of(scan.tiles.begin(), scan.tiles.end(), touches)) continue;
    const LabelChange* change = nullptr;
    if (options_.change_of.has_value()) {
      change = &(changes[number] = (*options_.change_of)(scan.scan));
    }
    scans.push_back({scan.scan, scan.T_map_scan, change});
  }
  return scans;
}

absl::StatusOr<MlsTileMap> ChangedTiles::StageMlsTiles(StorageReader& reader, const KeySet& keys) {
  MlsTileMap gone;
  const std::vector<KeySet> blocks = TileBlocks(keys);
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const double share = static_cast<double>(i) / static_cast<double>(blocks.size());
    STRATA_RETURN_IF_ERROR(context_.Progress(
        options_.joining + (options_.annotating - options_.joining) * share, "joining tiles"));
    std::map<ScanNumber, LabelChange> changes;
    STRATA_ASSIGN_OR_RETURN(const std::vector<PlacedScanRecord> scans,
                            ScansOfBlock(reader, blocks[i], changes));
    STRATA_ASSIGN_OR_RETURN(
        const MlsTileMap tiles,
        MakeTiles(core_, scans, blocks[i], options_.threads, context_.stop(), options_.damaged));
    for (const auto& [key, tile] : tiles) {
      if (tile == nullptr) gone[key] = nullptr;
    }
    STRATA_RETURN_IF_ERROR(staged_.Put(tiles, {}));
  }
  return gone;
}

absl::Status ChangedTiles::StageSurfaces(StorageReader& reader,
                                         const KeySet& keys,
                                         const MlsTileMap& gone) {
  SurfaceTileMaker maker(core_,
                         reader,
                         store_,
                         gone,
                         {.version = options_.version,
                          .threads = options_.threads,
                          .profile = core_.info().parameters.default_profile});
  return MakeChangedSurfaces(
      maker,
      WithNeighbours(keys),
      context_.stop(),
      [&](double share) {
        return context_.Progress(options_.annotating + (1.0 - options_.annotating) * share,
                                 "annotating tiles");
      },
      [&](const SurfaceTileMaker::Rows& rows) { return staged_.Put({}, rows); });
}

absl::StatusOr<ChangedTiles::KeySet> ChangedTiles::Stage(StorageReader& reader) {
  STRATA_ASSIGN_OR_RETURN(const KeySet keys, Touched(reader));
  STRATA_ASSIGN_OR_RETURN(const MlsTileMap gone, StageMlsTiles(reader, keys));
  STRATA_RETURN_IF_ERROR(StageSurfaces(reader, keys, gone));
  return keys;
}

}  // namespace strata
