#include "core/engine/doors/tiles.h"

#include <algorithm>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

#include "core/common/status.h"
#include "core/engine/tiles/epoch_tiles.h"
#include "core/engine/tiles/served_tiles.h"
#include "core/engine/tiles/surface_tiles.h"

namespace strata {
namespace {

absl::Status CheckLevel(std::int32_t level) {
  if (level >= 0 && level <= kMaxLevel) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("level ", level, " is not in [0, ", kMaxLevel, "]"));
}

TileRange ToRange(const api::TileArea& area) {
  return {area.level, area.x_min, area.x_max, area.y_min, area.y_max};
}

bool Contains(const api::TileArea& area, const TileKey& key) {
  return key.level == area.level && key.x >= area.x_min && key.x < area.x_max &&
         key.y >= area.y_min && key.y < area.y_max;
}

using Kind = api::TileUpdate::Kind;
using HeldVersions = std::map<TileKey, std::uint64_t>;

absl::StatusOr<std::vector<SurfaceTileRow>> ListRows(Map& map,
                                                     const api::TileArea& area,
                                                     const MapView& view) {
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, map.core().Reader());
  return reader->ListSurfaceTiles(ToRange(area), view.tile_version);
}

// What the tile is to one who holds `held`; nullopt if nothing new. Takes it out of `held`, where
// at last those remain that are gone.
std::optional<Kind> TakeKind(const SurfaceTileRow& row, HeldVersions& held) {
  const auto known = held.find(row.key);
  if (known == held.end()) return Kind::kNew;
  const bool same = known->second == row.version && row.version != 0;
  held.erase(known);
  return same ? std::nullopt : std::optional(Kind::kChanged);
}

// The tile of `row`, with its bytes or as stored, to one who lacks it.
absl::StatusOr<api::TileUpdate> UpdateOf(Map& map,
                                         const SurfaceTileRow& row,
                                         Kind kind,
                                         const MapView& view) {
  if (!row.bytes.empty())
    return api::TileUpdate{kind, {row.key, row.version, view.epoch, row.bytes}};
  const absl::StatusOr<ServedTiles::Handle> tile = map.tiles().Find(row.key, view);
  if (tile.ok() && *tile != nullptr) {
    return api::TileUpdate{kind, {row.key, (*tile)->version, view.epoch, (*tile)->bytes}};
  }
  if (!tile.ok() && !absl::IsDataLoss(tile.status())) return tile.status();
  return api::TileUpdate{Kind::kDamaged, {row.key, row.version, view.epoch, ""}};
}

// Visits the rows of an area, stored ones without their bytes, those that are made with them;
// returns the epoch.
using Visit = absl::FunctionRef<absl::Status(const SurfaceTileRow& row, const MapView& view)>;

absl::StatusOr<std::uint64_t> VisitEarlier(Map& map,
                                           const api::TileArea& area,
                                           const Stop& stop,
                                           Visit visit) {
  if (area.level != 0) {
    return absl::InvalidArgumentError(absl::StrCat(
        "level ", area.level, ": epoch ", area.epoch, " is not the current one and has level 0"));
  }
  STRATA_ASSIGN_OR_RETURN(const std::unique_ptr<EpochTiles> tiles,
                          EpochTiles::Find(map.core(), area.epoch, ToRange(area), stop));
  const MapView view{area.epoch, tiles->view().tile_version};
  std::map<TileKey, SurfaceTileRow> stored;
  STRATA_ASSIGN_OR_RETURN(std::vector<SurfaceTileRow> rows, ListRows(map, area, view));
  for (SurfaceTileRow& row : rows) {
    STRATA_RETURN_IF_ERROR(stop.status());
    if (tiles->differing().contains(row.key)) {
      stored[row.key] = std::move(row);
    } else {
      STRATA_RETURN_IF_ERROR(visit(row, view));
    }
  }
  for (const absl::btree_set<TileKey>& block : TileBlocks(tiles->differing())) {
    STRATA_ASSIGN_OR_RETURN(const SurfaceTileMaker::Rows made, tiles->Make(block, stop));
    for (const SurfaceTileRow& row : made) {
      stored.erase(row.key);
      if (!row.gone) STRATA_RETURN_IF_ERROR(visit(row, view));
    }
  }
  for (const auto& [key, row] : stored) STRATA_RETURN_IF_ERROR(visit(row, view));
  return area.epoch;
}

absl::StatusOr<std::uint64_t> VisitTiles(Map& map,
                                         const api::TileArea& area,
                                         const Stop& stop,
                                         Visit visit) {
  const Snapshots::Pin pin = map.core().snapshots().PinCurrent();
  if (area.epoch != 0 && area.epoch != pin.view().epoch)
    return VisitEarlier(map, area, stop, visit);
  STRATA_ASSIGN_OR_RETURN(const std::vector<SurfaceTileRow> rows, ListRows(map, area, pin.view()));
  for (const SurfaceTileRow& row : rows) {
    STRATA_RETURN_IF_ERROR(stop.status());
    STRATA_RETURN_IF_ERROR(visit(row, pin.view()));
  }
  return pin.view().epoch;
}

}  // namespace

absl::StatusOr<api::EncodedTile> EngineTiles::Get(const api::Call& call,
                                                  absl::string_view map,
                                                  const TileKey& key) {
  STRATA_RETURN_IF_ERROR(CheckLevel(key.level));
  STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<Map> found, maps_.FindWithTiles(call, map));
  const Snapshots::Pin pin = found->core().snapshots().PinCurrent();
  STRATA_ASSIGN_OR_RETURN(const ServedTiles::Handle tile, found->tiles().Find(key, pin.view()));
  if (tile == nullptr) {
    return absl::NotFoundError(absl::StrCat("tile ", key.ToString(), ": nothing is mapped there"));
  }
  return api::EncodedTile{key, tile->version, pin.view().epoch, tile->bytes};
}

absl::StatusOr<std::optional<api::EncodedTile>> EngineTiles::GetAtHand(const api::Call& call,
                                                                       absl::string_view map,
                                                                       const TileKey& key) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<Map> found, maps_.Find(call.stop, map));
  const Snapshots::Pin pin = found->core().snapshots().PinCurrent();
  const ServedTiles::Handle tile = found->tiles().FindAtHand(key, pin.view());
  if (tile == nullptr) return std::nullopt;
  return api::EncodedTile{key, tile->version, pin.view().epoch, tile->bytes};
}

absl::StatusOr<std::vector<api::TileInfo>> EngineTiles::List(const api::Call& call,
                                                             absl::string_view map,
                                                             const api::TileArea& area) {
  STRATA_RETURN_IF_ERROR(CheckLevel(area.level));
  STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<Map> found, maps_.FindWithTiles(call, map));
  std::vector<api::TileInfo> infos;
  const auto take = [&](const SurfaceTileRow& row, const MapView&) {
    infos.push_back({row.key, row.version, row.size_bytes, row.patches});
    return absl::OkStatus();
  };
  STRATA_RETURN_IF_ERROR(VisitTiles(*found, area, call.stop, take).status());
  std::sort(infos.begin(), infos.end(), [](const api::TileInfo& a, const api::TileInfo& b) {
    return a.key < b.key;
  });
  return infos;
}

absl::Status EngineTiles::Fetch(const api::Call& call,
                                absl::string_view map,
                                const api::TileArea& area,
                                const std::vector<api::HeldTile>& held,
                                absl::FunctionRef<absl::Status(const api::TileUpdate&)> sink) {
  STRATA_RETURN_IF_ERROR(CheckLevel(area.level));
  STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<Map> found, maps_.FindWithTiles(call, map));
  HeldVersions versions;
  for (const api::HeldTile& tile : held) {
    if (Contains(area, tile.key)) versions[tile.key] = tile.version;
  }
  const auto send = [&](const SurfaceTileRow& row, const MapView& view) -> absl::Status {
    const std::optional<Kind> kind = TakeKind(row, versions);
    if (!kind.has_value()) return absl::OkStatus();
    STRATA_ASSIGN_OR_RETURN(const api::TileUpdate update, UpdateOf(*found, row, *kind, view));
    return sink(update);
  };
  STRATA_ASSIGN_OR_RETURN(const std::uint64_t epoch, VisitTiles(*found, area, call.stop, send));
  for (const auto& [key, version] : versions) {
    STRATA_RETURN_IF_ERROR(call.stop.status());
    STRATA_RETURN_IF_ERROR(sink({Kind::kGone, {key, 0, epoch, ""}}));
  }
  return absl::OkStatus();
}

}  // namespace strata
