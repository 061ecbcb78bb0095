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
  STRATA_ASSIGN_OR_RETURN(const std::vector<MlsTileRow> rows,
                          EncodeTileRows(tiles, version_, core_.info().parameters.mls.cell_size_m));
  keys_.Add(tiles, surfaces);
  const std::vector<api::TileChangeNotice> notices = NoticesOf(surfaces);
  notices_.insert(notices_.end(), notices.begin(), notices.end());
  if (rows.empty() && surfaces.empty()) return absl::OkStatus();
  return core_.writer().Run(Durability::kRelaxed, 0, Stop(), [&](StorageWriter& writer) {
    return PutTileRows(writer, rows, surfaces);
  });
}

absl::Status StagedTiles::PutRows(std::vector<MlsTileRow> rows) {
  if (rows.empty()) return absl::OkStatus();
  for (MlsTileRow& row : rows) {
    row.version = version_;
    keys_.tiles.insert(row.key);
  }
  return core_.writer().Run(Durability::kRelaxed, 0, Stop(), [&](StorageWriter& writer) {
    return PutTileRows(writer, rows, {});
  });
}

absl::Status StagedTiles::Publish(const std::vector<ScanId>& scans,
                                  absl::FunctionRef<absl::Status(StorageWriter&)> decision) {
  const std::uint64_t floor = core_.snapshots().Floor();
  STRATA_RETURN_IF_ERROR(
      core_.Publish(scans, notices_, true, [&](StorageWriter& writer) -> absl::Status {
        STRATA_RETURN_IF_ERROR(RetireTileRows(writer, keys_, version_, floor));
        STRATA_RETURN_IF_ERROR(writer.PublishTiles(version_, true));
        return decision(writer);
      }));
  published_ = true;
  return absl::OkStatus();
}

}  // namespace strata
