// Scans that leave or move: their tiles are made again from the scans that stay.
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "absl/container/btree_set.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

#include "core/common/status.h"
#include "core/engine/integrator.h"
#include "core/engine/scan_losses.h"
#include "core/engine/scan_source.h"

namespace strata {
namespace {

absl::StatusOr<PosedScan> FindScan(StorageReader& reader, const ScanId& id, std::uint64_t epoch) {
  STRATA_ASSIGN_OR_RETURN(std::optional<PosedScan> scan, reader.FindScan(id, epoch));
  if (scan.has_value()) return *std::move(scan);
  return absl::NotFoundError(absl::StrCat("scan ", id.ToString(), " does not exist"));
}

}  // namespace

absl::StatusOr<MlsTileMap> Integrator::TilesWithout(StorageReader& reader,
                                                    const absl::btree_set<TileKey>& keys,
                                                    ScanNumber without) {
  STRATA_ASSIGN_OR_RETURN(std::vector<PlacedScanRecord> scans, ScansOfTiles(reader, keys, epoch()));
  std::erase_if(
      scans, [without](const PlacedScanRecord& placed) { return placed.scan.number == without; });
  return MakeTiles(core_, scans, keys, core_.options().worker_threads, Stop());
}

absl::Status Integrator::DeleteScan(const ScanId& id) {
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core_.Reader());
  STRATA_ASSIGN_OR_RETURN(const PosedScan posed, FindScan(*reader, id, epoch()));
  const ScanNumber number = posed.scan.number;
  STRATA_ASSIGN_OR_RETURN(const std::vector<TileKey> tiles, reader->TilesOfScan(number));
  TileChange change;
  STRATA_ASSIGN_OR_RETURN(change.tiles,
                          TilesWithout(*reader, {tiles.begin(), tiles.end()}, number));
  STRATA_ASSIGN_OR_RETURN(change.version, ReserveVersion());
  STRATA_RETURN_IF_ERROR(MakeServed(*reader, change));
  STRATA_RETURN_IF_ERROR(Commit(
      Durability::kFull, change, [&](StorageWriter& writer) { return writer.DeleteScan(number); }));
  aligner_loaded_ = false;
  return absl::OkStatus();
}

absl::Status Integrator::SetPose(const ScanId& id, const Pose& T_map_scan) {
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core_.Reader());
  STRATA_ASSIGN_OR_RETURN(const PosedScan posed, FindScan(*reader, id, epoch()));
  const ScanRecord& scan = posed.scan;
  if (scan.state != ScanState::kIntegrated) {
    return absl::FailedPreconditionError(absl::StrCat("scan ",
                                                      id.ToString(),
                                                      scan.state == ScanState::kPending
                                                          ? " is not integrated yet; wait for it"
                                                          : " failed to integrate; delete it"));
  }
  const MapParameters parameters = core_.info().parameters;
  ScanSource source(*reader, parameters);
  STRATA_ASSIGN_OR_RETURN(const MlsMap contribution, source.Contribution(scan, T_map_scan));
  STRATA_RETURN_IF_ERROR(CheckContributes(
      contribution, source.dropped(), scan.header, scan.header.sensor.value_or(parameters.sensor)));
  STRATA_ASSIGN_OR_RETURN(const std::vector<TileKey> old, reader->TilesOfScan(scan.number));
  absl::btree_set<TileKey> keys(old.begin(), old.end());
  std::vector<TileKey> tiles;
  for (const MlsTile& tile : contribution.tiles) {
    if (tile.patches.empty()) continue;
    tiles.push_back(tile.key);
    keys.insert(tile.key);
  }
  TileChange change;
  STRATA_ASSIGN_OR_RETURN(change.tiles, TilesWithout(*reader, keys, scan.number));
  JoinContribution(
      contribution, [](const TileKey&) { return true; }, change.tiles);
  STRATA_ASSIGN_OR_RETURN(change.version, ReserveVersion());
  STRATA_RETURN_IF_ERROR(MakeServed(*reader, change));
  const absl::Status done =
      Commit(Durability::kFull, change, [&](StorageWriter& writer) -> absl::Status {
        STRATA_ASSIGN_OR_RETURN(const std::uint64_t next,
                                writer.BeginEpoch(absl::StrCat("pose of ", id.ToString())));
        AlignmentReport report;
        report.message = "set by hand";
        STRATA_RETURN_IF_ERROR(
            writer.PutPose({scan.number, next, T_map_scan, PoseOrigin::kPerson, report}));
        STRATA_RETURN_IF_ERROR(writer.SetTilesOfScan(scan.number, tiles));
        return writer.SetFootprint(scan.number, FootprintOf(scan.box_scan, T_map_scan));
      });
  STRATA_RETURN_IF_ERROR(done);
  aligner_loaded_ = false;
  return absl::OkStatus();
}

}  // namespace strata
