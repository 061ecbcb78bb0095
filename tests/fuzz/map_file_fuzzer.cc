// A map's file whose rows are not what this program wrote: every call answers, and what it cannot
// answer it refuses as damage, never as our own fault.
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include <fuzzer/FuzzedDataProvider.h>
#include <glog/logging.h>
#include <sqlite3.h>

#include "core/codec/blob.h"
#include "core/codec/bytes.h"
#include "core/common/checksum.h"
#include "core/engine/engine.h"
#include "core/engine/map/map_check.h"
#include "tests/core/engine/engine_fixture.h"
#include "tests/fuzz/require.h"
#include "tests/fuzz/small_world.h"
#include "tests/support/temp_dir.h"

namespace strata::fuzz {
namespace {

constexpr std::size_t kChecksumBytes = 8;
constexpr int kMostEdits = 8;

using Database = std::unique_ptr<sqlite3, decltype(&sqlite3_close)>;
using Statement = std::unique_ptr<sqlite3_stmt, decltype(&sqlite3_finalize)>;

// nullptr for a table that an edit has damaged so that SQLite does not open it: those of an R-tree.
Statement Prepare(sqlite3* database, const std::string& sql) {
  sqlite3_stmt* statement = nullptr;
  sqlite3_prepare_v2(database, sql.c_str(), -1, &statement, nullptr);
  return {statement, &sqlite3_finalize};
}

std::vector<std::string> TablesOf(sqlite3* database) {
  const Statement statement =
      Prepare(database,
              "SELECT name FROM sqlite_schema WHERE type = 'table' AND name NOT LIKE 'sqlite%' "
              "ORDER BY name");
  Require(statement != nullptr, "the tables are told");
  std::vector<std::string> names;
  while (sqlite3_step(statement.get()) == SQLITE_ROW) {
    names.emplace_back(reinterpret_cast<const char*>(sqlite3_column_text(statement.get(), 0)));
  }
  return names;
}

void DamageBytes(FuzzedDataProvider& input, std::string& bytes) {
  const auto position = input.ConsumeIntegralInRange<std::size_t>(0, bytes.size());
  switch (input.ConsumeIntegralInRange(0, 2)) {
    case 0:
      return bytes.resize(position);
    case 1:
      bytes.insert(position, input.ConsumeRandomLengthString(32));
      return;
    default:
      if (position < bytes.size()) bytes[position] = input.ConsumeIntegral<char>();
  }
}

// With bytes changed; at will behind a right checksum, as an envelope's (core/codec/blob.h) and all
// other values' is: of all before.
std::string Damaged(FuzzedDataProvider& input, std::string bytes) {
  const bool resealed = input.ConsumeBool() && bytes.size() >= kChecksumBytes;
  if (resealed) bytes.resize(bytes.size() - kChecksumBytes);
  DamageBytes(input, bytes);
  constexpr std::size_t kLengthAt = 8;
  if (resealed && bytes.size() >= kBlobOverheadBytes && bytes[0] == 'S') {
    std::string length;
    PutFixed(length,
             static_cast<std::uint32_t>(bytes.size() + kChecksumBytes - kBlobOverheadBytes));
    bytes.replace(kLengthAt, length.size(), length);
  }
  if (resealed) PutFixed(bytes, Checksum64(bytes));
  return bytes;
}

void BindDamaged(FuzzedDataProvider& input, sqlite3_value* old, sqlite3_stmt* update) {
  switch (sqlite3_value_type(old)) {
    case SQLITE_INTEGER:
      sqlite3_bind_int64(update,
                         1,
                         input.ConsumeBool() ? input.ConsumeIntegralInRange(-2, 6)
                                             : input.ConsumeIntegral<std::int64_t>());
      return;
    case SQLITE_FLOAT:
      sqlite3_bind_double(update, 1, input.ConsumeFloatingPoint<double>());
      return;
    default: {
      const auto* begin = static_cast<const char*>(sqlite3_value_blob(old));
      const std::string value = Damaged(
          input, std::string(begin, begin + static_cast<std::size_t>(sqlite3_value_bytes(old))));
      const int size = static_cast<int>(value.size());
      if (sqlite3_value_type(old) == SQLITE_BLOB) {
        sqlite3_bind_blob(update, 1, value.data(), size, SQLITE_TRANSIENT);
      } else {
        sqlite3_bind_text(update, 1, value.data(), size, SQLITE_TRANSIENT);
      }
    }
  }
}

// Changes a value of a row of a table, or takes the row out. What the table's own rules forbid does
// not happen.
void Edit(FuzzedDataProvider& input, sqlite3* database, const std::vector<std::string>& tables) {
  const std::string& table =
      tables[input.ConsumeIntegralInRange<std::size_t>(0, tables.size() - 1)];
  const int row = input.ConsumeIntegralInRange(0, 15);
  const Statement select =
      Prepare(database, absl::StrCat("SELECT * FROM ", table, " LIMIT 1 OFFSET ", row));
  if (select == nullptr || sqlite3_step(select.get()) != SQLITE_ROW) return;
  const int columns = sqlite3_column_count(select.get());
  std::vector<std::string> same;
  for (int i = 0; i < columns; ++i) {
    same.push_back(absl::StrCat(sqlite3_column_name(select.get(), i), " IS ?", i + 2));
  }
  const int column = input.ConsumeIntegralInRange(0, columns - 1);
  const bool remove = input.ConsumeIntegralInRange(0, 7) == 0;
  const std::string what =
      remove ? absl::StrCat("DELETE FROM ", table)
             : absl::StrCat(
                   "UPDATE ", table, " SET ", sqlite3_column_name(select.get(), column), " = ?1");
  const Statement change =
      Prepare(database, absl::StrCat(what, " WHERE ", absl::StrJoin(same, " AND ")));
  if (change == nullptr) return;
  for (int i = 0; i < columns; ++i) {
    sqlite3_bind_value(change.get(), i + 2, sqlite3_column_value(select.get(), i));
  }
  if (!remove) BindDamaged(input, sqlite3_column_value(select.get(), column), change.get());
  sqlite3_step(change.get());
}

void EditFile(FuzzedDataProvider& input, const std::filesystem::path& file) {
  sqlite3* opened = nullptr;
  Require(sqlite3_open(file.c_str(), &opened) == SQLITE_OK, "a copy opens");
  const Database database(opened, &sqlite3_close);
  sqlite3_exec(opened, "PRAGMA synchronous = OFF; BEGIN", nullptr, nullptr, nullptr);
  const std::vector<std::string> tables = TablesOf(opened);
  for (int i = 0; i < kMostEdits && input.remaining_bytes() > 0; ++i) Edit(input, opened, tables);
  sqlite3_exec(opened, "COMMIT", nullptr, nullptr, nullptr);
}

void AskScans(api::Database& database) {
  api::Scans& scans = database.scans();
  std::vector<ScanId> ids;
  RequireGoodRefusal(scans.List({}, kWorld, {}, [&](const ScanInfo& scan) {
    ids.push_back(scan.header.id);
    return absl::OkStatus();
  }));
  for (const ScanId& id : ids) {
    RequireGoodRefusal(scans.Get({}, kWorld, id).status());
    RequireGoodRefusal(
        scans.GetPoints({}, kWorld, id, [](const PointCloud&) { return absl::OkStatus(); }));
    RequireGoodRefusal(scans.GetFaded({}, kWorld, id).status());
    RequireGoodRefusal(database.posegraph().LookupPose({}, kWorld, id).status());
  }
  RequireGoodRefusal(scans.GetUploadState({}, kWorld, kWorld).status());
}

void AskTiles(api::Database& database) {
  for (const int level : {0, 1}) {
    const auto tiles = database.tiles().List({}, kWorld, {.level = level});
    RequireGoodRefusal(tiles.status());
    if (!tiles.ok()) continue;
    for (const api::TileInfo& tile : *tiles) {
      RequireGoodRefusal(database.tiles().Get({}, kWorld, tile.key).status());
    }
  }
  const auto ignore = [](const api::TileUpdate&) { return absl::OkStatus(); };
  RequireGoodRefusal(database.tiles().Fetch({}, kWorld, {.epoch = 1}, {}, ignore));
  PlanQuery query;
  query.from = {.x_m = -6.0, .y_m = 0.7};
  query.to = {.x_m = 1.0, .y_m = 2.0};
  query.profile = kWorldRobot;
  RequireGoodRefusal(database.planning().PlanPath({}, kWorld, query).status());
}

void AskRest(api::Database& database) {
  RequireGoodRefusal(database.maps().Stats({}, kWorld).status());
  RequireGoodRefusal(database.maps().History({}, kWorld).status());
  RequireGoodRefusal(database.maps().ListClasses({}, kWorld).status());
  RequireGoodRefusal(database.planning().ListProfiles({}, kWorld).status());
  RequireGoodRefusal(database.posegraph().Get({}, kWorld).status());
  RequireGoodRefusal(database.jobs().List({}, kWorld).status());
  RequireGoodRefusal(database.classifiers().List({}, kWorld).status());
  RequireGoodRefusal(database.classifiers().Export(
      {}, kWorld, kWorldClassifier, [](absl::string_view) { return absl::OkStatus(); }));
}

// The scan whose upload broke off goes on, and another is taken in beside what is damaged.
void Change(api::Database& database) {
  const PointCloud cloud = testing::MakeRoom(9, 50);
  const ScanHeader header = testing::HeaderOf({"run", 1}, cloud, testing::PoseAt(0.0, 0.0));
  RequireGoodRefusal(testing::Upload(database, header, cloud, 50, kWorld).status());
  const auto [announced, whole] = BrokenOffScan();
  RequireGoodRefusal(testing::Upload(database, announced, whole, 100, kWorld).status());
  RequireGoodRefusal(database.scans().Delete({}, kWorld, {kWorld, 2}));
}

void Work(api::Database& database, const std::string& kind) {
  const auto job = database.jobs().Start({}, kWorld, kind, {});
  RequireGoodRefusal(job.status());
  if (!job.ok()) return;
  JobInfo last;
  RequireGoodRefusal(database.jobs().Watch({}, kWorld, job->id, [&](const JobInfo& info) {
    last = info;
    return absl::OkStatus();
  }));
  Require(last.state != JobState::kFailed || !last.message.empty(), "a job that fails says why");
}

void AskAll(const std::filesystem::path& maps, int then) {
  const auto opened = OpenEngine({.directory = maps, .cache_bytes = std::size_t{16} << 20});
  RequireGoodRefusal(opened.status());
  if (!opened.ok()) return;
  api::Database& database = **opened;
  AskScans(database);
  AskTiles(database);
  AskRest(database);
  if (then == 1) Change(database);
  if (then == 2) Work(database, "verify");
  if (then == 3) Work(database, "rebuild");
  if (then == 4) Work(database, "optimize");
}

void TryEdits(FuzzedDataProvider& input) {
  static const auto* const content = [] {
    FLAGS_minloglevel = google::GLOG_ERROR;
    return new SmallWorld();
  }();
  const testing::TempDir directory;
  const std::filesystem::path maps = directory.path() / "maps";
  content->CopyTo(maps);
  const int then = input.ConsumeIntegralInRange(0, 7);
  EditFile(input, maps / "world.strata");
  RequireGoodRefusal(CheckMapFiles(maps).status());
  AskAll(maps, then);
}

}  // namespace
}  // namespace strata::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzedDataProvider input(data, size);
  strata::fuzz::TryEdits(input);
  return 0;
}
