#include "core/engine/ingest/changed_tiles.h"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/codec/mls_tile_codec.h"
#include "core/common/status.h"
#include "core/engine/tiles/surface_tiles.h"
#include "core/mls/join.h"

namespace strata {

absl::StatusOr<std::vector<PlacedScanRecord>> ChangedTiles::ScansOfBlock(
    StorageReader& reader, const KeySet& keys, std::map<ScanNumber, LabelChange>& changes) const {
  STRATA_ASSIGN_OR_RETURN(std::vector<PlacedScanRecord> scans,
                          ScansToBe(reader, keys, scans_, epoch_, options_.damaged));
  if (!options_.change_of.has_value()) return scans;
  for (PlacedScanRecord& placed : scans) {
    if (!scans_.contains(placed.scan.number)) continue;
    placed.change = &(changes[placed.scan.number] = (*options_.change_of)(placed.scan));
  }
  return scans;
}

absl::Status ChangedTiles::StageBlock(const std::vector<PlacedScanRecord>& scans,
                                      const KeySet& keys,
                                      MlsTileMap& gone) {
  if (keys.empty()) return absl::OkStatus();
  STRATA_ASSIGN_OR_RETURN(
      const MlsTileMap tiles,
      MakeTiles(core_, scans, keys, options_.threads, context_.stop(), options_.damaged));
  for (const auto& [key, tile] : tiles) {
    if (tile == nullptr) gone[key] = nullptr;
  }
  return staged_.Put(tiles, {});
}

absl::Status ChangedTiles::StageAhead(const TilesAhead::Block& ahead,
                                      const std::vector<PlacedScanRecord>& scans,
                                      const KeySet& keys,
                                      MlsTileMap& gone) {
  std::vector<PlacedScanRecord> others;
  std::copy_if(scans.begin(), scans.end(), std::back_inserter(others), [&](const auto& placed) {
    return !ahead.scans.contains(placed.scan.number);
  });
  KeySet unknown, known;
  for (const TileKey& key : keys) (ahead.rows.contains(key) ? known : unknown).insert(key);
  STRATA_ASSIGN_OR_RETURN(
      MlsTileMap tiles,
      MakeTiles(core_, others, known, options_.threads, context_.stop(), options_.damaged));
  std::vector<MlsTileRow> rows;
  MlsTileMap joined;
  for (auto& [key, tile] : tiles) {
    const std::optional<MlsTileRow>& row = ahead.rows.at(key);
    if (!row.has_value()) {
      (tile == nullptr ? gone : joined)[key] = tile;
    } else if (tile == nullptr) {
      rows.push_back(*row);
    } else {
      STRATA_ASSIGN_OR_RETURN(const MlsTile made, DecodeMlsTile(row->bytes));
      joined[key] =
          std::make_shared<const MlsTile>(JoinTiles(made, *tile, core_.info().parameters.mls));
    }
  }
  STRATA_RETURN_IF_ERROR(staged_.PutRows(std::move(rows)));
  STRATA_RETURN_IF_ERROR(staged_.Put(joined, {}));
  return StageBlock(scans, unknown, gone);
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
    const TilesAhead::Block* const ahead =
        options_.ahead == nullptr ? nullptr : options_.ahead->Find(blocks[i], scans);
    STRATA_RETURN_IF_ERROR(ahead == nullptr ? StageBlock(scans, blocks[i], gone)
                                            : StageAhead(*ahead, scans, blocks[i], gone));
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
  STRATA_ASSIGN_OR_RETURN(const KeySet keys, TilesToChange(reader, scans_));
  STRATA_ASSIGN_OR_RETURN(const MlsTileMap gone, StageMlsTiles(reader, keys));
  STRATA_RETURN_IF_ERROR(StageSurfaces(reader, keys, gone));
  return keys;
}

}  // namespace strata
