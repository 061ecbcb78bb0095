// Scans of which points fade, or come back.
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "absl/container/btree_set.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

#include "core/common/status.h"
#include "core/engine/integrator.h"
#include "core/engine/scan_source.h"

namespace strata {
namespace {

// A scan as it will be.
struct ChangedScan {
  PlacedScanRecord placed;
  std::vector<TileKey> tiles;
};
using ChangedScans = std::map<ScanNumber, ChangedScan>;

absl::StatusOr<ChangedScans> Prepare(StorageReader& reader,
                                     const MapParameters& parameters,
                                     std::uint64_t epoch,
                                     const std::map<ScanNumber, LabelChange>& changes) {
  ChangedScans changed;
  for (const auto& [number, change] : changes) {
    absl::StatusOr<PosedScan> posed = reader.GetScan(number, epoch);
    if (absl::IsNotFound(posed.status())) continue;
    STRATA_RETURN_IF_ERROR(posed.status());
    if (posed->scan.state != ScanState::kIntegrated || !posed->pose.has_value()) continue;
    ChangedScan& scan = changed[number];
    scan.placed = {std::move(posed->scan), posed->pose->T_map_scan, &change};
    ScanSource source(reader, parameters, {.change = &change});
    const absl::StatusOr<MlsMap> contribution =
        source.Contribution(scan.placed.scan, scan.placed.T_map_scan);
    if (!contribution.ok()) {
      return Annotate(contribution.status(),
                      absl::StrCat("scan ", scan.placed.scan.header.id.ToString()));
    }
    for (const MlsTile& tile : contribution->tiles) {
      if (!tile.patches.empty()) scan.tiles.push_back(tile.key);
    }
  }
  return changed;
}

// All scans of the tiles, as they will be.
absl::StatusOr<std::vector<PlacedScanRecord>> ScansAfter(StorageReader& reader,
                                                         const absl::btree_set<TileKey>& keys,
                                                         std::uint64_t epoch,
                                                         const ChangedScans& changed) {
  STRATA_ASSIGN_OR_RETURN(std::vector<PlacedScanRecord> scans, ScansOfTiles(reader, keys, epoch));
  std::erase_if(
      scans, [&](const PlacedScanRecord& placed) { return changed.contains(placed.scan.number); });
  for (const auto& [number, scan] : changed) scans.push_back(scan.placed);
  return scans;
}

}  // namespace

absl::Status Integrator::SetFaded(const std::map<ScanNumber, LabelChange>& changes) {
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core_.Reader());
  STRATA_ASSIGN_OR_RETURN(const ChangedScans changed,
                          Prepare(*reader, core_.info().parameters, epoch(), changes));
  if (changed.empty()) return absl::OkStatus();
  absl::btree_set<TileKey> keys;
  std::vector<ScanId> ids;
  for (const auto& [number, scan] : changed) {
    STRATA_ASSIGN_OR_RETURN(const std::vector<TileKey> before, reader->TilesOfScan(number));
    keys.insert(before.begin(), before.end());
    keys.insert(scan.tiles.begin(), scan.tiles.end());
    ids.push_back(scan.placed.scan.header.id);
  }
  STRATA_ASSIGN_OR_RETURN(const std::vector<PlacedScanRecord> scans,
                          ScansAfter(*reader, keys, epoch(), changed));
  TileChange change;
  STRATA_ASSIGN_OR_RETURN(change.tiles,
                          MakeTiles(core_, scans, keys, core_.options().worker_threads, Stop()));
  STRATA_ASSIGN_OR_RETURN(change.version, NextVersion());
  STRATA_RETURN_IF_ERROR(MakeServed(*reader, change));
  aligner_loaded_ = false;
  return Commit(change, ids, [&](StorageWriter& writer) -> absl::Status {
    for (const auto& [number, scan] : changed) {
      const LabelChange& faded = *scan.placed.change;
      STRATA_RETURN_IF_ERROR(
          writer.PutLabels(number, LabelOrigin::kFaded, faded.model, EncodeLabelChange(faded)));
      STRATA_RETURN_IF_ERROR(writer.SetTilesOfScan(number, scan.tiles));
    }
    return absl::OkStatus();
  });
}

}  // namespace strata
