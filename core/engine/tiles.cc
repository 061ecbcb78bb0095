#include "core/engine/tiles.h"

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
#include "core/engine/served_tiles.h"

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
  const bool same = known->second == row.version;
  held.erase(known);
  return same ? std::nullopt : std::optional(Kind::kChanged);
}

// The tile of `row` to one who lacks it.
absl::StatusOr<api::TileUpdate> UpdateOf(Map& map,
                                         const SurfaceTileRow& row,
                                         Kind kind,
                                         const MapView& view) {
  const absl::StatusOr<ServedTiles::Handle> tile = map.tiles().Find(row.key, view);
  if (tile.ok() && *tile != nullptr) {
    return api::TileUpdate{kind, {row.key, (*tile)->version, view.epoch, (*tile)->bytes}};
  }
  if (!tile.ok() && !absl::IsDataLoss(tile.status())) return tile.status();
  return api::TileUpdate{Kind::kDamaged, {row.key, row.version, view.epoch, ""}};
}

}  // namespace

absl::StatusOr<api::EncodedTile> EngineTiles::Get(const api::Call& call,
                                                  absl::string_view map,
                                                  const TileKey& key) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_RETURN_IF_ERROR(CheckLevel(key.level));
  STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<Map> found, maps_.Find(map));
  const Snapshots::Pin pin = found->core().snapshots().PinCurrent();
  STRATA_ASSIGN_OR_RETURN(const ServedTiles::Handle tile, found->tiles().Find(key, pin.view()));
  if (tile == nullptr) {
    return absl::NotFoundError(absl::StrCat("tile ", key.ToString(), ": nothing is mapped there"));
  }
  return api::EncodedTile{key, tile->version, pin.view().epoch, tile->bytes};
}

absl::StatusOr<std::vector<api::TileInfo>> EngineTiles::List(const api::Call& call,
                                                             absl::string_view map,
                                                             const api::TileArea& area) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_RETURN_IF_ERROR(CheckLevel(area.level));
  STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<Map> found, maps_.Find(map));
  const Snapshots::Pin pin = found->core().snapshots().PinCurrent();
  STRATA_ASSIGN_OR_RETURN(const std::vector<SurfaceTileRow> rows,
                          ListRows(*found, area, pin.view()));
  std::vector<api::TileInfo> infos;
  infos.reserve(rows.size());
  for (const SurfaceTileRow& row : rows) {
    infos.push_back({row.key, row.version, row.size_bytes, row.patches});
  }
  return infos;
}

absl::Status EngineTiles::Fetch(const api::Call& call,
                                absl::string_view map,
                                const api::TileArea& area,
                                const std::vector<api::HeldTile>& held,
                                absl::FunctionRef<absl::Status(const api::TileUpdate&)> sink) {
  STRATA_RETURN_IF_ERROR(CheckLevel(area.level));
  STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<Map> found, maps_.Find(map));
  const Snapshots::Pin pin = found->core().snapshots().PinCurrent();
  HeldVersions versions;
  for (const api::HeldTile& tile : held) {
    if (Contains(area, tile.key)) versions[tile.key] = tile.version;
  }
  STRATA_ASSIGN_OR_RETURN(const std::vector<SurfaceTileRow> rows,
                          ListRows(*found, area, pin.view()));
  for (const SurfaceTileRow& row : rows) {
    STRATA_RETURN_IF_ERROR(call.stop.status());
    const std::optional<Kind> kind = TakeKind(row, versions);
    if (!kind.has_value()) continue;
    STRATA_ASSIGN_OR_RETURN(const api::TileUpdate update, UpdateOf(*found, row, *kind, pin.view()));
    STRATA_RETURN_IF_ERROR(sink(update));
  }
  for (const auto& [key, version] : versions) {
    STRATA_RETURN_IF_ERROR(call.stop.status());
    STRATA_RETURN_IF_ERROR(sink({Kind::kGone, {key, 0, pin.view().epoch, ""}}));
  }
  return absl::OkStatus();
}

}  // namespace strata
