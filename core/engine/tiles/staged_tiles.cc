#include "core/engine/tiles/staged_tiles.h"

#include <cstdint>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/common/guarded.h"
#include "core/common/status.h"

namespace strata {

StagedTiles::~StagedTiles() {
  const absl::Status clean = Guarded([this] {
    if (published_) return absl::OkStatus();
    return core_.writer().Run(Durability::kRelaxed, 0, Stop(), [](StorageWriter& writer) {
      return writer.DiscardUnpublished();
    });
  });
  core_.set_tiles_staged(!clean.ok());
}

absl::Status StagedTiles::Put(const MlsTileMap& tiles, const SurfaceTileMaker::Rows& surfaces) {
  const double cell_size_m = core_.info().parameters.mls.cell_size_m;
  std::vector<MlsTileRow> rows;
  for (const auto& [key, tile] : tiles) {
    changed_.insert(key);
    if (tile == nullptr) {
      gone_.insert(key);
    } else {
      STRATA_ASSIGN_OR_RETURN(MlsTileRow row, MakeMlsTileRow(*tile, version_, cell_size_m));
      rows.push_back(std::move(row));
    }
  }
  for (const SurfaceTileRow& row : surfaces) served_.insert(row.key);
  const std::vector<api::TileChangeNotice> notices = NoticesOf(surfaces);
  notices_.insert(notices_.end(), notices.begin(), notices.end());
  if (rows.empty() && surfaces.empty()) return absl::OkStatus();
  return core_.writer().Run(
      Durability::kRelaxed, 0, Stop(), [&](StorageWriter& writer) -> absl::Status {
        for (const MlsTileRow& row : rows) STRATA_RETURN_IF_ERROR(writer.PutMlsTile(row));
        for (const SurfaceTileRow& row : surfaces) {
          STRATA_RETURN_IF_ERROR(writer.PutSurfaceTile(row));
        }
        return absl::OkStatus();
      });
}

absl::Status StagedTiles::RetireOld(StorageWriter& writer, std::uint64_t floor) const {
  for (const TileKey& key : changed_) {
    STRATA_RETURN_IF_ERROR(gone_.contains(key) ? writer.DeleteMlsTile(key)
                                               : writer.DeleteOlderMlsTiles(key, version_));
  }
  for (const TileKey& key : served_) {
    STRATA_RETURN_IF_ERROR(writer.CollectSurfaceTile(key, floor));
  }
  return absl::OkStatus();
}

absl::Status StagedTiles::Publish(const std::vector<ScanId>& scans,
                                  absl::FunctionRef<absl::Status(StorageWriter&)> decision) {
  const std::uint64_t floor = core_.snapshots().Floor();
  STRATA_RETURN_IF_ERROR(
      core_.Publish(scans, notices_, true, [&](StorageWriter& writer) -> absl::Status {
        STRATA_RETURN_IF_ERROR(RetireOld(writer, floor));
        STRATA_RETURN_IF_ERROR(writer.PublishTiles(version_, true));
        return decision(writer);
      }));
  published_ = true;
  return absl::OkStatus();
}

}  // namespace strata
