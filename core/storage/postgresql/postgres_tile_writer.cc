// The derived tables.
#include <cstddef>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include <Eigen/Geometry>

#include "core/common/status.h"
#include "core/mls/tile_key.h"
#include "core/storage/format.h"
#include "core/storage/postgresql/cells.h"
#include "core/storage/postgresql/postgres_writer.h"
#include "core/storage/postgresql/tables.h"

namespace strata {
namespace {

std::vector<std::int64_t> Numbers(const std::vector<ScanNumber>& scans) {
  return {scans.begin(), scans.end()};
}

}  // namespace

absl::Status PostgresWriter::PutMlsTile(const MlsTileRow& row) {
  return RunSql(
      "INSERT INTO derived_mls_tile (map, level, x, y, version, patches, cells, min_x, min_y, "
      "min_z, max_x, max_y, max_z, spread_weight, spread_sum, digest, bytes) VALUES ($1, $2, $3, "
      "$4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15, $16, $17) ON CONFLICT (map, level, x, "
      "y, version) DO UPDATE SET patches = $6, cells = $7, min_x = $8, min_y = $9, min_z = $10, "
      "max_x = $11, max_y = $12, max_z = $13, spread_weight = $14, spread_sum = $15, digest = $16, "
      "bytes = $17",
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
      Bytea{row.bytes});
}

absl::Status PostgresWriter::PutSurfaceTile(const SurfaceTileRow& row) {
  return RunSql(
      "INSERT INTO derived_surface_tile (map, level, x, y, version, gone, patches, size_bytes, "
      "bytes) VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9) ON CONFLICT (map, level, x, y, version) "
      "DO UPDATE SET gone = $6, patches = $7, size_bytes = $8, bytes = $9",
      row.key.level,
      row.key.x,
      row.key.y,
      row.version,
      row.gone,
      row.patches,
      std::uint64_t{row.bytes.size()},
      Bytea{row.bytes});
}

absl::Status PostgresWriter::DeleteMlsTile(const TileKey& key) {
  return RunSql("DELETE FROM derived_mls_tile WHERE map = $1 AND level = $2 AND x = $3 AND y = $4",
                key.level,
                key.x,
                key.y);
}

absl::Status PostgresWriter::DeleteOlderMlsTiles(const TileKey& key, std::uint64_t version) {
  return RunSql(
      "DELETE FROM derived_mls_tile WHERE map = $1 AND level = $2 AND x = $3 AND y = $4 AND "
      "version < $5",
      key.level,
      key.x,
      key.y,
      version);
}

absl::Status PostgresWriter::CollectSurfaceTile(const TileKey& key, std::uint64_t floor) {
  return RunSql(
      "DELETE FROM derived_surface_tile WHERE map = $1 AND level = $2 AND x = $3 AND y = $4 AND "
      "version < (SELECT max(version) FROM derived_surface_tile WHERE map = $1 AND level = $2 AND "
      "x = $3 AND y = $4 AND version <= $5)",
      key.level,
      key.x,
      key.y,
      floor);
}

absl::Status PostgresWriter::CollectAllSurfaceTiles(std::uint64_t floor) {
  return RunAll(
      {"DELETE FROM derived_surface_tile AS old USING derived_surface_tile AS young WHERE old.map "
       "= $1 AND young.map = $1 AND young.level = old.level AND young.x = old.x AND young.y = "
       "old.y AND young.version > old.version AND young.version <= $2",
       "DELETE FROM derived_surface_tile WHERE map = $1 AND gone = 1 AND version <= $2"},
      floor);
}

absl::Status PostgresWriter::PutPreparedTile(const PreparedTileRow& row) {
  STRATA_RETURN_IF_ERROR(DeletePreparedTile(row.key));
  return RunSql(
      "INSERT INTO derived_prepared_tile (map, x, y, made_of, bytes) VALUES ($1, $2, $3, $4, $5)",
      row.key.x,
      row.key.y,
      Bytea{row.made_of},
      Bytea{row.bytes});
}

absl::Status PostgresWriter::DeletePreparedTile(const TileKey& key) {
  return RunSql(
      "DELETE FROM derived_prepared_tile WHERE map = $1 AND x = $2 AND y = $3", key.x, key.y);
}

absl::Status PostgresWriter::PutPlaneModelPart(std::uint64_t job,
                                               std::uint64_t part,
                                               absl::string_view bytes) {
  return RunSql("INSERT INTO derived_plane_model (map, job, part, bytes) VALUES ($1, $2, $3, $4)",
                job,
                part,
                Bytea{bytes});
}

absl::Status PostgresWriter::DeletePlaneModel() {
  return RunSql("DELETE FROM derived_plane_model WHERE map = $1");
}

absl::Status PostgresWriter::PutEntityPart(std::uint64_t job,
                                           const EntityPart& part,
                                           const std::vector<ScanNumber>& scans) {
  STRATA_RETURN_IF_ERROR(
      RunSql("INSERT INTO derived_entity (map, job, part, bytes) VALUES ($1, $2, $3, $4)",
             job,
             part.part,
             Bytea{part.bytes}));
  if (scans.empty()) return absl::OkStatus();
  return RunSql(
      "INSERT INTO derived_entity_scan (map, scan, part) SELECT $1, scan, $2 FROM unnest($3) AS "
      "scan",
      part.part,
      Numbers(scans));
}

absl::Status PostgresWriter::PutInferredPart(std::uint64_t job,
                                             std::uint64_t kind,
                                             const EntityPart& part) {
  return RunSql(
      "INSERT INTO derived_inferred (map, job, part, kind, bytes) VALUES ($1, $2, $3, $4, $5)",
      job,
      part.part,
      kind,
      Bytea{part.bytes});
}

absl::Status PostgresWriter::PutInferredScan(std::uint64_t kind, ScanNumber scan) {
  return RunSql(
      "INSERT INTO derived_inferred_scan (map, kind, scan) VALUES ($1, $2, $3)", kind, scan);
}

absl::Status PostgresWriter::DeleteInferred() {
  STRATA_RETURN_IF_ERROR(RunSql("DELETE FROM derived_inferred_scan WHERE map = $1"));
  return RunSql("DELETE FROM derived_inferred WHERE map = $1");
}

absl::Status PostgresWriter::DeleteEntities() {
  STRATA_RETURN_IF_ERROR(DeleteInferred());
  STRATA_RETURN_IF_ERROR(RunSql("DELETE FROM derived_kind WHERE map = $1"));
  STRATA_RETURN_IF_ERROR(RunSql("DELETE FROM derived_entity_scan WHERE map = $1"));
  return RunSql("DELETE FROM derived_entity WHERE map = $1");
}

absl::Status PostgresWriter::DiscardUnpublished() {
  STRATA_RETURN_IF_ERROR(
      RunSql("DELETE FROM derived_mls_tile WHERE map = $1 AND version > (SELECT tile_version FROM "
             "derived_state WHERE map = $1)"));
  return RunSql(
      "DELETE FROM derived_surface_tile WHERE map = $1 AND version > (SELECT tile_version FROM "
      "derived_state WHERE map = $1)");
}

absl::Status PostgresWriter::SetTilesOfScan(ScanNumber number, const std::vector<TileKey>& tiles) {
  STRATA_RETURN_IF_ERROR(
      RunSql("DELETE FROM derived_scan_tile WHERE map = $1 AND scan = $2", number));
  std::vector<std::int64_t> x;
  std::vector<std::int64_t> y;
  for (const TileKey& key : tiles) {
    x.push_back(key.x);
    y.push_back(key.y);
  }
  if (tiles.empty()) return absl::OkStatus();
  return RunSql(
      "INSERT INTO derived_scan_tile (map, scan, x, y) SELECT $1, $2, tile.x, tile.y FROM "
      "unnest($3, $4) AS tile (x, y)",
      number,
      x,
      y);
}

absl::Status PostgresWriter::SetFootprint(ScanNumber number, const Eigen::AlignedBox2d& footprint) {
  STRATA_RETURN_IF_ERROR(RunAll({"DELETE FROM derived_scan_cell WHERE map = $1 AND scan = $2",
                                 "DELETE FROM derived_footprint WHERE map = $1 AND scan = $2"},
                                number));
  if (footprint.isEmpty()) return absl::OkStatus();
  STRATA_RETURN_IF_ERROR(RunSql(
      "INSERT INTO derived_footprint (map, scan, min_x, max_x, min_y, max_y) VALUES ($1, $2, $3, "
      "$4, $5, $6)",
      number,
      footprint.min().x(),
      footprint.max().x(),
      footprint.min().y(),
      footprint.max().y()));
  const CellRange cells = CellsOf(footprint);
  if (IsWide(cells)) {
    return RunSql(
        "INSERT INTO derived_scan_cell (map, wide, cx, cy, scan) VALUES ($1, 1, 0, 0, $2)", number);
  }
  return RunSql(
      "INSERT INTO derived_scan_cell (map, wide, cx, cy, scan) SELECT $1, 0, cx, cy, $2 FROM "
      "generate_series($3, $4) AS cx, generate_series($5, $6) AS cy",
      number,
      cells.x_min,
      cells.x_max,
      cells.y_min,
      cells.y_max);
}

absl::Status PostgresWriter::PutScanView(ScanNumber number, const ScanView& view) {
  return RunSql(
      "INSERT INTO derived_scan_view (map, scan, place, planes) VALUES ($1, $2, $3, $4) ON "
      "CONFLICT (map, scan) DO UPDATE SET place = $3, planes = $4",
      number,
      Bytea{view.place},
      Bytea{view.planes});
}

absl::Status PostgresWriter::DeleteOrphanIndexes() {
  for (const char* sql :
       {"DELETE FROM derived_scan_tile AS d WHERE d.map = $1 AND NOT EXISTS (SELECT FROM "
        "truth_scan AS s WHERE s.map = $1 AND s.number = d.scan)",
        "DELETE FROM derived_scan_view AS d WHERE d.map = $1 AND NOT EXISTS (SELECT FROM "
        "truth_scan AS s WHERE s.map = $1 AND s.number = d.scan)",
        "DELETE FROM derived_footprint AS d WHERE d.map = $1 AND NOT EXISTS (SELECT FROM "
        "truth_scan AS s WHERE s.map = $1 AND s.number = d.scan)",
        "DELETE FROM derived_scan_cell AS d WHERE d.map = $1 AND NOT EXISTS (SELECT FROM "
        "truth_scan AS s WHERE s.map = $1 AND s.number = d.scan)"}) {
    STRATA_RETURN_IF_ERROR(RunSql(sql));
  }
  return absl::OkStatus();
}

absl::Status PostgresWriter::PublishTiles(std::uint64_t version, bool complete) {
  return RunSql("UPDATE derived_state SET tile_version = $2, complete = $3 WHERE map = $1",
                version,
                complete);
}

// Nobody knows what becomes of the tiles: whoever watches is told everything then.
absl::Status PostgresWriter::DropDerived() {
  for (const char* sql : DeletionsOfDerived()) STRATA_RETURN_IF_ERROR(RunSql(sql));
  STRATA_RETURN_IF_ERROR(
      RunSql("UPDATE derived_state AS d SET changes_after = m.commit_sequence + 1 FROM truth_map "
             "AS m WHERE d.map = $1 AND m.map = $1"));
  return RunSql(
      "INSERT INTO derived_state (map, schema, tile_version, complete) VALUES ($1, $2, 0, 0) ON "
      "CONFLICT (map) DO UPDATE SET schema = $2, tile_version = 0, complete = 0",
      kDerivedVersion);
}

}  // namespace strata
