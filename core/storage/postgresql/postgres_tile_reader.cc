// Derived data: tiles, what jobs found, and the indexes over scans.
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include <Eigen/Geometry>

#include "core/common/status.h"
#include "core/mls/tile_key.h"
#include "core/storage/postgresql/postgres_reader.h"
#include "core/storage/rows.h"

namespace strata {

// A version is kept for its readers by whoever has the map. One whose lease has ended, a frozen
// server that woke up, would take what his successor has collected for what was never there.
absl::StatusOr<std::optional<MlsTileRow>> PostgresReader::FindMlsTile(const TileKey& key,
                                                                      std::uint64_t version) {
  STRATA_ASSIGN_OR_RETURN(
      Rows row,
      Ask("SELECT " STRATA_MLS_TILE_COLUMNS ", bytes FROM derived_mls_tile WHERE map = $1 AND "
          "level = $2 AND x = $3 AND y = $4 AND version <= $5 ORDER BY version DESC LIMIT 1",
          key.level,
          key.x,
          key.y,
          version));
  STRATA_RETURN_IF_ERROR(CheckKept());
  if (!row.Next()) return std::optional<MlsTileRow>();
  MlsTileRow tile = ReadMlsTile(row);
  tile.bytes = row.Text(15);
  return std::optional<MlsTileRow>(std::move(tile));
}

absl::StatusOr<std::optional<SurfaceTileRow>> PostgresReader::FindSurfaceTile(
    const TileKey& key, std::uint64_t version) {
  STRATA_ASSIGN_OR_RETURN(
      Rows row,
      Ask("SELECT " STRATA_SURFACE_TILE_COLUMNS ", bytes FROM derived_surface_tile WHERE map = $1 "
          "AND level = $2 AND x = $3 AND y = $4 AND version <= $5 ORDER BY version DESC LIMIT 1",
          key.level,
          key.x,
          key.y,
          version));
  STRATA_RETURN_IF_ERROR(CheckKept());
  if (!row.Next() || row.Bool(4)) return std::optional<SurfaceTileRow>();
  SurfaceTileRow tile = ReadSurfaceTile(row);
  tile.bytes = row.Text(7);
  return std::optional<SurfaceTileRow>(std::move(tile));
}

// A damaged key beyond the numbers of tiles would be read as another tile's, and no repair would
// find its row.
absl::StatusOr<std::vector<MlsTileRow>> PostgresReader::ListMlsTiles(std::uint64_t version) {
  STRATA_ASSIGN_OR_RETURN(
      Rows row,
      Ask("SELECT DISTINCT ON (level, x, y) " STRATA_MLS_TILE_COLUMNS " FROM derived_mls_tile "
          "WHERE map = $1 AND version <= $2 AND level BETWEEN 0 AND $3 AND x BETWEEN $4 AND $5 AND "
          "y BETWEEN $4 AND $5 ORDER BY level, x, y, version DESC",
          version,
          kMaxLevel,
          std::numeric_limits<std::int32_t>::min(),
          std::numeric_limits<std::int32_t>::max()));
  STRATA_RETURN_IF_ERROR(CheckKept());
  std::vector<MlsTileRow> tiles;
  while (row.Next()) tiles.push_back(ReadMlsTile(row));
  return tiles;
}

absl::StatusOr<std::vector<SurfaceTileRow>> PostgresReader::ListSurfaceTiles(
    const TileRange& range, std::uint64_t version) {
  STRATA_ASSIGN_OR_RETURN(
      Rows row,
      Ask("SELECT DISTINCT ON (level, x, y) " STRATA_SURFACE_TILE_COLUMNS
          " FROM derived_surface_tile WHERE map = $1 AND level = $2 AND x >= $3 AND x < $4 AND y "
          ">= $5 AND y < $6 AND version <= $7 ORDER BY level, x, y, version DESC",
          range.level,
          range.x_min,
          range.x_max,
          range.y_min,
          range.y_max,
          version));
  STRATA_RETURN_IF_ERROR(CheckKept());
  std::vector<SurfaceTileRow> tiles;
  while (row.Next()) {
    if (!row.Bool(4)) tiles.push_back(ReadSurfaceTile(row));
  }
  return tiles;
}

absl::StatusOr<std::optional<std::string>> PostgresReader::FindPreparedTile(
    const TileKey& key, absl::string_view made_of) {
  return AskForBytes(Ask(
      "SELECT bytes FROM derived_prepared_tile WHERE map = $1 AND x = $2 AND y = $3 AND made_of = "
      "$4",
      key.x,
      key.y,
      Bytea{made_of}));
}

absl::StatusOr<std::vector<PreparedTileRow>> PostgresReader::ListPreparedTiles() {
  STRATA_ASSIGN_OR_RETURN(
      Rows row,
      Ask("SELECT 0, x, y, made_of FROM derived_prepared_tile WHERE map = $1 ORDER BY x, y"));
  std::vector<PreparedTileRow> tiles;
  while (row.Next()) tiles.push_back({ReadTileKey(row), row.Text(3), ""});
  return tiles;
}

absl::StatusOr<std::optional<std::string>> PostgresReader::FindPlaneModelPart(std::uint64_t job,
                                                                              std::uint64_t part) {
  return AskForBytes(
      Ask("SELECT bytes FROM derived_plane_model WHERE map = $1 AND job = $2 AND part = $3",
          job,
          part));
}

absl::StatusOr<std::uint64_t> PostgresReader::JobOfPlaneModel() {
  return AskForNumber(Ask("SELECT coalesce(max(job), 0) FROM derived_plane_model WHERE map = $1"));
}

absl::StatusOr<std::optional<EntityPart>> PostgresReader::AskForPart(absl::StatusOr<Rows> rows) {
  STRATA_RETURN_IF_ERROR(rows.status());
  if (!rows->Next()) return std::optional<EntityPart>();
  return std::optional<EntityPart>({rows->Unsigned(0), rows->Text(1)});
}

absl::StatusOr<std::optional<EntityPart>> PostgresReader::FindEntityPart(
    std::uint64_t job, std::optional<std::uint64_t> after) {
  return AskForPart(Ask(
      "SELECT part, bytes FROM derived_entity WHERE map = $1 AND job = $2 AND part >= $3 ORDER BY "
      "part LIMIT 1",
      job,
      after.has_value() ? *after + 1 : std::uint64_t{0}));
}

absl::StatusOr<std::uint64_t> PostgresReader::JobOfEntities() {
  return AskForNumber(Ask("SELECT coalesce(max(job), 0) FROM derived_entity WHERE map = $1"));
}

absl::StatusOr<std::optional<EntityPart>> PostgresReader::FindInferredPart(
    std::uint64_t job, std::optional<std::uint64_t> after) {
  return AskForPart(Ask(
      "SELECT part, bytes FROM derived_inferred WHERE map = $1 AND job = $2 AND part >= $3 ORDER "
      "BY part LIMIT 1",
      job,
      after.has_value() ? *after + 1 : std::uint64_t{0}));
}

absl::StatusOr<std::uint64_t> PostgresReader::JobOfInferred() {
  return AskForNumber(Ask("SELECT coalesce(max(job), 0) FROM derived_inferred WHERE map = $1"));
}

absl::StatusOr<std::vector<KindRow>> PostgresReader::ListKinds() {
  STRATA_ASSIGN_OR_RETURN(
      Rows row,
      Ask("SELECT id, name, info, 1 AS library FROM truth_kind WHERE map = $1 UNION ALL SELECT "
          "d.id, '', d.info, 0 FROM derived_kind AS d WHERE d.map = $1 AND NOT EXISTS (SELECT FROM "
          "truth_kind AS t WHERE t.map = $1 AND t.id = d.id) ORDER BY library DESC, id"));
  std::vector<KindRow> kinds;
  while (row.Next()) {
    kinds.push_back({row.Unsigned(0), row.Text(1), row.Int(3) == 1, row.Text(2)});
  }
  return kinds;
}

absl::StatusOr<std::optional<std::string>> PostgresReader::FindKindShape(std::uint64_t id) {
  return AskForBytes(
      Ask("SELECT shape, 0 AS found FROM truth_kind WHERE map = $1 AND id = $2 UNION ALL SELECT "
          "shape, 1 FROM derived_kind WHERE map = $1 AND id = $2 ORDER BY found LIMIT 1",
          id));
}

absl::StatusOr<std::vector<ScanNumber>> PostgresReader::ScansOfTile(const TileKey& key) {
  return AskForNumbers(
      Ask("SELECT scan FROM derived_scan_tile WHERE map = $1 AND x = $2 AND y = $3 ORDER BY scan",
          key.x,
          key.y));
}

absl::StatusOr<std::vector<TileKey>> PostgresReader::TilesOfScan(ScanNumber number) {
  STRATA_ASSIGN_OR_RETURN(
      Rows row,
      Ask("SELECT 0, x, y FROM derived_scan_tile WHERE map = $1 AND scan = $2 ORDER BY x, y",
          number));
  std::vector<TileKey> tiles;
  while (row.Next()) tiles.push_back(ReadTileKey(row));
  return tiles;
}

absl::StatusOr<ScanView> PostgresReader::FindScanView(ScanNumber number) {
  STRATA_ASSIGN_OR_RETURN(
      Rows row,
      Ask("SELECT place, planes FROM derived_scan_view WHERE map = $1 AND scan = $2", number));
  if (!row.Next()) return ScanView();
  return ScanView{row.Text(0), row.Text(1)};
}

absl::StatusOr<std::optional<Eigen::AlignedBox2d>> PostgresReader::FootprintOfScan(
    ScanNumber number) {
  STRATA_ASSIGN_OR_RETURN(
      Rows row,
      Ask("SELECT min_x, min_y, max_x, max_y FROM derived_footprint WHERE map = $1 AND scan = $2",
          number));
  if (!row.Next()) return std::optional<Eigen::AlignedBox2d>();
  return std::optional<Eigen::AlignedBox2d>(Eigen::AlignedBox2d(
      Eigen::Vector2d(row.Real(0), row.Real(1)), Eigen::Vector2d(row.Real(2), row.Real(3))));
}

}  // namespace strata
