#include "core/engine/ingest/scan_mover.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "core/common/status.h"
#include "core/engine/ingest/changed_tiles.h"
#include "core/engine/map/parallel.h"

namespace strata {
namespace {

// Epochs that can be gone back to, the current one among them.
constexpr std::uint64_t kKeptEpochs = 32;

double Share(std::size_t i, std::size_t count) {
  return static_cast<double>(i) / static_cast<double>(count);
}

}  // namespace

const TilesAhead* ScanMover::Ahead() const {
  return moves_.ahead != nullptr && moves_.ahead->IsOfNow() ? moves_.ahead : nullptr;
}

absl::Status ScanMover::MoveAll() {
  std::vector<ChangedScan> list(moves_.poses.size());
  const TilesAhead* const ahead = Ahead();
  STRATA_RETURN_IF_ERROR(
      ParallelFor(threads_, list.size(), [&](int thread, std::size_t i) -> absl::Status {
        if (thread == 0) {
          STRATA_RETURN_IF_ERROR(context_.Progress(0.2 * Share(i, list.size()), "moving scans"));
        }
        const ProposedPose& move = moves_.poses[i];
        const ChangedScan* const moved =
            ahead == nullptr ? nullptr : ahead->FindScan(move.scan, move.T_map_scan);
        if (moved != nullptr) {
          list[i] = *moved;
          return absl::OkStatus();
        }
        STRATA_ASSIGN_OR_RETURN(list[i], MovedScan(core_, move, epoch_, moves_.damaged));
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
                        .ahead = Ahead(),
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
