// Derived data: tiles and the indexes over scans.
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include <Eigen/Geometry>

#include "core/common/status.h"
#include "core/mls/tile_key.h"
#include "core/storage/rows.h"
#include "core/storage/sqlite/database.h"
#include "core/storage/sqlite/sqlite_reader.h"

namespace strata {
absl::StatusOr<std::optional<MlsTileRow>> SqliteReader::FindMlsTile(const TileKey& key,
                                                                    std::uint64_t version) {
  STRATA_ASSIGN_OR_RETURN(
      Statement row,
      database_.Prepare("SELECT " STRATA_MLS_TILE_COLUMNS
                        ", bytes FROM derived_mls_tile WHERE level = ?1 AND "
                        "x = ?2 AND y = ?3 AND version <= ?4 ORDER BY version DESC LIMIT 1"));
  row.Bind(key.level, key.x, key.y, version);
  STRATA_ASSIGN_OR_RETURN(const bool found, row.Step());
  if (!found) return std::optional<MlsTileRow>();
  MlsTileRow tile = ReadMlsTile(row);
  tile.bytes = row.Text(15);
  return std::optional<MlsTileRow>(std::move(tile));
}

absl::StatusOr<std::optional<SurfaceTileRow>> SqliteReader::FindSurfaceTile(const TileKey& key,
                                                                            std::uint64_t version) {
  STRATA_ASSIGN_OR_RETURN(
      Statement row,
      database_.Prepare(
          "SELECT " STRATA_SURFACE_TILE_COLUMNS
          ", bytes FROM derived_surface_tile WHERE level = ?1 AND x = ?2 AND y = ?3 AND "
          "version <= ?4 ORDER BY version DESC LIMIT 1"));
  row.Bind(key.level, key.x, key.y, version);
  STRATA_ASSIGN_OR_RETURN(const bool found, row.Step());
  if (!found || row.Int(4) != 0) return std::optional<SurfaceTileRow>();
  SurfaceTileRow tile = ReadSurfaceTile(row);
  tile.bytes = row.Text(7);
  return std::optional<SurfaceTileRow>(std::move(tile));
}

absl::StatusOr<std::vector<MlsTileRow>> SqliteReader::ListMlsTiles(std::uint64_t version) {
  STRATA_ASSIGN_OR_RETURN(
      Statement row,
      database_.Prepare("SELECT " STRATA_MLS_TILE_COLUMNS " FROM derived_mls_tile "
                        "WHERE version <= ?1 AND "
                        "level BETWEEN 0 AND ?2 AND x BETWEEN ?3 AND ?4 AND y BETWEEN ?3 AND ?4 "
                        "ORDER BY level, x, y, version"));
  // A damaged key beyond them would be read as another tile's, and no repair would find its row.
  row.Bind(version,
           kMaxLevel,
           std::numeric_limits<std::int32_t>::min(),
           std::numeric_limits<std::int32_t>::max());
  std::vector<MlsTileRow> tiles;
  STRATA_RETURN_IF_ERROR(ForEachRow(row, [&] {
    if (!tiles.empty() && tiles.back().key == ReadTileKey(row)) tiles.pop_back();
    tiles.push_back(ReadMlsTile(row));
    return absl::OkStatus();
  }));
  return tiles;
}

absl::StatusOr<std::vector<SurfaceTileRow>> SqliteReader::ListSurfaceTiles(const TileRange& range,
                                                                           std::uint64_t version) {
  STRATA_ASSIGN_OR_RETURN(
      Statement row,
      database_.Prepare("SELECT " STRATA_SURFACE_TILE_COLUMNS
                        " FROM derived_surface_tile WHERE level = ?1 AND x >= ?2 AND x < ?3 AND "
                        "y >= ?4 AND y < ?5 AND version <= ?6 ORDER BY level, x, y, version"));
  row.Bind(range.level, range.x_min, range.x_max, range.y_min, range.y_max, version);
  std::vector<SurfaceTileRow> tiles;
  STRATA_RETURN_IF_ERROR(ForEachRow(row, [&] {
    if (!tiles.empty() && tiles.back().key == ReadTileKey(row)) tiles.pop_back();
    tiles.push_back(ReadSurfaceTile(row));
    return absl::OkStatus();
  }));
  std::erase_if(tiles, [](const SurfaceTileRow& tile) { return tile.gone; });
  return tiles;
}

absl::StatusOr<std::optional<std::string>> SqliteReader::FindPreparedTile(
    const TileKey& key, absl::string_view made_of) {
  STRATA_ASSIGN_OR_RETURN(
      Statement row,
      database_.Prepare(
          "SELECT bytes FROM derived_prepared_tile WHERE x = ?1 AND y = ?2 AND made_of = ?3"));
  row.Bind(key.x, key.y, Blob{made_of});
  STRATA_ASSIGN_OR_RETURN(const bool found, row.Step());
  if (!found) return std::optional<std::string>();
  return std::optional<std::string>(row.Text(0));
}

absl::StatusOr<std::optional<std::string>> SqliteReader::FindPlaneModelPart(std::uint64_t job,
                                                                            std::uint64_t part) {
  STRATA_ASSIGN_OR_RETURN(
      Statement row,
      database_.Prepare("SELECT bytes FROM derived_plane_model WHERE job = ?1 AND part = ?2"));
  row.Bind(job, part);
  STRATA_ASSIGN_OR_RETURN(const bool found, row.Step());
  if (!found) return std::optional<std::string>();
  return std::optional<std::string>(row.Text(0));
}

absl::StatusOr<std::uint64_t> SqliteReader::JobOfPlaneModel() {
  return LastJob("SELECT coalesce(max(job), 0) FROM derived_plane_model");
}

absl::StatusOr<std::optional<EntityPart>> SqliteReader::FindPartAfter(
    const char* sql, std::uint64_t job, std::optional<std::uint64_t> after) {
  STRATA_ASSIGN_OR_RETURN(Statement row, database_.Prepare(sql));
  row.Bind(job, after.has_value() ? *after + 1 : 0);
  STRATA_ASSIGN_OR_RETURN(const bool found, row.Step());
  if (!found) return std::optional<EntityPart>();
  return std::optional<EntityPart>({row.Unsigned(0), row.Text(1)});
}

absl::StatusOr<std::uint64_t> SqliteReader::LastJob(const char* sql) {
  STRATA_ASSIGN_OR_RETURN(Statement row, database_.Prepare(sql));
  STRATA_RETURN_IF_ERROR(row.Step().status());
  return row.Unsigned(0);
}

absl::StatusOr<std::optional<EntityPart>> SqliteReader::FindEntityPart(
    std::uint64_t job, std::optional<std::uint64_t> after) {
  return FindPartAfter(
      "SELECT part, bytes FROM derived_entity WHERE job = ?1 AND part >= ?2 ORDER BY part LIMIT 1",
      job,
      after);
}

absl::StatusOr<std::uint64_t> SqliteReader::JobOfEntities() {
  return LastJob("SELECT coalesce(max(job), 0) FROM derived_entity");
}

absl::StatusOr<std::optional<EntityPart>> SqliteReader::FindInferredPart(
    std::uint64_t job, std::optional<std::uint64_t> after) {
  return FindPartAfter(
      "SELECT part, bytes FROM derived_inferred WHERE job = ?1 AND part >= ?2 "
      "ORDER BY part LIMIT 1",
      job,
      after);
}

absl::StatusOr<std::uint64_t> SqliteReader::JobOfInferred() {
  return LastJob("SELECT coalesce(max(job), 0) FROM derived_inferred");
}

absl::StatusOr<std::vector<PreparedTileRow>> SqliteReader::ListPreparedTiles() {
  STRATA_ASSIGN_OR_RETURN(
      Statement row,
      database_.Prepare("SELECT 0, x, y, made_of FROM derived_prepared_tile ORDER BY x, y"));
  std::vector<PreparedTileRow> tiles;
  STRATA_RETURN_IF_ERROR(ForEachRow(row, [&] {
    tiles.push_back({ReadTileKey(row), row.Text(3), ""});
    return absl::OkStatus();
  }));
  return tiles;
}

absl::StatusOr<std::vector<ScanNumber>> SqliteReader::ScansOfTile(const TileKey& key) {
  STRATA_ASSIGN_OR_RETURN(
      Statement row,
      database_.Prepare(
          "SELECT scan FROM derived_scan_tile WHERE x = ?1 AND y = ?2 ORDER BY scan"));
  row.Bind(key.x, key.y);
  std::vector<ScanNumber> scans;
  STRATA_RETURN_IF_ERROR(ForEachRow(row, [&] {
    scans.push_back(row.Unsigned(0));
    return absl::OkStatus();
  }));
  return scans;
}

absl::StatusOr<std::vector<TileKey>> SqliteReader::TilesOfScan(ScanNumber number) {
  STRATA_ASSIGN_OR_RETURN(
      Statement row,
      database_.Prepare("SELECT 0, x, y FROM derived_scan_tile WHERE scan = ?1 ORDER BY x, y"));
  row.Bind(number);
  std::vector<TileKey> tiles;
  STRATA_RETURN_IF_ERROR(ForEachRow(row, [&] {
    tiles.push_back(ReadTileKey(row));
    return absl::OkStatus();
  }));
  return tiles;
}

absl::StatusOr<ScanView> SqliteReader::FindScanView(ScanNumber number) {
  STRATA_ASSIGN_OR_RETURN(
      Statement row,
      database_.Prepare("SELECT place, planes FROM derived_scan_view WHERE scan = ?1"));
  row.Bind(number);
  STRATA_ASSIGN_OR_RETURN(const bool found, row.Step());
  if (!found) return ScanView();
  return ScanView{row.Text(0), row.Text(1)};
}

absl::StatusOr<std::optional<Eigen::AlignedBox2d>> SqliteReader::FootprintOfScan(
    ScanNumber number) {
  STRATA_ASSIGN_OR_RETURN(
      Statement row,
      database_.Prepare("SELECT exact_min_x, exact_min_y, exact_max_x, exact_max_y FROM "
                        "derived_footprint WHERE scan = ?1"));
  row.Bind(number);
  STRATA_ASSIGN_OR_RETURN(const bool found, row.Step());
  if (!found) return std::optional<Eigen::AlignedBox2d>();
  return std::optional<Eigen::AlignedBox2d>(Eigen::AlignedBox2d(
      Eigen::Vector2d(row.Real(0), row.Real(1)), Eigen::Vector2d(row.Real(2), row.Real(3))));
}

}  // namespace strata
