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

#include "core/codec/blob.h"
#include "core/codec/surface_tile_codec.h"
#include "core/common/map_owner.h"
#include "core/common/status.h"
#include "core/engine/doors/map_reading.h"
#include "core/engine/tiles/epoch_tiles.h"
#include "core/engine/tiles/served_tiles.h"
#include "core/engine/tiles/surface_tiles.h"
#include "core/engine/tiles/tile_check.h"

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

absl::Status NothingThere(const TileKey& key) {
  return absl::NotFoundError(absl::StrCat("tile ", key.ToString(), ": nothing is mapped there"));
}

// Of a map that another engine has, on one state of its store: a row with its bytes; without them
// where those are damaged.
absl::StatusOr<SurfaceTileRow> ReadStored(StorageReader& reader,
                                          const TileKey& key,
                                          const MapClock& clock) {
  STRATA_ASSIGN_OR_RETURN(std::optional<SurfaceTileRow> row,
                          reader.FindSurfaceTile(key, clock.tile_version));
  if (!row.has_value()) return NothingThere(key);
  const absl::Status intact =
      OpenBlob(BlobKind::kSurfaceTile, kSurfaceTileVersion, row->bytes).status();
  if (!intact.ok()) row->bytes.clear();
  return *std::move(row);
}

absl::StatusOr<api::EncodedTile> GetStored(const MapReading& map, const TileKey& key) {
  api::EncodedTile tile{key, 0, 0, ""};
  STRATA_RETURN_IF_ERROR(
      map.ReadTiles([&](StorageReader& reader, const MapClock& clock) -> absl::Status {
        STRATA_ASSIGN_OR_RETURN(SurfaceTileRow row, ReadStored(reader, key, clock));
        if (row.bytes.empty()) return DamagedTile(key, absl::DataLossError("its bytes"));
        tile = {key, row.version, clock.epoch, std::move(row.bytes)};
        return absl::OkStatus();
      }));
  return tile;
}

// Earlier epochs are made by the engine that has the map.
absl::Status VisitStored(
    const MapReading& map,
    const api::TileArea& area,
    const Stop& stop,
    absl::FunctionRef<absl::Status(StorageReader&, const SurfaceTileRow&, const MapClock&)> visit) {
  return map.ReadTiles([&](StorageReader& reader, const MapClock& clock) -> absl::Status {
    if (area.epoch != 0 && area.epoch != clock.epoch) return map.elsewhere();
    STRATA_ASSIGN_OR_RETURN(const std::vector<SurfaceTileRow> rows,
                            reader.ListSurfaceTiles(ToRange(area), clock.tile_version));
    for (const SurfaceTileRow& row : rows) {
      STRATA_RETURN_IF_ERROR(stop.status());
      STRATA_RETURN_IF_ERROR(visit(reader, row, clock));
    }
    return absl::OkStatus();
  });
}

// The database keeps the state that is read until the last tile is taken, and cuts off whoever
// takes none for too long.
absl::StatusOr<std::uint64_t> FetchStored(
    const MapReading& map,
    const api::TileArea& area,
    const Stop& stop,
    HeldVersions& versions,
    absl::FunctionRef<absl::Status(const api::TileUpdate&)> sink) {
  std::uint64_t epoch = 0;
  const auto send =
      [&](StorageReader& reader, const SurfaceTileRow& row, const MapClock& clock) -> absl::Status {
    epoch = clock.epoch;
    const std::optional<Kind> kind = TakeKind(row, versions);
    if (!kind.has_value()) return absl::OkStatus();
    STRATA_ASSIGN_OR_RETURN(SurfaceTileRow stored, ReadStored(reader, row.key, clock));
    const bool damaged = stored.bytes.empty();
    return sink(
        {damaged ? Kind::kDamaged : *kind, {row.key, row.version, epoch, std::move(stored.bytes)}});
  };
  STRATA_RETURN_IF_ERROR(VisitStored(map, area, stop, send));
  return epoch;
}

absl::Status SendGone(const HeldVersions& versions,
                      std::uint64_t epoch,
                      const Stop& stop,
                      absl::FunctionRef<absl::Status(const api::TileUpdate&)> sink) {
  for (const auto& [key, version] : versions) {
    STRATA_RETURN_IF_ERROR(stop.status());
    STRATA_RETURN_IF_ERROR(sink({Kind::kGone, {key, 0, epoch, ""}}));
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<api::EncodedTile> EngineTiles::Get(const api::Call& call,
                                                  absl::string_view map,
                                                  const TileKey& key) {
  STRATA_RETURN_IF_ERROR(CheckLevel(key.level));
  STRATA_ASSIGN_OR_RETURN(const MapReading reading, maps_.FindTilesToRead(call, map));
  Map* const found = reading.map();
  if (found == nullptr) return GetStored(reading, key);
  const Snapshots::Pin pin = found->core().snapshots().PinCurrent();
  STRATA_ASSIGN_OR_RETURN(const ServedTiles::Handle tile, found->tiles().Find(key, pin.view()));
  if (tile == nullptr) return NothingThere(key);
  return api::EncodedTile{key, tile->version, pin.view().epoch, tile->bytes};
}

absl::StatusOr<std::optional<api::EncodedTile>> EngineTiles::GetAtHand(const api::Call& call,
                                                                       absl::string_view map,
                                                                       const TileKey& key) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  const absl::StatusOr<std::shared_ptr<Map>> there = maps_.Find(call.stop, map);
  if (MapOwnerOf(there.status()).has_value()) return std::nullopt;  // the store has it
  STRATA_RETURN_IF_ERROR(there.status());
  const std::shared_ptr<Map>& found = *there;
  const Snapshots::Pin pin = found->core().snapshots().PinCurrent();
  const ServedTiles::Handle tile = found->tiles().FindAtHand(key, pin.view());
  if (tile == nullptr) return std::nullopt;
  return api::EncodedTile{key, tile->version, pin.view().epoch, tile->bytes};
}

absl::StatusOr<std::vector<api::TileInfo>> EngineTiles::List(const api::Call& call,
                                                             absl::string_view map,
                                                             const api::TileArea& area) {
  STRATA_RETURN_IF_ERROR(CheckLevel(area.level));
  STRATA_ASSIGN_OR_RETURN(const MapReading found, maps_.FindTilesToRead(call, map));
  std::vector<api::TileInfo> infos;
  const auto take = [&](const SurfaceTileRow& row, const MapView&) {
    infos.push_back({row.key, row.version, row.size_bytes, row.patches});
    return absl::OkStatus();
  };
  if (found.map() != nullptr) {
    STRATA_RETURN_IF_ERROR(VisitTiles(*found.map(), area, call.stop, take).status());
  } else {
    const absl::Status visited = VisitStored(
        found, area, call.stop, [&](StorageReader&, const SurfaceTileRow& row, const MapClock&) {
          return take(row, MapView());
        });
    STRATA_RETURN_IF_ERROR(maps_.Refusal(map, visited));
  }
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
  STRATA_ASSIGN_OR_RETURN(const MapReading found, maps_.FindTilesToRead(call, map));
  HeldVersions versions;
  for (const api::HeldTile& tile : held) {
    if (Contains(area, tile.key)) versions[tile.key] = tile.version;
  }
  if (found.map() == nullptr) {
    const absl::StatusOr<std::uint64_t> epoch = FetchStored(found, area, call.stop, versions, sink);
    STRATA_RETURN_IF_ERROR(maps_.Refusal(map, epoch.status()));
    return SendGone(versions, *epoch, call.stop, sink);
  }
  const auto send = [&](const SurfaceTileRow& row, const MapView& view) -> absl::Status {
    const std::optional<Kind> kind = TakeKind(row, versions);
    if (!kind.has_value()) return absl::OkStatus();
    STRATA_ASSIGN_OR_RETURN(const api::TileUpdate update, UpdateOf(*found.map(), row, *kind, view));
    return sink(update);
  };
  STRATA_ASSIGN_OR_RETURN(const std::uint64_t epoch,
                          VisitTiles(*found.map(), area, call.stop, send));
  return SendGone(versions, epoch, call.stop, sink);
}

}  // namespace strata
