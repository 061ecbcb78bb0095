#include "core/engine/tiles/surface_tiles.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/container/btree_set.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/codec/occupancy.h"
#include "core/codec/surface_tile_codec.h"
#include "core/common/status.h"
#include "core/engine/map/parallel.h"
#include "core/mls/overview.h"
#include "core/mls/traversability.h"
#include "core/world/robot_limits.h"

namespace strata {

absl::btree_set<TileKey> WithNeighbours(const absl::btree_set<TileKey>& keys) {
  absl::btree_set<TileKey> all;
  for (const TileKey& key : keys) {
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) all.insert({key.level, key.x + dx, key.y + dy});
    }
  }
  return all;
}

SurfaceTileMaker::SurfaceTileMaker(MapCore& core,
                                   StorageReader& reader,
                                   MlsTileStore& store,
                                   const MlsTileMap& changed,
                                   const Options& options)
    : reader_(reader),
      store_(store),
      changed_(changed),
      options_(options),
      parameters_(core.info().parameters) {}

absl::StatusOr<MlsTilePtr> SurfaceTileMaker::LoadMls(const TileKey& key) {
  const auto it = changed_.find(key);
  if (it != changed_.end()) return it->second;
  return store_.Load(reader_, key, options_.read_at);
}

absl::StatusOr<SurfaceTileMaker::SurfacePtr> SurfaceTileMaker::Plain(const TileKey& key) {
  const auto it = plain_.find(key);
  if (it != plain_.end()) return it->second;
  STRATA_ASSIGN_OR_RETURN(const MlsTilePtr tile, LoadMls(key));
  SurfacePtr surfaces;
  if (tile != nullptr) surfaces = std::make_shared<const SurfaceTile>(SurfacesOf(*tile));
  plain_[key] = surfaces;
  return surfaces;
}

SurfaceTile SurfaceTileMaker::Annotated(const TileKey& key) const {
  SurfaceTile tile;
  tile.key = key;
  const SurfacePtr& plain = plain_.at(key);
  if (plain == nullptr) return tile;
  tile = *plain;
  SurfaceNeighbourhood neighbours{};
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      const int place = (dy + 1) * 3 + dx + 1;
      neighbours[static_cast<std::size_t>(place)] = plain_.at({0, key.x + dx, key.y + dy}).get();
    }
  }
  AnnotateTraversability(tile, neighbours, parameters_.mls.cell_size_m, LimitsOf(options_.profile));
  return tile;
}

absl::StatusOr<std::optional<SurfaceTileRow>> SurfaceTileMaker::Differs(
    SurfaceTile tile, const std::optional<SurfaceTileRow>& stored) const {
  SurfaceTileRow row;
  row.key = tile.key;
  row.version = options_.version;
  if (tile.surfaces.empty()) {
    if (!stored.has_value()) return std::optional<SurfaceTileRow>();
    row.gone = true;
    return std::optional<SurfaceTileRow>(std::move(row));
  }
  if (stored.has_value()) {
    tile.version = stored->version;
    STRATA_ASSIGN_OR_RETURN(const std::string same, EncodeSurfaceTile(tile));
    if (same == stored->bytes) return std::optional<SurfaceTileRow>();
  }
  tile.version = options_.version;
  row.patches = tile.surfaces.size();
  STRATA_ASSIGN_OR_RETURN(row.bytes, EncodeSurfaceTile(tile));
  row.size_bytes = row.bytes.size();
  return std::optional<SurfaceTileRow>(std::move(row));
}

absl::StatusOr<SurfaceTileMaker::Rows> SurfaceTileMaker::MakeRows(
    const std::vector<TileKey>& keys,
    const Stop& stop,
    absl::FunctionRef<SurfaceTile(std::size_t)> make) {
  std::vector<std::optional<SurfaceTileRow>> stored(keys.size());
  for (std::size_t i = 0; i < keys.size(); ++i) {
    STRATA_ASSIGN_OR_RETURN(stored[i], reader_.FindSurfaceTile(keys[i], options_.read_at));
  }
  std::vector<std::optional<SurfaceTileRow>> differing(keys.size());
  const absl::Status done =
      ParallelFor(options_.threads, keys.size(), [&](int, std::size_t i) -> absl::Status {
        STRATA_RETURN_IF_ERROR(stop.status());
        STRATA_ASSIGN_OR_RETURN(differing[i], Differs(make(i), stored[i]));
        return absl::OkStatus();
      });
  STRATA_RETURN_IF_ERROR(done);
  Rows rows;
  for (std::optional<SurfaceTileRow>& row : differing) {
    if (!row.has_value()) continue;
    made_[row->key] = *row;
    rows.push_back(*std::move(row));
  }
  return rows;
}

absl::StatusOr<SurfaceTileMaker::Rows> SurfaceTileMaker::MakeBase(
    const absl::btree_set<TileKey>& keys, const Stop& stop) {
  for (const TileKey& key : WithNeighbours(keys)) {
    STRATA_RETURN_IF_ERROR(stop.status());
    STRATA_RETURN_IF_ERROR(Plain(key).status());
  }
  const std::vector<TileKey> list(keys.begin(), keys.end());
  absl::StatusOr<Rows> rows =
      MakeRows(list, stop, [&](std::size_t i) { return Annotated(list[i]); });
  plain_.clear();
  return rows;
}

absl::StatusOr<SurfaceTile> SurfaceTileMaker::Derive(const TileKey& key) {
  if (key.level == 0) {
    for (const TileKey& neighbour : WithNeighbours({key})) {
      STRATA_RETURN_IF_ERROR(Plain(neighbour).status());
    }
    return Annotated(key);
  }
  std::array<SurfacePtr, 4> held;
  std::array<const SurfaceTile*, 4> children{};
  for (int i = 0; i < 4; ++i) {
    STRATA_ASSIGN_OR_RETURN(held[static_cast<std::size_t>(i)], Served(ChildOf(key, i)));
    children[static_cast<std::size_t>(i)] = held[static_cast<std::size_t>(i)].get();
  }
  static_assert(kMaxOverviewSurfaces <= kMaxTilePatches);
  return MakeOverviewTile(key, children, parameters_.mls);
}

absl::StatusOr<SurfaceTileMaker::SurfacePtr> SurfaceTileMaker::Served(const TileKey& key) {
  std::string bytes;
  if (const auto it = made_.find(key); it != made_.end()) {
    if (it->second.gone) return SurfacePtr();
    bytes = it->second.bytes;
  } else {
    STRATA_ASSIGN_OR_RETURN(std::optional<SurfaceTileRow> row,
                            reader_.FindSurfaceTile(key, options_.read_at));
    if (!row.has_value()) return SurfacePtr();
    bytes = std::move(row->bytes);
  }
  absl::StatusOr<SurfaceTile> tile = DecodeSurfaceTile(bytes);
  if (tile.ok()) return std::make_shared<const SurfaceTile>(*std::move(tile));
  STRATA_ASSIGN_OR_RETURN(const SurfaceTile derived, Derive(key));
  STRATA_ASSIGN_OR_RETURN(bytes, EncodeSurfaceTile(derived));
  tile = DecodeSurfaceTile(bytes);
  if (!tile.ok()) return tile.status();
  return std::make_shared<const SurfaceTile>(*std::move(tile));
}

absl::StatusOr<SurfaceTileMaker::Rows> SurfaceTileMaker::MakeOverviews(
    const absl::btree_set<TileKey>& keys, const Stop& stop) {
  const std::vector<TileKey> list(keys.begin(), keys.end());
  std::vector<SurfaceTile> tiles;
  tiles.reserve(list.size());
  for (const TileKey& key : list) {
    STRATA_RETURN_IF_ERROR(stop.status());
    STRATA_ASSIGN_OR_RETURN(SurfaceTile tile, Derive(key));
    tiles.push_back(std::move(tile));
  }
  return MakeRows(list, stop, [&](std::size_t i) { return std::move(tiles[i]); });
}

absl::Status SurfaceTileMaker::MakePyramid(const Rows& base, Rows& rows, const Stop& stop) {
  absl::btree_set<TileKey> parents;
  for (const SurfaceTileRow& row : base) parents.insert(ParentOf(row.key));
  for (int level = 1; level <= kMaxLevel && !parents.empty(); ++level) {
    STRATA_ASSIGN_OR_RETURN(Rows made, MakeOverviews(parents, stop));
    parents.clear();
    for (SurfaceTileRow& row : made) {
      if (level < kMaxLevel) parents.insert(ParentOf(row.key));
      rows.push_back(std::move(row));
    }
  }
  return absl::OkStatus();
}

}  // namespace strata
