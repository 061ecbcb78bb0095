// Served tiles out of tiles with statistics: annotated, encoded, and the levels of detail above.
#ifndef STRATA_CORE_ENGINE_TILES_SURFACE_TILES_H_
#define STRATA_CORE_ENGINE_TILES_SURFACE_TILES_H_

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "absl/container/btree_map.h"
#include "absl/container/btree_set.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/api/maps.h"
#include "core/common/stop.h"
#include "core/engine/tiles/mls_tiles.h"
#include "core/mls/surface_tile.h"
#include "core/mls/tile_key.h"
#include "core/storage/storage.h"
#include "core/world/map_info.h"
#include "core/world/robot_profile.h"

namespace strata {

// `keys` and their eight neighbours.
absl::btree_set<TileKey> WithNeighbours(const absl::btree_set<TileKey>& keys);

// Finds the served tiles that differ from the stored ones, all in version `version`. Writes
// nothing: the rows go to whoever wants to store or to report them. One thread at a time; uses
// `threads` inside, with the same bytes for any number.
class SurfaceTileMaker {
 public:
  struct Options {
    std::uint64_t version = 0;        // of the new rows
    std::uint64_t read_at = version;  // stored rows are read as of this version
    int threads = 1;
    RobotProfile profile;
  };
  using Rows = std::vector<SurfaceTileRow>;

  // All must outlive the maker. `changed`: tiles that differ from those in `store`, may be empty.
  SurfaceTileMaker(MapCore& core,
                   StorageReader& reader,
                   MlsTileStore& store,
                   const MlsTileMap& changed,
                   const Options& options);

  // Level 0 of `keys`: the rows that differ, by key.
  absl::StatusOr<Rows> MakeBase(const absl::btree_set<TileKey>& keys, const Stop& stop);
  // Level `level` > 0 of `keys`. Levels below must be done.
  absl::StatusOr<Rows> MakeOverviews(const absl::btree_set<TileKey>& keys, const Stop& stop);
  // Every level above the tiles `keys` of level 0, as far as changes reach. `rows` gets them.
  absl::Status MakePyramid(const Rows& base, Rows& rows, const Stop& stop);

  // Forgets rows made so far; call once they are stored or if they will never be.
  void ForgetRows() { made_.clear(); }
  std::uint64_t version() const { return options_.version; }

 private:
  using SurfacePtr = std::shared_ptr<const SurfaceTile>;

  absl::StatusOr<MlsTilePtr> LoadMls(const TileKey& key);
  // Not annotated; nullptr where there is nothing.
  absl::StatusOr<SurfacePtr> Plain(const TileKey& key);
  // As served, from rows made or stored; a damaged one is made again.
  absl::StatusOr<SurfacePtr> Served(const TileKey& key);
  absl::StatusOr<SurfaceTile> Derive(const TileKey& key);
  SurfaceTile Annotated(const TileKey& key) const;
  // nullopt: `tile` is what is stored.
  absl::StatusOr<std::optional<SurfaceTileRow>> Differs(
      SurfaceTile tile, const std::optional<SurfaceTileRow>& stored) const;
  absl::StatusOr<Rows> MakeRows(const std::vector<TileKey>& keys,
                                const Stop& stop,
                                absl::FunctionRef<SurfaceTile(std::size_t)> make);

  StorageReader& reader_;
  MlsTileStore& store_;
  const MlsTileMap& changed_;
  const Options options_;
  const MapParameters parameters_;
  absl::btree_map<TileKey, SurfacePtr> plain_;
  absl::btree_map<TileKey, SurfaceTileRow> made_;
};

// What watchers are told of rows of level 0.
std::vector<api::TileChangeNotice> NoticesOf(const std::vector<SurfaceTileRow>& rows);

// Groups keys of one level into squares of a few tiles: as much as is made at a time.
std::vector<absl::btree_set<TileKey>> TileBlocks(const absl::btree_set<TileKey>& keys);

// The level-0 tiles `keys` and every tile above that changes with them, block by block; the rest as
// MakeAllSurfaces.
absl::Status MakeChangedSurfaces(SurfaceTileMaker& maker,
                                 absl::btree_set<TileKey> keys,
                                 const Stop& stop,
                                 absl::FunctionRef<absl::Status(double)> progress,
                                 absl::FunctionRef<absl::Status(SurfaceTileMaker::Rows)> sink);

// All levels over the level-0 tiles `keys` and over whatever is stored, block by block. `progress`
// gets the share done and may end it; `sink` gets the rows that differ, and stores them at once or
// never.
absl::Status MakeAllSurfaces(SurfaceTileMaker& maker,
                             StorageReader& reader,
                             absl::btree_set<TileKey> keys,
                             const Stop& stop,
                             absl::FunctionRef<absl::Status(double)> progress,
                             absl::FunctionRef<absl::Status(SurfaceTileMaker::Rows)> sink);

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_TILES_SURFACE_TILES_H_
