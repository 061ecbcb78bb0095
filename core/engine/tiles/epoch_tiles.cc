#include "core/engine/tiles/epoch_tiles.h"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"

#include "core/common/status.h"
#include "core/engine/map/scan_lookup.h"
#include "core/engine/scans/scan_source.h"
#include "core/world/epoch.h"

namespace strata {
namespace {

// Whether a scan may touch the range or the tiles around it.
bool MayTouch(const PlacedScanRecord& scan, const TileRange& range, double cell_size_m) {
  const double tile_m = cell_size_m * kTileCells;
  const Eigen::AlignedBox2d box(
      Eigen::Vector2d(static_cast<double>(range.x_min - 1), static_cast<double>(range.y_min - 1)) *
          tile_m,
      Eigen::Vector2d(static_cast<double>(range.x_max + 1), static_cast<double>(range.y_max + 1)) *
          tile_m);
  return box.intersects(FootprintOf(scan.scan.box_scan, scan.T_map_scan));
}

bool SamePose(const Pose& a, const Pose& b) { return a.matrix() == b.matrix(); }

}  // namespace

absl::Status CheckEpochKept(StorageReader& reader, std::uint64_t epoch, absl::StatusCode too_old) {
  STRATA_ASSIGN_OR_RETURN(const std::optional<EpochInfo> info, reader.FindEpoch(epoch));
  if (!info.has_value()) {
    return absl::NotFoundError(absl::StrCat("epoch ", epoch, " does not exist; see map history"));
  }
  if (info->kept) return absl::OkStatus();
  return absl::Status(
      too_old,
      absl::StrCat("epoch ", epoch, " is too old: its poses are not kept; see map history"));
}

absl::StatusOr<std::unique_ptr<EpochTiles>> EpochTiles::Find(MapCore& core,
                                                             std::uint64_t epoch,
                                                             const TileRange& range,
                                                             const Stop& stop) {
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core.Reader());
  while (true) {
    STRATA_RETURN_IF_ERROR(stop.status());
    std::unique_ptr<EpochTiles> tiles(new EpochTiles(core, core.snapshots().PinCurrent(), range));
    bool found = false;
    STRATA_RETURN_IF_ERROR(reader->Snapshot([&]() -> absl::Status {
      STRATA_ASSIGN_OR_RETURN(found, tiles->Read(*reader, epoch, stop));
      return absl::OkStatus();
    }));
    if (found) return tiles;
  }
}

absl::StatusOr<bool> EpochTiles::Read(StorageReader& reader,
                                      std::uint64_t epoch,
                                      const Stop& stop) {
  STRATA_RETURN_IF_ERROR(CheckEpochKept(reader, epoch));
  STRATA_ASSIGN_OR_RETURN(const MapClock clock, reader.GetClock());
  if (clock.tile_version != view().tile_version || clock.epoch != view().epoch) {
    STRATA_RETURN_IF_ERROR(core_.snapshots().AwaitPublished(clock.tile_version, stop));
    return false;
  }
  ScanQuery integrated;
  integrated.state = ScanState::kIntegrated;
  absl::btree_map<ScanNumber, Pose> now;
  STRATA_RETURN_IF_ERROR(
      ForEachPosedScan(reader, integrated, clock.epoch, [&](const PosedScan& posed) {
        now[posed.scan.number] = posed.pose->T_map_scan;
      }));
  STRATA_RETURN_IF_ERROR(ForEachPosedScan(reader, integrated, epoch, [&](PosedScan posed) {
    const Pose T_map_scan = posed.pose->T_map_scan;
    scans_.push_back({std::move(posed.scan), T_map_scan});
  }));
  STRATA_RETURN_IF_ERROR(FindTiles(reader, now, stop));
  return true;
}

absl::Status EpochTiles::FindTiles(StorageReader& reader,
                                   const absl::btree_map<ScanNumber, Pose>& now,
                                   const Stop& stop) {
  const MapParameters parameters = core_.info().parameters;
  ScanSource source(reader, parameters);
  absl::btree_set<TileKey> changed;
  absl::btree_set<ScanNumber> before;
  for (std::size_t i = 0; i < scans_.size(); ++i) {
    STRATA_RETURN_IF_ERROR(stop.status());
    const PlacedScanRecord& placed = scans_[i];
    const ScanNumber number = placed.scan.number;
    before.insert(number);
    STRATA_ASSIGN_OR_RETURN(std::vector<TileKey> keys, reader.TilesOfScan(number));
    if (const auto it = now.find(number);
        it == now.end() || !SamePose(it->second, placed.T_map_scan)) {
      changed.insert(keys.begin(), keys.end());
      keys.clear();
      if (!MayTouch(placed, range_, parameters.mls.cell_size_m)) continue;
      const absl::StatusOr<MlsMap> made = source.Contribution(placed.scan, placed.T_map_scan);
      if (!made.ok()) {
        return Annotate(made.status(), absl::StrCat("scan ", placed.scan.header.id.ToString()));
      }
      keys = TilesOf(*made);
      changed.insert(keys.begin(), keys.end());
    }
    for (const TileKey& key : keys) {
      if (Near(key)) scans_of_tile_[key].push_back(i);
    }
  }
  for (const auto& [number, T_map_scan] : now) {
    if (before.contains(number)) continue;
    STRATA_ASSIGN_OR_RETURN(const std::vector<TileKey> keys, reader.TilesOfScan(number));
    changed.insert(keys.begin(), keys.end());
  }
  // What a tile says of a surface depends on the tiles around it.
  for (const TileKey& key : WithNeighbours(changed)) {
    if (key.x >= range_.x_min && key.x < range_.x_max && key.y >= range_.y_min &&
        key.y < range_.y_max) {
      differing_.insert(key);
    }
  }
  return absl::OkStatus();
}

bool EpochTiles::Near(const TileKey& key) const {
  return key.x >= range_.x_min - 1 && key.x <= range_.x_max && key.y >= range_.y_min - 1 &&
         key.y <= range_.y_max;
}

absl::StatusOr<SurfaceTileMaker::Rows> EpochTiles::Make(const absl::btree_set<TileKey>& keys,
                                                        const Stop& stop) const {
  const absl::btree_set<TileKey> around = WithNeighbours(keys);
  absl::btree_set<std::size_t> indices;
  for (const TileKey& key : around) {
    const auto it = scans_of_tile_.find(key);
    if (it != scans_of_tile_.end()) indices.insert(it->second.begin(), it->second.end());
  }
  std::vector<PlacedScanRecord> scans;
  scans.reserve(indices.size());
  for (const std::size_t i : indices) scans.push_back(scans_[i]);
  const absl::StatusOr<MlsTileMap> made = MakeTiles(core_, scans, around, 1, stop);
  if (!made.ok()) return Explain(made.status(), scans);
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core_.Reader());
  MlsTileStore store(core_);  // not asked: every tile around is among those made
  SurfaceTileMaker maker(core_,
                         *reader,
                         store,
                         *made,
                         {.version = 0,
                          .read_at = view().tile_version,
                          .threads = 1,
                          .profile = core_.info().parameters.default_profile});
  return maker.MakeBase(keys, stop);
}

absl::Status EpochTiles::Explain(const absl::Status& status,
                                 const std::vector<PlacedScanRecord>& scans) const {
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core_.Reader());
  for (const PlacedScanRecord& placed : scans) {
    if (!absl::IsNotFound(reader->GetScan(placed.scan.number, view().epoch).status())) continue;
    return absl::AbortedError(absl::StrCat(
        "scan ", placed.scan.header.id.ToString(), " was deleted meanwhile; ask again"));
  }
  return status;
}

}  // namespace strata
