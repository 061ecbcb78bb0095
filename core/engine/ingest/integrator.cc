#include "core/engine/ingest/integrator.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/container/btree_set.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

#include "core/common/status.h"
#include "core/engine/scans/scan_losses.h"
#include "core/engine/scans/scan_share.h"
#include "core/engine/scans/scan_source.h"
#include "core/engine/tiles/tile_rows.h"

namespace strata {
namespace {

constexpr std::uint64_t kBatchPoints = 8'000'000;
// Tiles of a batch, beyond which no scan joins it: they are in memory until it is committed.
constexpr std::size_t kBatchBytes = std::size_t{96} << 20;

std::size_t MemoryBytes(const MlsTileMap& tiles) {
  std::size_t bytes = 0;
  for (const auto& [key, tile] : tiles) bytes += tile == nullptr ? 0 : MemoryBytes(*tile);
  return bytes;
}

// Joins the tiles one by one, so that none is in memory twice for long.
void JoinAndForget(MlsMap contribution, MlsTileMap& tiles) {
  for (MlsTile& tile : contribution.tiles) {
    MlsMap part;
    part.parameters = contribution.parameters;
    part.tiles.push_back(std::move(tile));
    JoinContribution(
        part, [](const TileKey&) { return true; }, tiles);
  }
}

// What the rows of a change take on the disk, all but a few that are small.
std::uint64_t BytesOf(const std::vector<MlsTileRow>& rows, const TileChange& change) {
  std::uint64_t bytes = 0;
  for (const MlsTileRow& row : rows) bytes += row.bytes.size();
  for (const SurfaceTileRow& row : change.surfaces) bytes += row.bytes.size();
  return bytes;
}

// Errors that a scan's own bytes cause; others concern the store and may go away.
bool IsFaultOfScan(const absl::Status& status) {
  return absl::IsDataLoss(status) || absl::IsInvalidArgument(status) ||
         absl::IsUnimplemented(status) || absl::IsOutOfRange(status);
}

}  // namespace

absl::StatusOr<std::uint64_t> Integrator::NextVersion() {
  // Left by work that failed: they would be taken for what is stored, and be published too.
  if (core_.tiles_staged()) {
    STRATA_RETURN_IF_ERROR(
        core_.writer().Run(Durability::kRelaxed, 0, Stop(), [](StorageWriter& writer) {
          return writer.DiscardUnpublished();
        }));
    core_.set_tiles_staged(false);
  }
  // Every publication took a number that was not smaller than its version. Scans may take this one
  // and later ones meanwhile; the publication of these tiles will have one that is later still.
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core_.Reader());
  STRATA_ASSIGN_OR_RETURN(const MapClock clock, reader->GetClock());
  return clock.commit_sequence + 1;
}

absl::Status Integrator::LoadAlignerOnce(StorageReader& reader) {
  if (aligner_loaded_) return absl::OkStatus();
  STRATA_RETURN_IF_ERROR(aligner_.Load(reader, epoch()));
  aligner_loaded_ = true;
  return absl::OkStatus();
}

absl::Status Integrator::MakeServed(StorageReader& reader, TileChange& change, bool geometry) {
  const MapParameters parameters = core_.info().parameters;
  SurfaceTileMaker maker(core_,
                         reader,
                         store_,
                         change.tiles,
                         {.version = change.version,
                          .threads = core_.options().worker_threads,
                          .profile = parameters.default_profile});
  absl::btree_set<TileKey> changed;
  for (const auto& [key, tile] : change.tiles) changed.insert(key);
  // A tile's annotation looks beyond its border, at heights only.
  if (geometry) changed = WithNeighbours(changed);
  for (const absl::btree_set<TileKey>& block : TileBlocks(changed)) {
    STRATA_ASSIGN_OR_RETURN(SurfaceTileMaker::Rows rows, maker.MakeBase(block, Stop()));
    std::move(rows.begin(), rows.end(), std::back_inserter(change.surfaces));
  }
  std::sort(change.surfaces.begin(),
            change.surfaces.end(),
            [](const SurfaceTileRow& a, const SurfaceTileRow& b) { return a.key < b.key; });
  const SurfaceTileMaker::Rows base = change.surfaces;
  return maker.MakePyramid(base, change.surfaces, Stop());
}

absl::Status Integrator::Commit(const TileChange& change,
                                const std::vector<ScanId>& scans,
                                absl::FunctionRef<absl::Status(StorageWriter&)> decision,
                                bool awaited) {
  const std::uint64_t floor = core_.snapshots().Floor();
  STRATA_ASSIGN_OR_RETURN(
      const std::vector<MlsTileRow> rows,
      EncodeTileRows(change.tiles, change.version, core_.info().parameters.mls.cell_size_m));
  TileRowKeys keys;
  keys.Add(change.tiles, change.surfaces);
  // What nobody waits for leaves room for what somebody may: to delete.
  if (!awaited) {
    STRATA_RETURN_IF_ERROR(core_.disk().CheckForIntegration(BytesOf(rows, change)));
  }
  absl::Status committed = core_.Publish(
      scans, NoticesOf(change.surfaces), awaited, [&](StorageWriter& writer) -> absl::Status {
        // First what may free pages: a scan can be deleted from a file that may not grow.
        STRATA_RETURN_IF_ERROR(decision(writer));
        STRATA_RETURN_IF_ERROR(RetireTileRows(writer, keys, change.version, floor));
        STRATA_RETURN_IF_ERROR(PutTileRows(writer, rows, change.surfaces));
        return writer.PublishTiles(change.version, true);
      });
  if (!committed.ok()) {
    aligner_loaded_ = false;  // it may know of scans that were not committed
    return committed;
  }
  store_.Replace(change.tiles);
  return absl::OkStatus();
}

absl::Status Integrator::IntegrateScan(const ScanRecord& scan,
                                       absl::StatusOr<ReadyScan> ready,
                                       StorageReader& reader,
                                       MlsTileMap& tiles,
                                       Batch& batch) {
  STRATA_RETURN_IF_ERROR(ready.status());
  ScanSource& source = *ready->source;
  Integrated done;
  done.scan = scan;
  done.local_map = std::move(ready->local_map);
  STRATA_ASSIGN_OR_RETURN(done.placement, aligner_.Place(scan, ready->features, reader, source));
  STRATA_ASSIGN_OR_RETURN(MlsMap contribution,
                          source.Contribution(scan, done.placement.T_map_scan));
  const SensorModel sensor = scan.header.sensor.value_or(core_.info().parameters.sensor);
  STRATA_RETURN_IF_ERROR(CheckContributes(contribution, source.dropped(), scan, sensor));
  done.losses = DescribeLosses(source.dropped(), scan.header, sensor);
  const std::uint64_t version = core_.snapshots().current().tile_version;
  for (const MlsTile& tile : contribution.tiles) {
    if (tile.patches.empty()) continue;
    done.tiles.push_back(tile.key);
    if (tiles.contains(tile.key)) continue;
    STRATA_ASSIGN_OR_RETURN(MlsTilePtr held, store_.Load(reader, tile.key, version));
    tiles[tile.key] = std::move(held);
  }
  STRATA_RETURN_IF_ERROR(CheckRoomInTiles(contribution, tiles));
  JoinAndForget(std::move(contribution), tiles);
  aligner_.Add(scan, done.placement);
  batch.integrated.push_back(std::move(done));
  return absl::OkStatus();
}

absl::StatusOr<int> Integrator::IntegrateBatch(int most_scans) {
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core_.Reader());
  ScanQuery query;
  query.state = ScanState::kPending;
  query.skip_damaged = true;  // it stays pending, and verify names it
  query.limit = static_cast<std::uint32_t>(most_scans);
  STRATA_ASSIGN_OR_RETURN(const std::vector<PosedScan> pending, reader->ListScans(query, epoch()));
  if (pending.empty()) return 0;
  STRATA_RETURN_IF_ERROR(core_.disk().CheckForIntegration(0));
  STRATA_RETURN_IF_ERROR(LoadAlignerOnce(*reader));
  std::optional<ScansAhead> scans(std::in_place, core_, pending);
  TileChange change;
  Batch batch;
  std::uint64_t points = 0;
  int count = 0;
  for (std::size_t i = 0; i < pending.size(); ++i) {
    const ScanRecord& scan = pending[i].scan;
    if (count > 0 && (points + scan.header.point_count > kBatchPoints ||
                      MemoryBytes(change.tiles) > kBatchBytes)) {
      break;
    }
    points += scan.header.point_count;
    ++count;
    const ScanShare share(core_.caches(), scan);
    const absl::Status done = IntegrateScan(scan, scans->Take(i), *reader, change.tiles, batch);
    if (done.ok()) continue;
    if (!IsFaultOfScan(done)) {
      aligner_loaded_ = false;
      return done;
    }
    batch.failed.push_back({scan.number, scan.header.id, std::string(done.message())});
  }
  scans.reset();  // its memory
  STRATA_ASSIGN_OR_RETURN(change.version, NextVersion());
  absl::Status made = MakeServed(*reader, change);
  if (made.ok()) made = CommitBatch(batch, change);
  if (!made.ok()) {
    aligner_loaded_ = false;
    return made;
  }
  return count;
}

absl::Status Integrator::CommitBatch(const Batch& batch, const TileChange& change) {
  std::vector<ScanId> scans;
  for (const Failed& failed : batch.failed) scans.push_back(failed.id);
  for (const Integrated& done : batch.integrated) scans.push_back(done.scan.header.id);
  const auto decision = [&](StorageWriter& writer) -> absl::Status {
    for (const Failed& failed : batch.failed) {
      STRATA_RETURN_IF_ERROR(
          writer.SetScanState(failed.number, ScanState::kFailed, failed.message));
    }
    for (const Integrated& done : batch.integrated) {
      const ScanNumber number = done.scan.number;
      const Pose& T_map_scan = done.placement.T_map_scan;
      STRATA_RETURN_IF_ERROR(writer.PutPose(
          {number, epoch(), T_map_scan, PoseOrigin::kIngest, done.placement.report}));
      for (const ConstraintRecord& constraint : done.placement.constraints) {
        STRATA_RETURN_IF_ERROR(writer.PutConstraint(constraint).status());
      }
      STRATA_RETURN_IF_ERROR(writer.SetTilesOfScan(number, done.tiles));
      STRATA_RETURN_IF_ERROR(
          writer.SetFootprint(number, FootprintOf(done.scan.box_scan, T_map_scan)));
      if (!done.local_map.empty() || !core_.info().parameters.keep_points) {
        STRATA_RETURN_IF_ERROR(writer.DropPoints(number, done.local_map));
      }
      STRATA_RETURN_IF_ERROR(writer.SetScanState(number, ScanState::kIntegrated, done.losses));
    }
    return absl::OkStatus();
  };
  return Commit(change, scans, decision, /*awaited=*/false);
}

}  // namespace strata
