// The derived tables.
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include <Eigen/Geometry>

#include "core/common/status.h"
#include "core/mls/tile_key.h"
#include "core/storage/sqlite/schema.h"
#include "core/storage/sqlite/sqlite_writer.h"

namespace strata {

absl::Status SqliteWriter::PutMlsTile(const MlsTileRow& row) {
  return RunSql(
      "INSERT OR REPLACE INTO derived_mls_tile (level, x, y, version, patches, cells, min_x, "
      "min_y, min_z, max_x, max_y, max_z, spread_weight, spread_sum, digest, bytes) VALUES "
      "(?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13, ?14, ?15, ?16)",
      row.key.level,
      row.key.x,
      row.key.y,
      row.version,
      row.patches,
      row.cells,
      row.box.min().x(),
      row.box.min().y(),
      row.box.min().z(),
      row.box.max().x(),
      row.box.max().y(),
      row.box.max().z(),
      row.spread_weight,
      row.spread_sum,
      row.digest,
      Blob{row.bytes});
}

absl::Status SqliteWriter::PutSurfaceTile(const SurfaceTileRow& row) {
  return RunSql(
      "INSERT OR REPLACE INTO derived_surface_tile (level, x, y, version, gone, patches, "
      "size_bytes, bytes) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8)",
      row.key.level,
      row.key.x,
      row.key.y,
      row.version,
      row.gone,
      row.patches,
      std::uint64_t{row.bytes.size()},
      Blob{row.bytes});
}

absl::Status SqliteWriter::DeleteMlsTile(const TileKey& key) {
  return RunSql("DELETE FROM derived_mls_tile WHERE level = ?1 AND x = ?2 AND y = ?3",
                key.level,
                key.x,
                key.y);
}

absl::Status SqliteWriter::DeleteOlderMlsTiles(const TileKey& key, std::uint64_t version) {
  return RunSql(
      "DELETE FROM derived_mls_tile WHERE level = ?1 AND x = ?2 AND y = ?3 AND version < ?4",
      key.level,
      key.x,
      key.y,
      version);
}

absl::Status SqliteWriter::CollectSurfaceTile(const TileKey& key, std::uint64_t floor) {
  return RunSql(
      "DELETE FROM derived_surface_tile WHERE level = ?1 AND x = ?2 AND y = ?3 AND version < "
      "(SELECT max(version) FROM derived_surface_tile WHERE level = ?1 AND x = ?2 AND y = ?3 AND "
      "version <= ?4)",
      key.level,
      key.x,
      key.y,
      floor);
}

absl::Status SqliteWriter::CollectAllSurfaceTiles(std::uint64_t floor) {
  STRATA_RETURN_IF_ERROR(
      RunSql("DELETE FROM derived_surface_tile WHERE rowid IN (SELECT old.rowid FROM "
             "derived_surface_tile AS old JOIN derived_surface_tile AS young ON young.level = "
             "old.level AND young.x = old.x AND young.y = old.y AND young.version > old.version "
             "AND young.version <= ?1)",
             floor));
  return RunSql("DELETE FROM derived_surface_tile WHERE gone = 1 AND version <= ?1", floor);
}

absl::Status SqliteWriter::PutPreparedTile(const PreparedTileRow& row) {
  STRATA_RETURN_IF_ERROR(DeletePreparedTile(row.key));
  return RunSql("INSERT INTO derived_prepared_tile (x, y, made_of, bytes) VALUES (?1, ?2, ?3, ?4)",
                row.key.x,
                row.key.y,
                Blob{row.made_of},
                Blob{row.bytes});
}

absl::Status SqliteWriter::DeletePreparedTile(const TileKey& key) {
  return RunSql("DELETE FROM derived_prepared_tile WHERE x = ?1 AND y = ?2", key.x, key.y);
}

absl::Status SqliteWriter::PutPlaneModelPart(std::uint64_t job,
                                             std::uint64_t part,
                                             absl::string_view bytes) {
  return RunSql("INSERT INTO derived_plane_model (job, part, bytes) VALUES (?1, ?2, ?3)",
                job,
                part,
                Blob{bytes});
}

absl::Status SqliteWriter::DeletePlaneModel() { return RunSql("DELETE FROM derived_plane_model"); }

absl::Status SqliteWriter::PutEntityPart(std::uint64_t job,
                                         const EntityPart& part,
                                         const std::vector<ScanNumber>& scans) {
  STRATA_RETURN_IF_ERROR(RunSql("INSERT INTO derived_entity (job, part, bytes) VALUES (?1, ?2, ?3)",
                                job,
                                part.part,
                                Blob{part.bytes}));
  for (const ScanNumber scan : scans) {
    STRATA_RETURN_IF_ERROR(
        RunSql("INSERT INTO derived_entity_scan (part, scan) VALUES (?1, ?2)", part.part, scan));
  }
  return absl::OkStatus();
}

absl::Status SqliteWriter::PutInferredPart(std::uint64_t job,
                                           std::uint64_t kind,
                                           const EntityPart& part) {
  return RunSql("INSERT INTO derived_inferred (job, part, kind, bytes) VALUES (?1, ?2, ?3, ?4)",
                job,
                part.part,
                kind,
                Blob{part.bytes});
}

absl::Status SqliteWriter::PutInferredScan(std::uint64_t kind, ScanNumber scan) {
  return RunSql("INSERT INTO derived_inferred_scan (kind, scan) VALUES (?1, ?2)", kind, scan);
}

absl::Status SqliteWriter::DeleteInferred() {
  STRATA_RETURN_IF_ERROR(RunSql("DELETE FROM derived_inferred_scan"));
  return RunSql("DELETE FROM derived_inferred");
}

absl::Status SqliteWriter::DeleteEntities() {
  STRATA_RETURN_IF_ERROR(DeleteInferred());
  STRATA_RETURN_IF_ERROR(RunSql("DELETE FROM derived_kind"));
  STRATA_RETURN_IF_ERROR(RunSql("DELETE FROM derived_entity_scan"));
  return RunSql("DELETE FROM derived_entity");
}

absl::Status SqliteWriter::DiscardUnpublished() {
  STRATA_RETURN_IF_ERROR(
      RunSql("DELETE FROM derived_mls_tile WHERE version > (SELECT tile_version FROM "
             "derived_state WHERE id = 1)"));
  return RunSql(
      "DELETE FROM derived_surface_tile WHERE version > (SELECT tile_version FROM derived_state "
      "WHERE id = 1)");
}

absl::Status SqliteWriter::SetTilesOfScan(ScanNumber number, const std::vector<TileKey>& tiles) {
  STRATA_RETURN_IF_ERROR(RunSql("DELETE FROM derived_scan_tile WHERE scan = ?1", number));
  for (const TileKey& key : tiles) {
    STRATA_RETURN_IF_ERROR(RunSql(
        "INSERT INTO derived_scan_tile (scan, x, y) VALUES (?1, ?2, ?3)", number, key.x, key.y));
  }
  return absl::OkStatus();
}

absl::Status SqliteWriter::SetFootprint(ScanNumber number, const Eigen::AlignedBox2d& footprint) {
  if (footprint.isEmpty()) {
    return RunSql("DELETE FROM derived_footprint WHERE scan = ?1", number);
  }
  return RunSql(
      "INSERT OR REPLACE INTO derived_footprint (scan, min_x, max_x, min_y, max_y, exact_min_x, "
      "exact_max_x, exact_min_y, exact_max_y) VALUES (?1, ?2, ?3, ?4, ?5, ?2, ?3, ?4, ?5)",
      number,
      footprint.min().x(),
      footprint.max().x(),
      footprint.min().y(),
      footprint.max().y());
}

absl::Status SqliteWriter::PutScanView(ScanNumber number, const ScanView& view) {
  return RunSql(
      "INSERT OR REPLACE INTO derived_scan_view (scan, place, planes) VALUES (?1, ?2, ?3)",
      number,
      Blob{view.place},
      Blob{view.planes});
}

absl::Status SqliteWriter::DeleteOrphanIndexes() {
  STRATA_RETURN_IF_ERROR(
      RunSql("DELETE FROM derived_scan_tile WHERE scan NOT IN (SELECT number FROM truth_scan)"));
  STRATA_RETURN_IF_ERROR(
      RunSql("DELETE FROM derived_scan_view WHERE scan NOT IN (SELECT number FROM truth_scan)"));
  return RunSql("DELETE FROM derived_footprint WHERE scan NOT IN (SELECT number FROM truth_scan)");
}

absl::Status SqliteWriter::PublishTiles(std::uint64_t version, bool complete) {
  return RunSql(
      "UPDATE derived_state SET tile_version = ?1, complete = ?2 WHERE id = 1", version, complete);
}

absl::Status SqliteWriter::DropDerived() { return ResetDerivedTables(database_); }

}  // namespace strata
