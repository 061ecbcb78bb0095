// Scans that leave or move.
#include <cstdint>
#include <vector>

#include "absl/cleanup/cleanup.h"
#include "absl/container/btree_set.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

#include "core/common/status.h"
#include "core/engine/ingest/integrator.h"
#include "core/engine/map/scan_lookup.h"

namespace strata {
absl::StatusOr<MlsTileMap> Integrator::TilesWithout(StorageReader& reader,
                                                    const absl::btree_set<TileKey>& keys,
                                                    ScanNumber without) {
  STRATA_ASSIGN_OR_RETURN(std::vector<PlacedScanRecord> scans, ScansOfTiles(reader, keys, epoch()));
  std::erase_if(
      scans, [without](const PlacedScanRecord& placed) { return placed.scan.number == without; });
  return MakeTiles(core_, scans, keys, core_.options().worker_threads, Stop());
}

absl::Status Integrator::DeleteScan(const ScanId& id, Decision also) {
  const absl::Cleanup edited = [this] { core_.NoteEdit(); };
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core_.Reader());
  STRATA_ASSIGN_OR_RETURN(const PosedScan posed, GetScanById(*reader, id, epoch()));
  const ScanNumber number = posed.scan.number;
  STRATA_ASSIGN_OR_RETURN(const std::vector<TileKey> tiles, reader->TilesOfScan(number));
  TileChange change;
  STRATA_ASSIGN_OR_RETURN(change.tiles,
                          TilesWithout(*reader, {tiles.begin(), tiles.end()}, number));
  STRATA_ASSIGN_OR_RETURN(change.version, NextVersion());
  STRATA_RETURN_IF_ERROR(MakeServed(*reader, change, core_.options().worker_threads));
  STRATA_RETURN_IF_ERROR(Commit(change, {id}, [&](StorageWriter& writer) -> absl::Status {
    STRATA_RETURN_IF_ERROR(core_.NoteInferredIfAny(writer.reader()));
    STRATA_RETURN_IF_ERROR(writer.DeleteScan(number));
    return also(writer);
  }));
  aligner_loaded_ = false;
  return absl::OkStatus();
}

absl::StatusOr<MoveOutcome> Integrator::MoveScans(const ScanMoves& moves,
                                                  int threads,
                                                  JobContext& context,
                                                  Decision decision) {
  STRATA_ASSIGN_OR_RETURN(const std::uint64_t version, NextVersion());
  // Decoded tiles are kept by key alone: those of the coming epoch must not outlive a failure.
  store_.Clear();
  absl::StatusOr<MoveOutcome> outcome =
      ScanMover(core_, store_, moves, version, threads, context).Run(decision);
  store_.Clear();
  aligner_loaded_ = false;
  return outcome;
}

absl::Status Integrator::SetPose(const ScanId& id, const Pose& T_map_scan, Decision also) {
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core_.Reader());
  STRATA_ASSIGN_OR_RETURN(const PosedScan posed, GetScanById(*reader, id, epoch()));
  const ScanRecord& scan = posed.scan;
  if (scan.state != ScanState::kIntegrated) {
    return absl::FailedPreconditionError(absl::StrCat("scan ",
                                                      id.ToString(),
                                                      scan.state == ScanState::kPending
                                                          ? " is not integrated yet; wait for it"
                                                          : " failed to integrate; delete it"));
  }
  ScanMoves moves;
  moves.poses.push_back({scan.number, T_map_scan});
  moves.origin = PoseOrigin::kPerson;
  moves.reason = absl::StrCat("pose of ", id.ToString());
  SilentContext context{Stop()};
  return MoveScans(moves, core_.options().worker_threads, context, also).status();
}

}  // namespace strata
