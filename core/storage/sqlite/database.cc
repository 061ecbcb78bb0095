#include "core/storage/sqlite/database.h"

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <system_error>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/string_view.h"
#include <sqlite3.h>

#include "core/common/guarded.h"
#include "core/common/status.h"

namespace strata {
namespace {

absl::StatusCode CodeOf(int sqlite_code) {
  switch (sqlite_code & 0xFF) {
    case SQLITE_CORRUPT:
    case SQLITE_NOTADB:
    case SQLITE_FORMAT:
      return absl::StatusCode::kDataLoss;
    case SQLITE_FULL:
    case SQLITE_NOMEM:
    case SQLITE_TOOBIG:
      return absl::StatusCode::kResourceExhausted;
    case SQLITE_PERM:
    case SQLITE_READONLY:
      return absl::StatusCode::kPermissionDenied;
    case SQLITE_CONSTRAINT:
      return absl::StatusCode::kAlreadyExists;
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
    case SQLITE_IOERR:
    case SQLITE_CANTOPEN:
      return absl::StatusCode::kUnavailable;
    default:
      return absl::StatusCode::kInternal;
  }
}

absl::Status StatusOf(int code, sqlite3* connection) {
  if (code == SQLITE_OK) return absl::OkStatus();
  const char* detail = connection == nullptr ? sqlite3_errstr(code) : sqlite3_errmsg(connection);
  return absl::Status(CodeOf(code), absl::StrCat("store: ", detail, " (sqlite ", code, ")"));
}

// The status of what quick_check found first. Pages that the disk did not give are no damage; it
// says so with a code, or in chains of pages without (numbers beyond the file's end it tells apart
// before).
absl::Status StatusOfCheck(const std::string& found) {
  if (found == "ok") return absl::OkStatus();
  constexpr char kCode[] = "error code=";
  const std::size_t at = found.find(kCode);
  const int code = at == std::string::npos ? 0 : std::atoi(found.c_str() + at + sizeof(kCode) - 1);
  const bool unread =
      (code & 0xFF) == SQLITE_IOERR || found.find("failed to get page") != std::string::npos;
  if (!unread) return absl::DataLossError(absl::StrCat("store: ", found));
  return absl::UnavailableError(
      absl::StrCat("store: the disk did not give a page: ", found, "; look after it, then retry"));
}

// SQLite makes files that everybody may read. This one is still empty, and what comes to lie beside
// it gets its mode.
void CloseToOthers(const std::filesystem::path& file) {
  namespace fs = std::filesystem;
  std::error_code error;  // of a file system without modes
  fs::permissions(file, fs::perms::others_all, fs::perm_options::remove, error);
}

// sqlite.org/uri.html
std::string UriAtRest(const std::filesystem::path& file) {
  std::string uri = "file:";
  for (const char c : std::filesystem::absolute(file).string()) {
    if (absl::ascii_isalnum(static_cast<unsigned char>(c)) || c == '/' || c == '.') {
      uri += c;
    } else {
      absl::StrAppendFormat(&uri, "%%%02X", static_cast<unsigned>(static_cast<unsigned char>(c)));
    }
  }
  return uri + "?immutable=1";
}

}  // namespace

Statement::~Statement() {
  if (statement_ == nullptr) return;
  sqlite3_reset(statement_);
  sqlite3_clear_bindings(statement_);
}

void Statement::Keep(int code) {
  if (bind_error_ == SQLITE_OK) bind_error_ = code;
}

int Statement::parameters() const { return sqlite3_bind_parameter_count(statement_); }

void Statement::BindOne(int index, std::int64_t value) {
  Keep(sqlite3_bind_int64(statement_, index, value));
}

void Statement::BindOne(int index, double value) {
  Keep(sqlite3_bind_double(statement_, index, value));
}

// A null pointer would bind NULL, which an empty string is not.
void Statement::BindOne(int index, absl::string_view text) {
  const char* data = text.data() == nullptr ? "" : text.data();
  Keep(sqlite3_bind_text64(statement_, index, data, text.size(), SQLITE_TRANSIENT, SQLITE_UTF8));
}

// The caller's bytes live until the statement has run: no copy.
void Statement::BindOne(int index, Blob blob) {
  const char* data = blob.bytes.data() == nullptr ? "" : blob.bytes.data();
  Keep(sqlite3_bind_blob64(statement_, index, data, blob.bytes.size(), SQLITE_STATIC));
}

absl::StatusOr<bool> Statement::Step() {
  if (bind_error_ != SQLITE_OK) return StatusOf(bind_error_, sqlite3_db_handle(statement_));
  const int code = sqlite3_step(statement_);
  if (code == SQLITE_ROW) return true;
  if (code == SQLITE_DONE) return false;
  return StatusOf(code, sqlite3_db_handle(statement_));
}

absl::Status Statement::Run() {
  while (true) {
    STRATA_ASSIGN_OR_RETURN(const bool more, Step());
    if (!more) return absl::OkStatus();
  }
}

std::int64_t Statement::Int(int column) const { return sqlite3_column_int64(statement_, column); }

double Statement::Real(int column) const { return sqlite3_column_double(statement_, column); }

absl::string_view Statement::Bytes(int column) const {
  const void* data = sqlite3_column_blob(statement_, column);
  const int size = sqlite3_column_bytes(statement_, column);
  if (data == nullptr || size <= 0) return {};
  return {static_cast<const char*>(data), static_cast<std::size_t>(size)};
}

absl::StatusOr<Database> Database::Open(const std::filesystem::path& file, Mode mode) {
  std::error_code ignored;
  const bool exists = std::filesystem::exists(file, ignored);
  if (mode == Mode::kCreate && exists) {
    return absl::AlreadyExistsError(absl::StrCat("file ", file.filename().string(), " exists"));
  }
  if (mode != Mode::kCreate && !exists) {
    return absl::NotFoundError(absl::StrCat("file ", file.filename().string(), " is not there"));
  }
  int flags = SQLITE_OPEN_NOMUTEX | SQLITE_OPEN_EXRESCODE;
  if (mode == Mode::kRead || mode == Mode::kReadAtRest) {
    flags |= SQLITE_OPEN_READONLY;
  } else {
    flags |= SQLITE_OPEN_READWRITE | (mode == Mode::kCreate ? SQLITE_OPEN_CREATE : 0);
  }
  sqlite3* connection = nullptr;
  const bool at_rest = mode == Mode::kReadAtRest;
  if (at_rest) flags |= SQLITE_OPEN_URI;
  const std::string name = at_rest ? UriAtRest(file) : file.string();
  const int code = sqlite3_open_v2(name.c_str(), &connection, flags, nullptr);
  Database database(connection);
  STRATA_RETURN_IF_ERROR(StatusOf(code, connection));
  if (mode == Mode::kCreate) CloseToOthers(file);
  sqlite3_busy_timeout(connection, 10'000);
  // Stored bytes are hostile: no schema in a file may run functions or write shadow tables.
  sqlite3_db_config(connection, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  sqlite3_db_config(connection, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  return database;
}

Database::~Database() {
  for (const auto& [sql, statement] : statements_) sqlite3_finalize(statement);
  sqlite3_close_v2(connection_);
}

absl::StatusOr<Statement> Database::Prepare(const char* sql) {
  sqlite3_stmt*& statement = statements_[sql];
  if (statement == nullptr) {
    const int code =
        sqlite3_prepare_v3(connection_, sql, -1, SQLITE_PREPARE_PERSISTENT, &statement, nullptr);
    // Our text is right, so the file lacks a table or a column that the text names.
    if (code == SQLITE_ERROR) {
      return absl::DataLossError(absl::StrCat("store: ", sqlite3_errmsg(connection_)));
    }
    STRATA_RETURN_IF_ERROR(StatusOf(code, connection_));
  }
  return Statement(statement);
}

absl::Status Database::Execute(const std::string& sql) {
  return StatusOf(sqlite3_exec(connection_, sql.c_str(), nullptr, nullptr, nullptr), connection_);
}

absl::Status Database::CopyTo(const std::filesystem::path& file, const Stop& stop) {
  constexpr int kPagesBetweenLooks = 128;
  STRATA_RETURN_IF_ERROR(stop.status());
  STRATA_ASSIGN_OR_RETURN(Database copy, Open(file, Mode::kCreate));
  // Without one state for all steps, every commit meanwhile would make it begin again.
  STRATA_ASSIGN_OR_RETURN(Transaction one_state, Transaction::Begin(*this, "BEGIN"));
  STRATA_RETURN_IF_ERROR(Pragma("PRAGMA schema_version").status());
  sqlite3_backup* const backup = sqlite3_backup_init(copy.connection_, "main", connection_, "main");
  if (backup == nullptr) return StatusOf(sqlite3_errcode(copy.connection_), copy.connection_);
  int code = SQLITE_OK;
  while (code == SQLITE_OK && stop.status().ok()) {
    code = sqlite3_backup_step(backup, kPagesBetweenLooks);
  }
  sqlite3_backup_finish(backup);
  STRATA_RETURN_IF_ERROR(stop.status());
  if (code != SQLITE_DONE) return StatusOf(code, nullptr);
  STRATA_RETURN_IF_ERROR(one_state.Commit());
  STRATA_RETURN_IF_ERROR(copy.Execute("PRAGMA journal_mode = DELETE"));  // one file is the whole
  return copy.CheckPages(stop);
}

absl::Status Database::CheckPages(const Stop& stop) {
  constexpr int kInstructionsBetweenLooks = 10'000;
  const auto stopped = [](void* asked) {
    return static_cast<const Stop*>(asked)->status().ok() ? 0 : 1;
  };
  Stop asked = stop;
  sqlite3_progress_handler(connection_, kInstructionsBetweenLooks, stopped, &asked);
  const auto check = [this]() -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(Statement found, Prepare("PRAGMA quick_check(1)"));
    STRATA_ASSIGN_OR_RETURN(const bool row, found.Step());
    return StatusOfCheck(row ? found.Text(0) : "no answer");
  };
  const absl::Status checked = check();
  sqlite3_progress_handler(connection_, 0, nullptr, nullptr);
  STRATA_RETURN_IF_ERROR(stop.status());
  return checked;
}

absl::StatusOr<std::int64_t> Database::Pragma(const char* sql) {
  STRATA_ASSIGN_OR_RETURN(Statement statement, Prepare(sql));
  STRATA_ASSIGN_OR_RETURN(const bool row, statement.Step());
  if (!row) return absl::InternalError(absl::StrCat("store: no answer to ", sql));
  return statement.Int(0);
}

bool Database::InPlace() const {
  int moved = 0;
  return sqlite3_file_control(connection_, "main", SQLITE_FCNTL_HAS_MOVED, &moved) != SQLITE_OK ||
         moved == 0;
}

std::filesystem::path Database::File() const { return sqlite3_db_filename(connection_, "main"); }

std::filesystem::path Database::LogFile() const {
  return sqlite3_filename_wal(sqlite3_db_filename(connection_, "main"));
}

absl::StatusOr<Transaction> Transaction::Begin(Database& database, const char* begin) {
  // One that could not be rolled back for want of memory.
  if (sqlite3_get_autocommit(database.connection_) == 0) {
    STRATA_RETURN_IF_ERROR(database.Execute("ROLLBACK"));
  }
  STRATA_RETURN_IF_ERROR(database.Execute(begin));
  return Transaction(database);
}

Transaction::~Transaction() {
  // After some errors SQLite has rolled back by itself; then this one fails and changes nothing.
  if (database_ == nullptr) return;
  Guarded([this] { return database_->Execute("ROLLBACK"); }).IgnoreError();
}

absl::Status Transaction::Commit() {
  STRATA_RETURN_IF_ERROR(database_->Execute("COMMIT"));
  database_ = nullptr;
  return absl::OkStatus();
}

absl::Status ForEachRow(Statement& statement, absl::FunctionRef<absl::Status()> row) {
  while (true) {
    STRATA_ASSIGN_OR_RETURN(const bool more, statement.Step());
    if (!more) return absl::OkStatus();
    STRATA_RETURN_IF_ERROR(row());
  }
}

}  // namespace strata
