#include "core/storage/postgresql/map_copy.h"

#include <cstdint>
#include <cstring>
#include <filesystem>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include <Eigen/Geometry>

#include "core/common/status.h"
#include "core/storage/postgresql/cells.h"
#include "core/storage/postgresql/copied_tables.h"
#include "core/storage/row.h"
#include "core/storage/sqlite/schema.h"

namespace strata {
namespace {

// Ids of classifiers that were deleted are not given again.
constexpr CopiedTable kLastModel = {
    "truth_map",
    "SELECT last_model FROM truth_map WHERE map = $1",
    "INSERT INTO sqlite_sequence (name, seq) VALUES ('truth_model', ?1)",
    nullptr,
    nullptr,
    "i"};

absl::Status Insert(Database& file, const CopiedTable& table, const Row& row) {
  STRATA_ASSIGN_OR_RETURN(Statement insert, file.Prepare(table.insert));
  const int columns = insert.parameters();
  for (int i = 0; i < columns; ++i) {
    switch (table.types[i]) {
      case 'i':
        insert.BindOne(i + 1, row.Int(i));
        break;
      case 'r':
        insert.BindOne(i + 1, row.Real(i));
        break;
      case 't':
        insert.BindOne(i + 1, row.Bytes(i));
        break;
      default:
        insert.BindOne(i + 1, Blob{row.Bytes(i)});
    }
  }
  return insert.Run();
}

absl::Status ForEachCopied(Connection& connection,
                           std::int64_t map,
                           const CopiedTable& table,
                           const Stop& stop,
                           absl::FunctionRef<absl::Status(const Row&)> tell) {
  return connection.Stream(
      table.select, Parameters(map), [&stop, tell](const Row& row) -> absl::Status {
        STRATA_RETURN_IF_ERROR(stop.status());
        return tell(row);
      });
}

// Rows that were copied.
absl::StatusOr<std::uint64_t> CopyTable(Connection& connection,
                                        std::int64_t map,
                                        Database& file,
                                        const CopiedTable& table,
                                        const Stop& stop) {
  std::uint64_t rows = 0;
  STRATA_RETURN_IF_ERROR(ForEachCopied(connection, map, table, stop, [&](const Row& row) {
    ++rows;
    return Insert(file, table, row);
  }));
  return rows;
}

absl::Status NoMap() { return absl::NotFoundError("store: the map is not there any more"); }

void AddColumns(const Row& row, const CopiedTable& table, CopiedRow& copied) {
  for (int i = 0; table.types[i] != 0; ++i) {
    switch (table.types[i]) {
      case 'i':
        copied.Add(row.Int(i));
        break;
      case 'r':
        copied.Add(row.Real(i));
        break;
      default:
        copied.Add(row.Bytes(i));
    }
  }
}

// Rows that were copied.
absl::StatusOr<std::uint64_t> FillTable(Statement& rows,
                                        Connection& connection,
                                        std::int64_t map,
                                        const CopiedTable& table,
                                        const Stop& stop) {
  std::uint64_t copied = 0;
  STRATA_RETURN_IF_ERROR(connection.CopyIn(table.copy, [&](CopySink& sink) {
    return ForEachRow(rows, [&]() -> absl::Status {
      STRATA_RETURN_IF_ERROR(stop.status());
      ++copied;
      CopiedRow row(map);
      AddColumns(rows, table, row);
      return sink.Put(row);
    });
  }));
  return copied;
}

absl::Status PutCells(CopySink& sink, std::int64_t map, const Row& footprint) {
  const std::int64_t scan = footprint.Int(0);
  const Eigen::AlignedBox2d box(Eigen::Vector2d(footprint.Real(1), footprint.Real(3)),
                                Eigen::Vector2d(footprint.Real(2), footprint.Real(4)));
  if (box.isEmpty()) return absl::OkStatus();
  const CellRange cells = CellsOf(box);
  if (IsWide(cells)) {
    CopiedRow row(map);
    for (const std::int64_t value : {std::int64_t{1}, std::int64_t{0}, std::int64_t{0}, scan}) {
      row.Add(value);
    }
    return sink.Put(row);
  }
  for (std::int64_t x = cells.x_min; x <= cells.x_max; ++x) {
    for (std::int64_t y = cells.y_min; y <= cells.y_max; ++y) {
      CopiedRow row(map);
      for (const std::int64_t value : {std::int64_t{0}, x, y, scan}) row.Add(value);
      STRATA_RETURN_IF_ERROR(sink.Put(row));
    }
  }
  return absl::OkStatus();
}

// What only the database has: by which cells scans are found.
absl::Status FillCells(Database& file, Connection& connection, std::int64_t map, const Stop& stop) {
  STRATA_ASSIGN_OR_RETURN(Statement rows, file.Prepare(kFootprintsOfFile));
  return connection.CopyIn(
      "COPY derived_scan_cell (map, wide, cx, cy, scan) FROM STDIN (FORMAT binary)",
      [&](CopySink& sink) {
        return ForEachRow(rows, [&]() -> absl::Status {
          STRATA_RETURN_IF_ERROR(stop.status());
          return PutCells(sink, map, rows);
        });
      });
}

}  // namespace

absl::Status CopyMapToFile(Connection& connection,
                           std::int64_t map,
                           const std::filesystem::path& file,
                           const Stop& stop) {
  STRATA_RETURN_IF_ERROR(stop.status());
  STRATA_ASSIGN_OR_RETURN(Database copy, Database::Open(file, Database::Mode::kCreate));
  STRATA_RETURN_IF_ERROR(CreateSchema(copy));
  {
    STRATA_ASSIGN_OR_RETURN(Transaction transaction, Transaction::Begin(copy, "BEGIN IMMEDIATE"));
    for (const CopiedTable& table : kCopiedTables) {
      STRATA_RETURN_IF_ERROR(CopyTable(connection, map, copy, table, stop).status());
    }
    STRATA_RETURN_IF_ERROR(copy.Execute("DELETE FROM sqlite_sequence WHERE name = 'truth_model'"));
    STRATA_RETURN_IF_ERROR(CopyTable(connection, map, copy, kLastModel, stop).status());
    STRATA_ASSIGN_OR_RETURN(const std::uint64_t maps,
                            CopyTable(connection, map, copy, kCopiedMap, stop));
    if (maps == 0) return NoMap();
    STRATA_RETURN_IF_ERROR(transaction.Commit());
  }
  STRATA_RETURN_IF_ERROR(copy.Execute("PRAGMA journal_mode = DELETE"));  // one file is the whole
  return copy.CheckPages(stop);
}

absl::Status CopyFileToMap(Database& file,
                           Connection& connection,
                           std::int64_t map,
                           std::uint64_t least_clock,
                           const Stop& stop) {
  // One state, should somebody write the file after all.
  STRATA_ASSIGN_OR_RETURN(const Transaction transaction, Transaction::Begin(file, "BEGIN"));
  for (const CopiedTable& table : kCopiedTables) {
    STRATA_ASSIGN_OR_RETURN(Statement rows, file.Prepare(table.read));
    const auto filled = FillTable(rows, connection, map, table, stop);
    STRATA_RETURN_IF_ERROR(Annotate(filled.status(), table.name));
  }
  STRATA_RETURN_IF_ERROR(FillCells(file, connection, map, stop));
  STRATA_ASSIGN_OR_RETURN(Statement row, file.Prepare(kCopiedMap.read));
  row.Bind(least_clock);
  STRATA_ASSIGN_OR_RETURN(const std::uint64_t maps,
                          FillTable(row, connection, map, kCopiedMap, stop));
  return maps == 1 ? absl::OkStatus() : absl::DataLossError("store: the file has no map's row");
}

absl::StatusOr<std::uint64_t> ReadWholeMap(Connection& connection,
                                           std::int64_t map,
                                           const Stop& stop) {
  std::uint64_t bytes = 0;
  std::uint64_t rows = 0;
  const auto count = [&](const CopiedTable& table) {
    rows = 0;
    return Annotate(ForEachCopied(connection,
                                  map,
                                  table,
                                  stop,
                                  [&](const Row& row) {
                                    ++rows;
                                    for (int i = 0; table.types[i] != 0; ++i) {
                                      const bool number =
                                          table.types[i] == 'i' || table.types[i] == 'r';
                                      if (!number) bytes += row.Bytes(i).size();
                                    }
                                    return absl::OkStatus();
                                  }),
                    table.name);
  };
  for (const CopiedTable& table : kCopiedTables) STRATA_RETURN_IF_ERROR(count(table));
  CopiedTable own = kCopiedMap;
  own.types = "";  // those of a file
  STRATA_RETURN_IF_ERROR(count(own));
  if (rows == 0) return NoMap();
  return bytes;
}

}  // namespace strata
