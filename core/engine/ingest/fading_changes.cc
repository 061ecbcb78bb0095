// Scans of which points fade, or come back.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/container/btree_map.h"
#include "absl/container/btree_set.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

#include "core/common/status.h"
#include "core/engine/ingest/integrator.h"
#include "core/engine/map/parallel.h"
#include "core/engine/scans/scan_source.h"
#include "core/engine/tiles/staged_tiles.h"

namespace strata {
namespace {

using KeySet = absl::btree_set<TileKey>;

// A scan as it will be.
struct ChangedScan {
  ScanRecord scan;
  Pose T_map_scan = Pose::Identity();
  std::vector<TileKey> tiles;
  std::uint64_t faded_points = 0;
  std::vector<std::string> pieces;  // of its labels
};

double Share(std::size_t i, std::size_t count) {
  return static_cast<double>(i) / static_cast<double>(count);
}

// Makes the tiles of scans that change beside the current ones, then switches readers. `store` must
// be empty, and holds tiles as they will be afterwards.
class FadingPass {
 public:
  FadingPass(MapCore& core,
             MlsTileStore& store,
             const FadingRequest& request,
             std::uint64_t version,
             JobContext& context)
      : core_(core),
        store_(store),
        request_(request),
        context_(context),
        threads_(core.options().worker_threads),
        epoch_(core.snapshots().current().epoch),
        version_(version),
        staged_(core, version) {}

  absl::StatusOr<std::size_t> Run() {
    STRATA_RETURN_IF_ERROR(FindChanges());
    if (changed_.empty()) return 0;
    {
      STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core_.Reader());
      STRATA_ASSIGN_OR_RETURN(const KeySet keys, TilesTouched(*reader));
      STRATA_ASSIGN_OR_RETURN(const MlsTileMap gone, StageMlsTiles(*reader, keys));
      STRATA_RETURN_IF_ERROR(StageSurfaces(*reader, keys, gone));
    }
    STRATA_RETURN_IF_ERROR(Publish());
    return changed_.size();
  }

 private:
  absl::Status FindChanges() {
    const std::vector<ScanNumber>& scans = request_.scans;
    std::vector<std::optional<ChangedScan>> found(scans.size());
    STRATA_RETURN_IF_ERROR(
        ParallelFor(threads_, scans.size(), [&](int thread, std::size_t i) -> absl::Status {
          STRATA_RETURN_IF_ERROR(context_.stop().status());
          if (thread == 0) {
            STRATA_RETURN_IF_ERROR(
                context_.Progress(0.7 + 0.1 * Share(i, scans.size()), "finding what changes"));
          }
          STRATA_ASSIGN_OR_RETURN(found[i], FindChange(scans[i]));
          return absl::OkStatus();
        }));
    for (std::optional<ChangedScan>& scan : found) {
      if (scan.has_value()) changed_[scan->scan.number] = *std::move(scan);
    }
    return absl::OkStatus();
  }

  // nullopt: as it is stored, or gone.
  absl::StatusOr<std::optional<ChangedScan>> FindChange(ScanNumber number) const {
    STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core_.Reader());
    absl::StatusOr<PosedScan> posed = reader->GetScan(number, epoch_);
    if (absl::IsNotFound(posed.status())) return std::nullopt;
    STRATA_RETURN_IF_ERROR(posed.status());
    if (posed->scan.state != ScanState::kIntegrated || !posed->pose.has_value()) {
      return std::nullopt;
    }
    const LabelChange change = request_.change_of(posed->scan);
    STRATA_ASSIGN_OR_RETURN(const bool stored, IsStored(*reader, posed->scan, change));
    if (stored) return std::nullopt;
    ChangedScan scan;
    scan.scan = std::move(posed->scan);
    scan.T_map_scan = posed->pose->T_map_scan;
    scan.faded_points = change.model;
    scan.pieces = EncodeLabelChange(change);
    const MapParameters parameters = core_.info().parameters;
    ScanSource source(*reader, parameters, {.change = &change});
    const absl::StatusOr<MlsMap> contribution = source.Contribution(scan.scan, scan.T_map_scan);
    if (!contribution.ok()) {
      return Annotate(contribution.status(), absl::StrCat("scan ", scan.scan.header.id.ToString()));
    }
    for (const MlsTile& tile : contribution->tiles) {
      if (!tile.patches.empty()) scan.tiles.push_back(tile.key);
    }
    return scan;
  }

  static absl::StatusOr<bool> IsStored(StorageReader& reader,
                                       const ScanRecord& scan,
                                       const LabelChange& change) {
    if (scan.faded_points == 0 || change.model == 0) return scan.faded_points == change.model;
    STRATA_ASSIGN_OR_RETURN(const std::vector<std::uint16_t> stored,
                            ReadLabels(reader, scan, LabelOrigin::kFaded));
    return stored == change.labels;
  }

  // Where the scans are now and where they will be.
  absl::StatusOr<KeySet> TilesTouched(StorageReader& reader) const {
    KeySet keys;
    for (const auto& [number, scan] : changed_) {
      STRATA_ASSIGN_OR_RETURN(const std::vector<TileKey> now, reader.TilesOfScan(number));
      keys.insert(now.begin(), now.end());
      keys.insert(scan.tiles.begin(), scan.tiles.end());
    }
    return keys;
  }

  // All scans of the tiles, as they will be; `changes` gets what is said of them.
  absl::StatusOr<std::vector<PlacedScanRecord>> ScansOfBlock(
      StorageReader& reader, const KeySet& keys, std::map<ScanNumber, LabelChange>& changes) const {
    STRATA_ASSIGN_OR_RETURN(std::vector<PlacedScanRecord> scans,
                            ScansOfTiles(reader, keys, epoch_));
    std::erase_if(scans, [this](const PlacedScanRecord& placed) {
      return changed_.contains(placed.scan.number);
    });
    for (const auto& [number, scan] : changed_) {
      const auto touches = [&keys](const TileKey& key) { return keys.contains(key); };
      if (std::none_of(scan.tiles.begin(), scan.tiles.end(), touches)) continue;
      const LabelChange& change = changes[number] = request_.change_of(scan.scan);
      scans.push_back({scan.scan, scan.T_map_scan, &change});
    }
    return scans;
  }

  // Returns the tiles where nothing is any more.
  absl::StatusOr<MlsTileMap> StageMlsTiles(StorageReader& reader, const KeySet& keys) {
    MlsTileMap gone;
    const std::vector<KeySet> blocks = TileBlocks(keys);
    for (std::size_t i = 0; i < blocks.size(); ++i) {
      STRATA_RETURN_IF_ERROR(
          context_.Progress(0.8 + 0.1 * Share(i, blocks.size()), "joining tiles"));
      std::map<ScanNumber, LabelChange> changes;
      STRATA_ASSIGN_OR_RETURN(const std::vector<PlacedScanRecord> scans,
                              ScansOfBlock(reader, blocks[i], changes));
      STRATA_ASSIGN_OR_RETURN(const MlsTileMap tiles,
                              MakeTiles(core_, scans, blocks[i], threads_, context_.stop()));
      for (const auto& [key, tile] : tiles) {
        if (tile == nullptr) gone[key] = nullptr;
      }
      STRATA_RETURN_IF_ERROR(staged_.Put(tiles, {}));
    }
    return gone;
  }

  absl::Status StageSurfaces(StorageReader& reader, const KeySet& keys, const MlsTileMap& gone) {
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
        [&](double share) { return context_.Progress(0.9 + 0.1 * share, "annotating tiles"); },
        [&](const SurfaceTileMaker::Rows& rows) { return staged_.Put({}, rows); });
  }

  absl::Status Publish() {
    std::vector<ScanId> ids;
    for (const auto& [number, scan] : changed_) ids.push_back(scan.scan.header.id);
    return staged_.Publish(ids, [this](StorageWriter& writer) -> absl::Status {
      for (const auto& [number, scan] : changed_) {
        STRATA_RETURN_IF_ERROR(
            writer.PutLabels(number, LabelOrigin::kFaded, scan.faded_points, scan.pieces));
        STRATA_RETURN_IF_ERROR(writer.SetTilesOfScan(number, scan.tiles));
      }
      return absl::OkStatus();
    });
  }

  MapCore& core_;
  MlsTileStore& store_;
  const FadingRequest& request_;
  JobContext& context_;
  const int threads_;
  const std::uint64_t epoch_;
  const std::uint64_t version_;
  StagedTiles staged_;
  absl::btree_map<ScanNumber, ChangedScan> changed_;
};

}  // namespace

absl::StatusOr<std::size_t> Integrator::SetFaded(const FadingRequest& request,
                                                 JobContext& context) {
  STRATA_ASSIGN_OR_RETURN(const std::uint64_t version, NextVersion());
  // Decoded tiles are kept by key alone: those to come must not outlive a failure.
  store_.Clear();
  absl::StatusOr<std::size_t> changed = FadingPass(core_, store_, request, version, context).Run();
  ForgetCaches();
  return changed;
}

}  // namespace strata
