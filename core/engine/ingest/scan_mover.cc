#include "core/engine/ingest/scan_mover.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"

#include "core/common/status.h"
#include "core/engine/map/parallel.h"
#include "core/engine/scans/scan_losses.h"
#include "core/engine/scans/scan_share.h"
#include "core/engine/scans/scan_source.h"

namespace strata {
namespace {

// Epochs that can be gone back to, the current one among them.
constexpr std::uint64_t kKeptEpochs = 32;

double Share(std::size_t i, std::size_t count) {
  return static_cast<double>(i) / static_cast<double>(count);
}

}  // namespace

absl::StatusOr<ChangedScan> ScanMover::Move(const ProposedPose& pose) const {
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core_.Reader());
  STRATA_ASSIGN_OR_RETURN(PosedScan posed, reader->GetScan(pose.scan, epoch_));
  const ScanHeader& header = posed.scan.header;
  const MapParameters parameters = core_.info().parameters;
  const ScanShare share(core_.caches(), posed.scan);
  ScanSource source(*reader, parameters);
  ChangedScan moved;
  moved.T_map_scan = pose.T_map_scan;
  const absl::StatusOr<MlsMap> contribution = source.Contribution(posed.scan, pose.T_map_scan);
  if (moves_.damaged != nullptr &&
      moves_.damaged->LeaveOut(pose.scan, header.id.ToString(), contribution.status())) {
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

absl::Status ScanMover::MoveAll() {
  std::vector<ChangedScan> list(moves_.poses.size());
  STRATA_RETURN_IF_ERROR(
      ParallelFor(threads_, list.size(), [&](int thread, std::size_t i) -> absl::Status {
        if (thread == 0) {
          STRATA_RETURN_IF_ERROR(context_.Progress(0.2 * Share(i, list.size()), "moving scans"));
        }
        STRATA_ASSIGN_OR_RETURN(list[i], Move(moves_.poses[i]));
        return absl::OkStatus();
      }));
  for (ChangedScan& scan : list) {
    const ScanNumber number = scan.scan.number;
    moved_[number] = std::move(scan);
  }
  return absl::OkStatus();
}

absl::Status ScanMover::KeepOtherTiles(StorageReader& reader,
                                       const absl::btree_set<TileKey>& made) {
  if (moves_.damaged == nullptr) return absl::OkStatus();
  for (const ScanNumber number : moves_.damaged->Scans()) {
    if (moved_.contains(number)) continue;
    STRATA_ASSIGN_OR_RETURN(std::vector<TileKey> tiles, reader.TilesOfScan(number));
    std::erase_if(tiles, [&made](const TileKey& key) { return made.contains(key); });
    tiles_of_damaged_[number] = std::move(tiles);
  }
  return absl::OkStatus();
}

absl::Status ScanMover::PutMoves(StorageWriter& writer, std::uint64_t epoch) const {
  AlignmentReport report;
  report.message = moves_.reason;
  for (const auto& [number, scan] : moved_) {
    STRATA_RETURN_IF_ERROR(writer.PutPose({number, epoch, scan.T_map_scan, moves_.origin, report}));
    STRATA_RETURN_IF_ERROR(writer.SetTilesOfScan(number, scan.tiles));
    STRATA_RETURN_IF_ERROR(
        writer.SetFootprint(number, FootprintOf(scan.scan.box_scan, scan.T_map_scan)));
  }
  for (const auto& [number, tiles] : tiles_of_damaged_) {
    STRATA_RETURN_IF_ERROR(writer.SetTilesOfScan(number, tiles));
  }
  return absl::OkStatus();
}

absl::StatusOr<MoveOutcome> ScanMover::Run(
    absl::FunctionRef<absl::Status(StorageWriter&)> decision) {
  STRATA_RETURN_IF_ERROR(MoveAll());
  {
    STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core_.Reader());
    ChangedTiles tiles(core_,
                       store_,
                       staged_,
                       moved_,
                       {.version = version_,
                        .threads = threads_,
                        .joining = 0.2,
                        .annotating = 0.7,
                        .damaged = moves_.damaged,
                        .change_of = std::nullopt},
                       context_);
    STRATA_ASSIGN_OR_RETURN(const auto made, tiles.Stage(*reader));
    STRATA_RETURN_IF_ERROR(KeepOtherTiles(*reader, made));
  }
  MoveOutcome outcome;
  outcome.tiles = staged_.changed();
  std::vector<ScanId> scans;
  for (const auto& [number, scan] : moved_) scans.push_back(scan.scan.header.id);
  STRATA_RETURN_IF_ERROR(staged_.Publish(scans, [&](StorageWriter& writer) -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(outcome.epoch, writer.BeginEpoch(moves_.reason, moves_.job));
    STRATA_RETURN_IF_ERROR(PutMoves(writer, outcome.epoch));
    STRATA_RETURN_IF_ERROR(decision(writer));
    if (outcome.epoch < kKeptEpochs) return absl::OkStatus();
    return writer.ForgetEpochsBefore(outcome.epoch - kKeptEpochs + 1);
  }));
  return outcome;
}

}  // namespace strata
