#include "core/storage/sqlite/sqlite_storage.h"

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/time/time.h"

#include "core/common/status.h"
#include "core/storage/sqlite/database.h"
#include "core/storage/sqlite/file_state.h"
#include "core/storage/sqlite/map_file.h"
#include "core/storage/sqlite/schema.h"
#include "core/storage/sqlite/sqlite_reader.h"
#include "core/storage/sqlite/sqlite_writer.h"

namespace strata {
namespace {

class SqliteStorage final : public MapStorage {
 public:
  SqliteStorage(std::filesystem::path file, Database database)
      : file_(std::move(file)),
        opened_(StateOfFile(file_)),
        writer_(std::make_shared<Database>(std::move(database))) {}

  absl::StatusOr<std::unique_ptr<StorageReader>> NewReader() override {
    absl::StatusOr<Database> opened = Database::Open(file_, Database::Mode::kRead);
    STRATA_RETURN_IF_ERROR(CheckInPlace());
    STRATA_ASSIGN_OR_RETURN(Database database, std::move(opened));
    return std::make_unique<SqliteReader>(std::make_shared<Database>(std::move(database)));
  }
  StorageWriter& writer() override { return writer_; }
  absl::Status CheckInPlace() const override {
    std::uint64_t seen = seen_bytes_;  // before the look: a map's file never becomes smaller
    const std::optional<FileState> now = StateOfFile(file_);
    const bool whole =
        now.has_value() && opened_.has_value() && now->SameFile(*opened_) && now->bytes >= seen;
    if (!whole) return TakenAway(file_);
    while (seen < now->bytes && !seen_bytes_.compare_exchange_weak(seen, now->bytes)) {
    }
    return absl::OkStatus();
  }

 private:
  std::filesystem::path file_;
  const std::optional<FileState> opened_;
  mutable std::atomic<std::uint64_t> seen_bytes_{0};  // the most that the file had
  SqliteWriter writer_;
};

absl::Status InsertMap(Database& database,
                       const MapParameters& parameters,
                       absl::Time created,
                       std::uint64_t clock) {
  STRATA_ASSIGN_OR_RETURN(
      Statement row,
      database.Prepare("INSERT INTO truth_map VALUES (1, ?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, "
                       "?11, ?12, ?13, ?15, 1, 0, 1, ?14)"));
  const GeodeticOrigin origin = parameters.origin.value_or(GeodeticOrigin());
  row.Bind(absl::ToUnixMicros(created),
           parameters.mls.cell_size_m,
           parameters.mls.gap_size_m,
           parameters.mls.thickness_m,
           parameters.sensor.sigma_m,
           parameters.sensor.sigma_per_metre,
           parameters.sensor.min_range_m,
           parameters.sensor.max_range_m,
           parameters.keep_points,
           parameters.origin.has_value(),
           origin.latitude_rad,
           origin.longitude_rad,
           origin.altitude_m,
           parameters.fade_after,
           clock);
  STRATA_RETURN_IF_ERROR(row.Run());
  STRATA_ASSIGN_OR_RETURN(Statement epoch,
                          database.Prepare("INSERT INTO truth_epoch (epoch, created_us, reason) "
                                           "VALUES (1, ?1, 'created')"));
  return epoch.Bind(absl::ToUnixMicros(created)).Run();
}

absl::Status LimitSize(Database& database, std::uint64_t max_file_bytes) {
  if (max_file_bytes == 0) return absl::OkStatus();
  STRATA_ASSIGN_OR_RETURN(const std::int64_t page_bytes, database.Pragma("PRAGMA page_size"));
  const std::uint64_t pages = max_file_bytes / static_cast<std::uint64_t>(page_bytes) + 1;
  return database.Execute(absl::StrCat("PRAGMA max_page_count = ", pages));
}

// By the header that SQLite gives its files (sqlite.org/fileformat2.html#the_database_header): 100
// bytes that begin with 16 fixed ones and have the application id, big-endian, at offset 68.
std::string KindOf(const std::filesystem::path& file) {
  std::error_code error;
  if (std::filesystem::is_directory(file, error)) return "a directory";
  std::string header(100, '\0');
  std::ifstream stream(file, std::ios::binary);
  stream.read(header.data(), static_cast<std::streamsize>(header.size()));
  if (stream.gcount() == 0) return "an empty or unreadable file";
  const std::string magic("SQLite format 3\0", 16);
  if (!stream || header.compare(0, magic.size(), magic) != 0) return "no database file";
  std::uint32_t application = 0;
  for (int i = 68; i < 72; ++i)
    application = application << 8 | static_cast<std::uint8_t>(header[i]);
  if (application == static_cast<std::uint32_t>(kApplicationId)) return "";
  return absl::StrCat("a database file of another application (application_id ", application, ")");
}

}  // namespace

absl::StatusOr<std::unique_ptr<StorageReader>> ReadSqliteMapAtRest(
    const std::filesystem::path& file) {
  STRATA_ASSIGN_OR_RETURN(Database database, OpenSqliteMapAtRest(file));
  return std::make_unique<SqliteReader>(std::make_shared<Database>(std::move(database)));
}

absl::Status CheckIsSqliteMap(const std::filesystem::path& file) {
  const std::string kind = KindOf(file);
  if (kind.empty()) return absl::OkStatus();
  return absl::FailedPreconditionError(
      absl::StrCat(file.filename().string(), " is not a Strata map but ", kind));
}

absl::Status CreateSqliteMap(const std::filesystem::path& file,
                             const MapParameters& parameters,
                             absl::Time created,
                             std::uint64_t clock) {
  STRATA_RETURN_IF_ERROR(ValidateMapParameters(parameters));
  STRATA_ASSIGN_OR_RETURN(Database opened, Database::Open(file, Database::Mode::kCreate));
  const auto database = std::make_shared<Database>(std::move(opened));
  STRATA_RETURN_IF_ERROR(CreateSchema(*database));
  SqliteWriter writer(database);
  STRATA_RETURN_IF_ERROR(writer.Commit(Durability::kFull, [&]() -> absl::Status {
    STRATA_RETURN_IF_ERROR(InsertMap(*database, parameters, created, clock));
    STRATA_RETURN_IF_ERROR(writer.PutProfile("default", parameters.default_profile));
    return writer.PublishTiles(0, true);
  }));
  return EmptyLog(*database);  // which does not follow when the file is given another name
}

absl::StatusOr<std::unique_ptr<MapStorage>> OpenSqliteStorage(const std::filesystem::path& file,
                                                              const SqliteOptions& options) {
  const std::string what = file.filename().string();
  absl::StatusOr<Database> database = Database::Open(file, Database::Mode::kWrite);
  if (!database.ok()) return Annotate(database.status(), what);
  absl::Status ready = UpgradeSchema(*database);
  if (ready.ok()) ready = database->Execute("PRAGMA journal_mode = WAL");
  if (ready.ok()) ready = database->Execute("PRAGMA synchronous = FULL");
  if (ready.ok()) ready = database->Execute("PRAGMA wal_autocheckpoint = 2000");
  // What a long reader or a large commit made it beyond this is given back at the next commit.
  if (ready.ok()) ready = database->Execute("PRAGMA journal_size_limit = 33554432");
  if (ready.ok()) ready = LimitSize(*database, options.max_file_bytes);
  if (!ready.ok()) return Annotate(ready, what);
  auto storage = std::make_unique<SqliteStorage>(file, *std::move(database));
  if (const absl::StatusOr<MapInfo> info = storage->writer().reader().GetMapInfo(); !info.ok()) {
    return Annotate(info.status(), what);
  }
  return storage;
}

}  // namespace strata
