// All served tiles of a map, from level 0 up.
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "absl/container/btree_map.h"
#include "absl/container/btree_set.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/common/status.h"
#include "core/engine/tiles/surface_tiles.h"
#include "core/mls/overview.h"

namespace strata {
namespace {

// A square of tiles, so that a scan is read, and a border shared, by few blocks. A power of two.
constexpr std::int32_t kBlockShift = 3;

// The tiles `keys` of one level, block by block.
absl::Status MakeLevel(SurfaceTileMaker& maker,
                       int level,
                       const absl::btree_set<TileKey>& keys,
                       const Stop& stop,
                       absl::FunctionRef<absl::Status(double)> progress,
                       absl::FunctionRef<absl::Status(SurfaceTileMaker::Rows)> sink) {
  const std::vector<absl::btree_set<TileKey>> blocks = TileBlocks(keys);
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const double within = static_cast<double>(i) / static_cast<double>(blocks.size());
    // Every level has about a quarter of the tiles of the one below.
    STRATA_RETURN_IF_ERROR(progress(level == 0 ? 0.75 * within : 0.75 + 0.02 * level));
    STRATA_ASSIGN_OR_RETURN(
        SurfaceTileMaker::Rows rows,
        level == 0 ? maker.MakeBase(blocks[i], stop) : maker.MakeOverviews(blocks[i], stop));
    STRATA_RETURN_IF_ERROR(sink(std::move(rows)));
    maker.ForgetRows();
  }
  return absl::OkStatus();
}

}  // namespace

std::vector<absl::btree_set<TileKey>> TileBlocks(const absl::btree_set<TileKey>& keys) {
  absl::btree_map<TileKey, absl::btree_set<TileKey>> blocks;
  for (const TileKey& key : keys) {
    blocks[{key.level, key.x >> kBlockShift, key.y >> kBlockShift}].insert(key);
  }
  std::vector<absl::btree_set<TileKey>> list;
  list.reserve(blocks.size());
  for (auto& [corner, block] : blocks) list.push_back(std::move(block));
  return list;
}

std::vector<api::TileChangeNotice> NoticesOf(const std::vector<SurfaceTileRow>& rows) {
  std::vector<api::TileChangeNotice> notices;
  for (const SurfaceTileRow& row : rows) {
    if (row.key.level == 0) notices.push_back({row.key, row.version, row.gone});
  }
  return notices;
}

absl::Status MakeChangedSurfaces(SurfaceTileMaker& maker,
                                 absl::btree_set<TileKey> keys,
                                 const Stop& stop,
                                 absl::FunctionRef<absl::Status(double)> progress,
                                 absl::FunctionRef<absl::Status(SurfaceTileMaker::Rows)> sink) {
  for (int level = 0; level <= kMaxLevel && !keys.empty(); ++level) {
    absl::btree_set<TileKey> parents;
    const auto store = [&](SurfaceTileMaker::Rows rows) {
      for (const SurfaceTileRow& row : rows) {
        if (level < kMaxLevel) parents.insert(ParentOf(row.key));
      }
      return sink(std::move(rows));
    };
    STRATA_RETURN_IF_ERROR(MakeLevel(maker, level, keys, stop, progress, store));
    keys = std::move(parents);
  }
  return absl::OkStatus();
}

absl::Status MakeAllSurfaces(SurfaceTileMaker& maker,
                             StorageReader& reader,
                             absl::btree_set<TileKey> keys,
                             const Stop& stop,
                             absl::FunctionRef<absl::Status(double)> progress,
                             absl::FunctionRef<absl::Status(SurfaceTileMaker::Rows)> sink) {
  for (int level = 0; level <= kMaxLevel; ++level) {
    TileRange range;
    range.level = level;
    STRATA_ASSIGN_OR_RETURN(const std::vector<SurfaceTileRow> stored,
                            reader.ListSurfaceTiles(range, maker.version()));
    for (const SurfaceTileRow& row : stored) keys.insert(row.key);
    STRATA_RETURN_IF_ERROR(MakeLevel(maker, level, keys, stop, progress, sink));
    if (level == kMaxLevel) break;
    absl::btree_set<TileKey> parents;
    for (const TileKey& key : keys) parents.insert(ParentOf(key));
    keys = std::move(parents);
  }
  return absl::OkStatus();
}

}  // namespace strata
