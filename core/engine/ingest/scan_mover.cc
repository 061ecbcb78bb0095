#include "core/engine/ingest/scan_mover.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"

#include "core/common/status.h"
#include "core/engine/map/parallel.h"
#include "core/engine/scans/scan_losses.h"
#include "core/engine/scans/scan_share.h"
#include "core/engine/scans/scan_source.h"
#include "core/engine/tiles/surface_tiles.h"

namespace strata {
namespace {

// Epochs that can be gone back to, the current one among them.
constexpr std::uint64_t kKeptEpochs = 32;

double Share(std::size_t i, std::size_t count) {
  return static_cast<double>(i) / static_cast<double>(count);
}

}  // namespace

absl::StatusOr<ScanMover::MovedScan> ScanMover::Move(const ProposedPose& pose) const {
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core_.Reader());
  STRATA_ASSIGN_OR_RETURN(PosedScan posed, reader->GetScan(pose.scan, epoch_));
  const ScanHeader& header = posed.scan.header;
  const MapParameters parameters = core_.info().parameters;
  const ScanShare share(core_.caches(), posed.scan);
  ScanSource source(*reader, parameters);
  MovedScan moved;
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
  for (const MlsTile& tile : contribution->tiles) {
    if (!tile.patches.empty()) moved.tiles.push_back(tile.key);
  }
  moved.scan = std::move(posed.scan);
  return moved;
}

absl::Status ScanMover::MoveAll() {
  std::vector<MovedScan> list(moves_.poses.size());
  STRATA_RETURN_IF_ERROR(
      ParallelFor(threads_, list.size(), [&](int thread, std::size_t i) -> absl::Status {
        if (thread == 0) {
          STRATA_RETURN_IF_ERROR(context_.Progress(0.2 * Share(i, list.size()), "moving scans"));
        }
        STRATA_ASSIGN_OR_RETURN(list[i], Move(moves_.poses[i]));
        return absl::OkStatus();
      }));
  for (MovedScan& scan : list) {
    const ScanNumber number = scan.scan.number;
    moved_[number] = std::move(scan);
  }
  return absl::OkStatus();
}

// Where the scans were and where they come to.
absl::StatusOr<ScanMover::KeySet> ScanMover::TilesTouched(StorageReader& reader) const {
  KeySet keys;
  for (const auto& [number, scan] : moved_) {
    STRATA_ASSIGN_OR_RETURN(const std::vector<TileKey> old, reader.TilesOfScan(number));
    keys.insert(old.begin(), old.end());
    keys.insert(scan.tiles.begin(), scan.tiles.end());
  }
  return keys;
}

absl::StatusOr<std::vector<PlacedScanRecord>> ScanMover::ScansOfBlock(StorageReader& reader,
                                                                      const KeySet& keys) const {
  STRATA_ASSIGN_OR_RETURN(std::vector<PlacedScanRecord> scans,
                          ScansOfTiles(reader, keys, epoch_, moves_.damaged));
  std::erase_if(scans, [this](const PlacedScanRecord& placed) {
    return moved_.contains(placed.scan.number);
  });
  for (const auto& [number, scan] : moved_) {
    const bool touches = std::any_of(scan.tiles.begin(), scan.tiles.end(), [&](const TileKey& key) {
      return keys.contains(key);
    });
    if (touches) scans.push_back({scan.scan, scan.T_map_scan});
  }
  return scans;
}

absl::StatusOr<MlsTileMap> ScanMover::StageMlsTiles(StorageReader& reader, const KeySet& keys) {
  MlsTileMap gone;
  const std::vector<KeySet> blocks = TileBlocks(keys);
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    STRATA_RETURN_IF_ERROR(context_.Progress(0.2 + 0.5 * Share(i, blocks.size()), "joining tiles"));
    STRATA_ASSIGN_OR_RETURN(const std::vector<PlacedScanRecord> scans,
                            ScansOfBlock(reader, blocks[i]));
    STRATA_ASSIGN_OR_RETURN(
        const MlsTileMap tiles,
        MakeTiles(core_, scans, blocks[i], threads_, context_.stop(), moves_.damaged));
    for (const auto& [key, tile] : tiles) {
      if (tile == nullptr) gone[key] = nullptr;
    }
    STRATA_RETURN_IF_ERROR(staged_.Put(tiles, {}));
  }
  return gone;
}

absl::Status ScanMover::StageSurfaces(StorageReader& reader,
                                      const KeySet& keys,
                                      const MlsTileMap& gone) {
  SurfaceTileMaker maker(core_,
                         reader,
                         store_,
                         gone,
                         {.version = version_,
                          .threads = threads_,
                          .profile = core_.info().parameters.default_profile});
  return MakeChangedSurfaces(
      maker,
      WithNeighbours(keys),
      context_.stop(),
      [&](double share) { return context_.Progress(0.7 + 0.3 * share, "annotating tiles"); },
      [&](const SurfaceTileMaker::Rows& rows) { return staged_.Put({}, rows); });
}

absl::Status ScanMover::KeepOtherTiles(StorageReader& reader, const KeySet& keys) {
  if (moves_.damaged == nullptr) return absl::OkStatus();
  for (const ScanNumber number : moves_.damaged->Scans()) {
    if (moved_.contains(number)) continue;
    STRATA_ASSIGN_OR_RETURN(std::vector<TileKey> tiles, reader.TilesOfScan(number));
    std::erase_if(tiles, [&keys](const TileKey& key) { return keys.contains(key); });
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
    STRATA_ASSIGN_OR_RETURN(const KeySet keys, TilesTouched(*reader));
    STRATA_ASSIGN_OR_RETURN(const MlsTileMap gone, StageMlsTiles(*reader, keys));
    STRATA_RETURN_IF_ERROR(StageSurfaces(*reader, keys, gone));
    STRATA_RETURN_IF_ERROR(KeepOtherTiles(*reader, keys));
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
