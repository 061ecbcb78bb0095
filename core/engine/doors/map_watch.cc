#include "core/engine/doors/map_watch.h"

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"

#include "core/common/status.h"
#include "core/engine/map/change_log.h"
#include "core/engine/map/scan_lookup.h"

namespace strata {
namespace {

void AddScan(const PosedScan& posed, api::MapUpdate& update) {
  const ScanHeader& header = posed.scan.header;
  update.scans.push_back(
      {.id = header.id,
       .state = posed.scan.state,
       .T_map_scan = posed.pose.has_value() ? posed.pose->T_map_scan : header.T_map_scan});
}

}  // namespace

absl::StatusOr<std::optional<api::MapUpdate>> MapWatcher::Next(const MapState& state) {
  const ChangeSet& changes = state.changes();
  if (!first_ && changes.last == since_) return std::optional<api::MapUpdate>();
  api::MapUpdate update;
  update.commit_sequence = changes.last;
  update.epoch = state.view().epoch;
  update.whole = since_ == 0 || !changes.complete;
  update.inferred = !update.whole && changes.inferred > since_;
  const bool same = changes.scans.empty() && changes.tiles.empty() && since_ <= changes.last &&
                    (epoch_ == 0 || epoch_ == update.epoch);
  if (!same || !changes.complete) {  // a thousand idle watchers ask ten times a second
    STRATA_RETURN_IF_ERROR(
        state.Snapshot([&](StorageReader& reader) { return Fill(reader, state, update); }));
  }
  since_ = update.commit_sequence;
  epoch_ = update.epoch;
  first_ = false;
  return std::optional<api::MapUpdate>(std::move(update));
}

api::MapUpdate MapWatcher::Nothing() const {
  api::MapUpdate update;
  update.commit_sequence = since_;
  update.epoch = epoch_;
  return update;
}

absl::Status MapWatcher::Fill(StorageReader& reader,
                              const MapState& state,
                              api::MapUpdate& update) const {
  STRATA_RETURN_IF_ERROR(CheckSince(reader, update));
  if (epoch_ != 0 && epoch_ != update.epoch) {
    STRATA_ASSIGN_OR_RETURN(const std::optional<EpochInfo> info, reader.FindEpoch(update.epoch));
    if (info.has_value()) update.epoch_reason = info->reason;
  }
  if (update.whole) return AddEverything(reader, state, update);
  for (const ScanId& id : state.changes().scans) {
    if (!Wanted(id)) continue;
    STRATA_ASSIGN_OR_RETURN(const std::optional<PosedScan> posed,
                            reader.FindScan(id, update.epoch));
    if (posed.has_value()) {
      AddScan(*posed, update);
    } else {
      update.scans.push_back({.id = id, .gone = true});
    }
  }
  if (!options_.tiles) return absl::OkStatus();
  for (const auto& [key, tile] : state.changes().tiles) update.tiles.push_back(tile);
  return absl::OkStatus();
}

// A commit that no watcher was told of yet may be resumed from; one that the map has not come to is
// of another map of that name.
absl::Status MapWatcher::CheckSince(StorageReader& reader, api::MapUpdate& update) const {
  if (since_ <= update.commit_sequence) return absl::OkStatus();
  STRATA_ASSIGN_OR_RETURN(const MapClock clock, reader.GetClock());
  if (since_ > clock.commit_sequence) {
    update.whole = true;
  } else {
    update.commit_sequence = since_;
  }
  return absl::OkStatus();
}

absl::Status MapWatcher::AddEverything(StorageReader& reader,
                                       const MapState& state,
                                       api::MapUpdate& update) const {
  ScanQuery query;
  query.skip_damaged = true;
  if (!options_.trajectory.empty()) query.trajectory = options_.trajectory;
  STRATA_RETURN_IF_ERROR(ForEachScan(
      reader, query, update.epoch, [&](const PosedScan& posed) { AddScan(posed, update); }));
  if (!options_.tiles) return absl::OkStatus();
  STRATA_ASSIGN_OR_RETURN(const std::vector<SurfaceTileRow> tiles,
                          reader.ListSurfaceTiles(TileRange(), state.view().tile_version));
  for (const SurfaceTileRow& tile : tiles) update.tiles.push_back({tile.key, tile.version});
  return absl::OkStatus();
}

}  // namespace strata
