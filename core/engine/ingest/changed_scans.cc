#include "core/engine/ingest/changed_scans.h"

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

#include "core/common/status.h"
#include "core/engine/scans/scan_losses.h"
#include "core/engine/scans/scan_share.h"
#include "core/engine/scans/scan_source.h"

namespace strata {

absl::StatusOr<ChangedScan> MovedScan(MapCore& core,
                                      const ProposedPose& move,
                                      std::uint64_t epoch,
                                      DamagedScans* damaged) {
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core.Reader());
  STRATA_ASSIGN_OR_RETURN(PosedScan posed, reader->GetScan(move.scan, epoch));
  const ScanHeader& header = posed.scan.header;
  const MapParameters parameters = core.info().parameters;
  const ScanShare share(core.caches(), posed.scan);
  ScanSource source(*reader, parameters);
  ChangedScan moved;
  moved.T_map_scan = move.T_map_scan;
  const absl::StatusOr<MlsMap> contribution = source.Contribution(posed.scan, move.T_map_scan);
  if (damaged != nullptr &&
      damaged->LeaveOut(move.scan, header.id.ToString(), contribution.status())) {
    moved.scan = std::move(posed.scan);
    return moved;
  }
  if (!contribution.ok()) {
    return Annotate(contribution.status(), absl::StrCat("scan ", header.id.ToString()));
  }
  STRATA_RETURN_IF_ERROR(CheckContributes(
      *contribution, source.dropped(), posed.scan, header.sensor.value_or(parameters.sensor)));
  moved.tiles = TilesOf(*contribution);
  moved.scan = std::move(posed.scan);
  return moved;
}

absl::StatusOr<std::vector<PlacedScanRecord>> ScansToBe(StorageReader& reader,
                                                        const absl::btree_set<TileKey>& keys,
                                                        const ChangedScans& changed,
                                                        std::uint64_t epoch,
                                                        DamagedScans* damaged) {
  STRATA_ASSIGN_OR_RETURN(std::vector<PlacedScanRecord> scans,
                          ScansOfTiles(reader, keys, epoch, damaged));
  std::erase_if(scans, [&changed](const PlacedScanRecord& placed) {
    return changed.contains(placed.scan.number);
  });
  const auto touches = [&keys](const TileKey& key) { return keys.contains(key); };
  for (const auto& [number, scan] : changed) {
    if (std::none_of(scan.tiles.begin(), scan.tiles.end(), touches)) continue;
    scans.push_back({scan.scan, scan.T_map_scan});
  }
  return scans;
}

absl::StatusOr<absl::btree_set<TileKey>> TilesToChange(StorageReader& reader,
                                                       const ChangedScans& changed) {
  absl::btree_set<TileKey> keys;
  for (const auto& [number, scan] : changed) {
    STRATA_ASSIGN_OR_RETURN(const std::vector<TileKey> now, reader.TilesOfScan(number));
    keys.insert(now.begin(), now.end());
    keys.insert(scan.tiles.begin(), scan.tiles.end());
  }
  return keys;
}

}  // namespace strata
