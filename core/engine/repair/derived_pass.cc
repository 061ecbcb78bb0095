#include "core/engine/repair/derived_pass.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "absl/container/btree_set.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

#include "core/common/status.h"
#include "core/engine/map/parallel.h"
#include "core/engine/map/scan_lookup.h"
#include "core/engine/scans/scan_share.h"
#include "core/engine/scans/scan_source.h"

namespace strata {
namespace {

double Share(std::size_t i, std::size_t count) {
  return count == 0 ? 1.0 : static_cast<double>(i) / static_cast<double>(count);
}

}  // namespace

absl::Status DerivedPass::Run(DerivedSink& sink) {
  std::optional<ReaderPool::Lease> lease;
  STRATA_ASSIGN_OR_RETURN(StorageReader * reader, ReaderOf(core_, options_.view, 0, lease));
  STRATA_RETURN_IF_ERROR(ListScans(*reader));
  STRATA_RETURN_IF_ERROR(IndexScans(*reader, sink));
  STRATA_RETURN_IF_ERROR(CheckMlsTiles(*reader, sink));
  return CheckSurfaces(*reader, sink);
}

absl::Status DerivedPass::ListScans(StorageReader& reader) {
  return ForEachScan(reader, ScanQuery(), options_.epoch, [&](PosedScan posed) {
    const Pose T_map_scan =
        posed.pose.has_value() ? posed.pose->T_map_scan : posed.scan.header.T_map_scan;
    indexes_[posed.scan.number].footprint = FootprintOf(posed.scan.box_scan, T_map_scan);
    if (posed.scan.state == ScanState::kIntegrated) {
      placed_.push_back({std::move(posed.scan), T_map_scan});
    }
  });
}

absl::Status DerivedPass::IndexScans(StorageReader& reader, DerivedSink& sink) {
  const MapParameters parameters = core_.info().parameters;
  std::vector<std::vector<TileKey>> tiles(placed_.size());
  const absl::Status made =
      ParallelFor(options_.threads, placed_.size(), [&](int thread, std::size_t i) -> absl::Status {
        if (thread == 0) {
          STRATA_RETURN_IF_ERROR(
              context_.Progress(0.4 * Share(i, placed_.size()), "finding the tiles of scans"));
        }
        std::optional<ReaderPool::Lease> lease;
        STRATA_ASSIGN_OR_RETURN(StorageReader * own, ReaderOf(core_, options_.view, thread, lease));
        const ScanShare share(core_.caches(), placed_[i].scan);
        ScanSource source(*own, parameters);
        const absl::StatusOr<MlsMap> contribution =
            source.Contribution(placed_[i].scan, placed_[i].T_map_scan);
        if (!contribution.ok()) {
          return Annotate(contribution.status(),
                          absl::StrCat("scan ", placed_[i].scan.header.id.ToString()));
        }
        tiles[i] = TilesOf(*contribution);
        return absl::OkStatus();
      });
  STRATA_RETURN_IF_ERROR(made);
  for (std::size_t i = 0; i < placed_.size(); ++i) {
    for (const TileKey& key : tiles[i]) scans_of_tile_[key].push_back(i);
    indexes_[placed_[i].scan.number].tiles = std::move(tiles[i]);
  }
  DerivedDifferences differences;
  for (const auto& [number, index] : indexes_) {
    ScanIndex stored;
    STRATA_ASSIGN_OR_RETURN(stored.tiles, reader.TilesOfScan(number));
    STRATA_ASSIGN_OR_RETURN(const std::optional<Eigen::AlignedBox2d> footprint,
                            reader.FootprintOfScan(number));
    if (footprint.has_value()) stored.footprint = *footprint;
    if (!(stored == index)) differences.scans.push_back(number);
  }
  return sink.Differs(differences);
}

absl::Status DerivedPass::CheckMlsTiles(StorageReader& reader, DerivedSink& sink) {
  KeySet keys;
  for (const auto& [key, scans] : scans_of_tile_) keys.insert(key);
  tiles_ = keys.size();
  STRATA_ASSIGN_OR_RETURN(const std::vector<MlsTileRow> stored,
                          reader.ListMlsTiles(options_.version));
  for (const MlsTileRow& row : stored) {
    if (!keys.contains(row.key)) stored_.insert(row.key);
  }
  keys.insert(stored_.begin(), stored_.end());
  const std::vector<KeySet> blocks = TileBlocks(keys);
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    STRATA_RETURN_IF_ERROR(context_.Progress(0.4 + 0.4 * Share(i, blocks.size()), "joining tiles"));
    STRATA_RETURN_IF_ERROR(CheckBlock(reader, blocks[i], sink));
  }
  return absl::OkStatus();
}

absl::Status DerivedPass::CheckBlock(StorageReader& reader, const KeySet& keys, DerivedSink& sink) {
  absl::btree_set<std::size_t> indices;
  for (const TileKey& key : keys) {
    const auto it = scans_of_tile_.find(key);
    if (it != scans_of_tile_.end()) indices.insert(it->second.begin(), it->second.end());
  }
  std::vector<PlacedScanRecord> scans;
  scans.reserve(indices.size());
  for (const std::size_t i : indices) scans.push_back(placed_[i]);
  STRATA_ASSIGN_OR_RETURN(
      const MlsTileMap made,
      MakeTiles(core_, scans, keys, options_.threads, context_.stop(), nullptr, options_.view));
  const double cell_size_m = core_.info().parameters.mls.cell_size_m;
  DerivedDifferences differences;
  for (const auto& [key, tile] : made) {
    STRATA_ASSIGN_OR_RETURN(const std::optional<MlsTileRow> stored,
                            reader.FindMlsTile(key, options_.version));
    if (tile == nullptr && !stored.has_value()) continue;
    if (tile != nullptr && stored.has_value()) {
      STRATA_ASSIGN_OR_RETURN(const MlsTileRow row,
                              MakeMlsTileRow(*tile, stored->version, cell_size_m));
      if (row.bytes == stored->bytes && row.digest == stored->digest &&
          row.patches == stored->patches && row.cells == stored->cells &&
          row.spread_weight == stored->spread_weight && row.spread_sum == stored->spread_sum &&
          row.box.min() == stored->box.min() && row.box.max() == stored->box.max()) {
        continue;
      }
    }
    differences.tiles[key] = tile;
  }
  return sink.Differs(differences);
}

absl::Status DerivedPass::CheckSurfaces(StorageReader& reader, DerivedSink& sink) {
  // A tile that no scan explains any more is still in the store until everything is published.
  MlsTileMap gone;
  for (const TileKey& key : stored_) gone[key] = nullptr;
  SurfaceTileMaker maker(
      core_,
      reader,
      store_,
      gone,
      {.version = options_.version, .threads = options_.threads, .profile = options_.profile});
  KeySet keys;
  for (const auto& [key, scans] : scans_of_tile_) keys.insert(key);
  return MakeAllSurfaces(
      maker,
      reader,
      keys,
      context_.stop(),
      [&](double share) { return context_.Progress(0.8 + 0.2 * share, "annotating tiles"); },
      [&](SurfaceTileMaker::Rows rows) {
        DerivedDifferences differences;
        differences.surfaces = std::move(rows);
        return sink.Differs(differences);
      });
}

}  // namespace strata
