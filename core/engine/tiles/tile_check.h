// Stored tiles that are damaged: how that is said, and how they are found by themselves, without
// what they are made of.
#ifndef STRATA_CORE_ENGINE_TILES_TILE_CHECK_H_
#define STRATA_CORE_ENGINE_TILES_TILE_CHECK_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/engine/map/job_context.h"
#include "core/engine/map/map_core.h"
#include "core/engine/map/steady_view.h"
#include "core/mls/surface_tile.h"
#include "core/mls/tile_key.h"
#include "core/storage/records.h"

namespace strata {

// DATA_LOSS naming the tile, the cure and why it cannot be read.
absl::Status DamagedTile(const TileKey& key, const absl::Status& why);

// What FindSurfaceTile() gave for `key`; nullptr where there is none. DATA_LOSS as above.
absl::StatusOr<std::shared_ptr<const SurfaceTile>> DecodeStoredTile(
    const TileKey& key, const std::optional<SurfaceTileRow>& row);
// The stored tile as readers of `version` get it; nullptr where there is none. DATA_LOSS as above.
absl::StatusOr<std::shared_ptr<const SurfaceTile>> ReadSurfaceTile(MapCore& core,
                                                                   const TileKey& key,
                                                                   std::uint64_t version);

// Reads every tile of every level that `view` shows and calls `report` with each one that cannot
// be read. Returns how many were looked at; an error is one of the store or of the job being ended.
absl::StatusOr<std::uint64_t> CheckTilesAlone(const SteadyView& view,
                                              JobContext& context,
                                              absl::FunctionRef<void(const std::string&)> report);

// Reads all that is kept of prepared tiles, has what is damaged prepared anew, and sets metrics of
// both. DATA_LOSS where the store cannot list or read them.
absl::Status CheckKeptTiles(MapCore& core, const SteadyView& view, JobContext& context);

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_TILES_TILE_CHECK_H_
