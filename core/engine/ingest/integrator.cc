#include "core/engine/ingest/integrator.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/container/btree_set.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

#include "core/common/status.h"
#include "core/engine/map/aside.h"
#include "core/engine/scans/scan_losses.h"
#include "core/engine/scans/scan_share.h"
#include "core/engine/scans/scan_source.h"
#include "core/engine/tiles/tile_rows.h"

namespace strata {
namespace {

constexpr std::uint64_t kBatchPoints = 8'000'000;
// Tiles of a batch, beyond which no scan joins it: those of two batches are in memory at once.
constexpr std::size_t kBatchBytes = std::size_t{48} << 20;

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

absl::Status Integrator::MakeServed(StorageReader& reader,
                                    TileChange& change,
                                    int threads,
                                    bool geometry) {
  const MapParameters parameters = core_.info().parameters;
  SurfaceTileMaker maker(
      core_,
      reader,
      store_,
      change.tiles,
      {.version = change.version, .threads = threads, .profile = parameters.default_profile});
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
                                Decision decision,
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
  STRATA_RETURN_IF_ERROR(core_.Publish(
      scans, NoticesOf(change.surfaces), awaited, [&](StorageWriter& writer) -> absl::Status {
        // First what may free pages: a scan can be deleted from a file that may not grow.
        STRATA_RETURN_IF_ERROR(decision(writer));
        STRATA_RETURN_IF_ERROR(RetireTileRows(writer, keys, change.version, floor));
        STRATA_RETURN_IF_ERROR(PutTileRows(writer, rows, change.surfaces));
        return writer.PublishTiles(change.version, true);
      }));
  store_.Replace(change.tiles);
  return absl::OkStatus();
}

absl::StatusOr<MlsTilePtr> Integrator::TileOf(const TileKey& key,
                                              StorageReader& reader,
                                              std::uint64_t version,
                                              const Batch* behind) {
  if (behind != nullptr) {
    const auto found = behind->change.tiles.find(key);
    if (found != behind->change.tiles.end()) return found->second;
  }
  return store_.Load(reader, key, version);
}

absl::Status Integrator::IntegrateScan(const ScanRecord& scan,
                                       absl::StatusOr<ReadyScan> ready,
                                       StorageReader& reader,
                                       const Batch* behind,
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
  MlsTileMap& tiles = batch.change.tiles;
  const std::uint64_t version = core_.snapshots().current().tile_version;
  for (const MlsTile& tile : contribution.tiles) {
    if (tile.patches.empty()) continue;
    done.tiles.push_back(tile.key);
    if (tiles.contains(tile.key)) continue;
    STRATA_ASSIGN_OR_RETURN(MlsTilePtr held, TileOf(tile.key, reader, version, behind));
    tiles[tile.key] = std::move(held);
  }
  STRATA_RETURN_IF_ERROR(CheckRoomInTiles(contribution, tiles));
  JoinAndForget(std::move(contribution), tiles);
  aligner_.Add(scan, done.placement);
  batch.integrated.push_back(std::move(done));
  return absl::OkStatus();
}

absl::Status Integrator::Fill(std::span<const PosedScan> pending,
                              std::size_t first,
                              const Batch* behind,
                              ScansAhead& scans,
                              Batch& batch) {
  STRATA_RETURN_IF_ERROR(core_.disk().CheckForIntegration(0));
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core_.Reader());
  const auto most = static_cast<std::size_t>(core_.options().max_batch_scans);
  std::uint64_t points = 0;
  for (std::size_t i = first; i < pending.size() && batch.scans < most; ++i) {
    const ScanRecord& scan = pending[i].scan;
    if (batch.scans > 0 && (points + scan.header.point_count > kBatchPoints ||
                            MemoryBytes(batch.change.tiles) > kBatchBytes)) {
      break;
    }
    points += scan.header.point_count;
    ++batch.scans;
    const ScanShare share(core_.caches(), scan);
    const absl::Status done = IntegrateScan(scan, scans.Take(i), *reader, behind, batch);
    if (done.ok()) continue;
    if (!IsFaultOfScan(done)) return done;
    batch.failed.push_back({scan.number, scan.header.id, std::string(done.message())});
  }
  return absl::OkStatus();
}

absl::Status Integrator::PublishBatch(Batch& batch, int threads) {
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core_.Reader());
  STRATA_ASSIGN_OR_RETURN(batch.change.version, NextVersion());
  STRATA_RETURN_IF_ERROR(MakeServed(*reader, batch.change, threads));
  return CommitBatch(batch);
}

absl::StatusOr<int> Integrator::IntegratePending(int most_scans,
                                                 absl::FunctionRef<bool()> goes_on) {
  std::vector<PosedScan> pending;
  {
    STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core_.Reader());
    ScanQuery query;
    query.state = ScanState::kPending;
    query.skip_damaged = true;  // it stays pending, and verify names it
    query.limit = static_cast<std::uint32_t>(most_scans);
    STRATA_ASSIGN_OR_RETURN(pending, reader->ListScans(query, epoch()));
    if (pending.empty()) return 0;
    STRATA_RETURN_IF_ERROR(LoadAlignerOnce(*reader));
  }
  std::size_t count = 0;
  const absl::Status done = IntegrateBatches(pending, goes_on, count);
  if (!done.ok()) ForgetCaches();  // they may know of scans that were not committed
  // Whatever it was comes again with the scans that are left.
  if (!done.ok() && count == 0) return done;
  return static_cast<int>(count);
}

absl::Status Integrator::IntegrateBatches(std::span<const PosedScan> pending,
                                          absl::FunctionRef<bool()> goes_on,
                                          std::size_t& count) {
  const int threads = core_.options().worker_threads;
  // Points that go with a commit must not be read meanwhile.
  const bool overlap = threads > 1 && core_.info().parameters.keep_points;
  std::optional<ScansAhead> scans(std::in_place, core_, pending);
  std::unique_ptr<Batch> behind;
  std::optional<Aside> publication;  // of what is behind
  const auto settle = [&]() -> absl::Status {
    if (!publication.has_value()) return absl::OkStatus();
    const absl::Status published = publication->Await();
    publication.reset();
    if (published.ok()) count += behind->scans;
    behind.reset();
    return published;
  };
  for (std::size_t next = 0; next < pending.size() && (next == 0 || goes_on());) {
    auto batch = std::make_unique<Batch>();
    const absl::Status filled = Fill(pending, next, behind.get(), *scans, *batch);
    STRATA_RETURN_IF_ERROR(settle());
    STRATA_RETURN_IF_ERROR(filled);
    next += batch->scans;
    behind = std::move(batch);
    if (overlap && next < pending.size()) {
      publication.emplace("worker tiles", [this, &made = *behind, threads] {
        return PublishBatch(made, threads - 1);
      });
      continue;
    }
    if (next == pending.size()) scans.reset();  // its memory
    STRATA_RETURN_IF_ERROR(PublishBatch(*behind, threads));
    count += behind->scans;
    behind.reset();
  }
  return settle();
}

absl::Status Integrator::CommitBatch(const Batch& batch) {
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
  return Commit(batch.change, scans, decision, /*awaited=*/false);
}

}  // namespace strata
