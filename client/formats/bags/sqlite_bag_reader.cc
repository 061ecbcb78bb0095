#include "client/formats/bags/sqlite_bag_reader.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include <sqlite3.h>

#include "client/formats/bags/bag_file.h"
#include "core/common/status.h"

namespace strata {
namespace {

constexpr int kMostMissingRows = 10'000;  // one after the other

using BagQuery = std::unique_ptr<sqlite3_stmt, int (*)(sqlite3_stmt*)>;

// Null if SQLite refuses it.
BagQuery Prepare(sqlite3* database, const char* sql) {
  sqlite3_stmt* query = nullptr;
  sqlite3_prepare_v2(database, sql, -1, &query, nullptr);
  return BagQuery(query, &sqlite3_finalize);
}

absl::string_view SqlTextOf(sqlite3_stmt* query, int column) {
  const auto* text = reinterpret_cast<const char*>(sqlite3_column_text(query, column));
  return text == nullptr ? absl::string_view()
                         : absl::string_view(
                               text, static_cast<std::size_t>(sqlite3_column_bytes(query, column)));
}

absl::string_view SqlBlobOf(sqlite3_stmt* query, int column) {
  const auto* blob = static_cast<const char*>(sqlite3_column_blob(query, column));
  return blob == nullptr ? absl::string_view()
                         : absl::string_view(
                               blob, static_cast<std::size_t>(sqlite3_column_bytes(query, column)));
}

}  // namespace

absl::StatusOr<std::unique_ptr<BagReader>> SqliteBagReader::Open(
    const std::filesystem::path& path) {
  sqlite3* opened = nullptr;
  const int result = sqlite3_open_v2(path.c_str(), &opened, SQLITE_OPEN_READONLY, nullptr);
  Database database(opened, &sqlite3_close);
  if (result != SQLITE_OK) {
    return absl::UnavailableError(
        absl::StrCat(path.string(), ": cannot be read: ", sqlite3_errstr(result)));
  }
  // The file is somebody else's: its schema may call nothing.
  sqlite3_db_config(database.get(), SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  sqlite3_db_config(database.get(), SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  sqlite3_db_config(database.get(), SQLITE_DBCONFIG_ENABLE_VIEW, 0, nullptr);
  sqlite3_limit(database.get(), SQLITE_LIMIT_LENGTH, static_cast<int>(kMaxBagPieceBytes / 2));
  std::unique_ptr<SqliteBagReader> reader(new SqliteBagReader(std::move(database), path.string()));
  STRATA_RETURN_IF_ERROR(reader->CheckTables());
  return reader;
}

std::string SqliteBagReader::Fault() const { return sqlite3_errmsg(database_.get()); }

absl::Status SqliteBagReader::CheckTables() {
  const BagQuery query = Prepare(database_.get(),
                                 "SELECT count(*) FROM sqlite_master WHERE type = 'table' AND name "
                                 "IN ('topics', 'messages') AND sql LIKE 'CREATE TABLE%'");
  if (query == nullptr || sqlite3_step(query.get()) != SQLITE_ROW) {
    const bool is_corrupt = sqlite3_errcode(database_.get()) == SQLITE_CORRUPT;
    return absl::InvalidArgumentError(absl::StrCat(
        name_,
        ": ",
        Fault(),
        is_corrupt ? "; sqlite3 FILE .recover | sqlite3 NEW.db3 may save some of it" : ""));
  }
  if (sqlite3_column_int(query.get(), 0) == 2) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(name_, ": an SQLite file without the tables topics and messages of rosbag2"));
}

absl::Status SqliteBagReader::ReadTopics() {
  const BagQuery query =
      Prepare(database_.get(), "SELECT id, name, type, serialization_format FROM topics");
  if (query == nullptr) {
    return absl::InvalidArgumentError(absl::StrCat(name_, ": table topics: ", Fault()));
  }
  int result = SQLITE_ROW;
  while ((result = sqlite3_step(query.get())) == SQLITE_ROW) {
    numbers_[sqlite3_column_int64(query.get(), 0)] =
        TopicNumber(SqlTextOf(query.get(), 1),
                    SqlTextOf(query.get(), 2),
                    MessageEncodingOf(SqlTextOf(query.get(), 3)));
  }
  if (result != SQLITE_DONE) AddDamage(absl::StrCat("table topics: ", Fault()));
  return absl::OkStatus();
}

double SqliteBagReader::progress() const {
  if (last_row_ <= 0) return 0.0;
  return std::clamp(static_cast<double>(row_) / static_cast<double>(last_row_), 0.0, 1.0);
}

absl::Status SqliteBagReader::Visit(Visitor visit) {
  ClearDamage();
  STRATA_RETURN_IF_ERROR(ReadTopics());
  const BagQuery last = Prepare(database_.get(), "SELECT max(rowid) FROM messages");
  if (last != nullptr && sqlite3_step(last.get()) == SQLITE_ROW) {
    last_row_ = sqlite3_column_int64(last.get(), 0);
  }
  // Damage hides rows, nobody knows how many: what comes behind them is looked for row by row.
  row_ = 0;  // not of the visit before
  std::int64_t after = std::numeric_limits<std::int64_t>::min();
  for (int missing = 0; missing <= kMostMissingRows;) {
    STRATA_ASSIGN_OR_RETURN(const bool is_end, VisitAfter(after, visit));
    if (is_end) return absl::OkStatus();
    if (missing == 0 || row_ > after) {
      AddDamage(absl::StrCat("after message ", row_, ": ", Fault()));
    }
    missing = row_ > after ? 1 : missing + 1;
    after = std::max(row_, after);
    if (after == std::numeric_limits<std::int64_t>::max()) break;
    ++after;
  }
  return absl::OkStatus();
}

absl::StatusOr<bool> SqliteBagReader::VisitAfter(std::int64_t after, Visitor visit) {
  const BagQuery query = Prepare(database_.get(),
                                 "SELECT rowid, topic_id, timestamp, data FROM messages WHERE "
                                 "rowid > ? ORDER BY rowid");
  if (query == nullptr) {
    return absl::InvalidArgumentError(absl::StrCat(name_, ": table messages: ", Fault()));
  }
  sqlite3_bind_int64(query.get(), 1, after);
  int result = SQLITE_ROW;
  while ((result = sqlite3_step(query.get())) == SQLITE_ROW) {
    row_ = sqlite3_column_int64(query.get(), 0);
    const auto number = numbers_.find(sqlite3_column_int64(query.get(), 1));
    if (number == numbers_.end()) {
      AddDamage(absl::StrCat("message ", row_, " of no topic is left out"));
      continue;
    }
    STRATA_RETURN_IF_ERROR(visit({.topic = number->second,
                                  .time_ns = sqlite3_column_int64(query.get(), 2),
                                  .bytes = SqlBlobOf(query.get(), 3),
                                  .place = {.chunk = 0, .at = static_cast<std::uint64_t>(row_)}}));
  }
  return result == SQLITE_DONE;
}

absl::StatusOr<std::string> SqliteBagReader::Read(const MessagePlace& place) {
  const BagQuery query = Prepare(database_.get(), "SELECT data FROM messages WHERE rowid = ?");
  if (query != nullptr) {
    sqlite3_bind_int64(query.get(), 1, static_cast<std::int64_t>(place.at));
    if (sqlite3_step(query.get()) == SQLITE_ROW) return std::string(SqlBlobOf(query.get(), 0));
  }
  return absl::DataLossError(absl::StrCat(name_, ": message ", place.at, ": ", Fault()));
}

}  // namespace strata
