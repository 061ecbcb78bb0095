// RAII around SQLite: a connection, its statements and transactions. sqlite3.h stays in this
// folder's sources.
#ifndef STRATA_CORE_STORAGE_SQLITE_DATABASE_H_
#define STRATA_CORE_STORAGE_SQLITE_DATABASE_H_

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <utility>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/common/stop.h"
#include "core/storage/row.h"

struct sqlite3;
struct sqlite3_stmt;

namespace strata {

// Marks bytes to be bound as a BLOB.
struct Blob {
  absl::string_view bytes;
};

// A prepared statement on loan from its connection; goes back, reset, when it is destroyed. The
// first error of a bind is kept and answered by Step() or Run().
class Statement final : public Row {
 public:
  explicit Statement(sqlite3_stmt* statement) : statement_(statement) {}
  ~Statement() override;
  Statement(Statement&& other) noexcept : statement_(std::exchange(other.statement_, nullptr)) {}
  Statement& operator=(Statement&&) = delete;

  // Binds all parameters in order.
  template <typename... Values>
  Statement& Bind(const Values&... values) {
    int index = 0;
    (BindOne(++index, values), ...);
    return *this;
  }
  void BindOne(int index, std::int64_t value);
  void BindOne(int index, std::uint64_t value) { BindOne(index, static_cast<std::int64_t>(value)); }
  void BindOne(int index, int value) { BindOne(index, std::int64_t{value}); }
  void BindOne(int index, std::uint32_t value) { BindOne(index, std::int64_t{value}); }
  void BindOne(int index, bool value) { BindOne(index, std::int64_t{value}); }
  void BindOne(int index, double value);
  void BindOne(int index, absl::string_view text);
  void BindOne(int index, const std::string& text) { BindOne(index, absl::string_view(text)); }
  void BindOne(int index, Blob blob);

  // How many there are.
  int parameters() const;

  // True with a row, false at the end.
  absl::StatusOr<bool> Step();
  // Steps to the end.
  absl::Status Run();

  std::int64_t Int(int column) const override;
  double Real(int column) const override;
  absl::string_view Bytes(int column) const override;

 private:
  void Keep(int code);

  sqlite3_stmt* statement_;
  int bind_error_ = 0;
};

// A connection; one thread at a time.
class Database {
 public:
  enum class Mode { kCreate, kWrite, kRead, kReadAtRest };

  // kCreate makes a new file, closed to others than user and group, and fails with ALREADY_EXISTS
  // if there is one; the others want one. kReadAtRest reads the file alone, and leaves nothing
  // beside it: it must have no log, and nobody may write it meanwhile.
  static absl::StatusOr<Database> Open(const std::filesystem::path& file, Mode mode);
  ~Database();
  Database(Database&& other) noexcept
      : connection_(std::exchange(other.connection_, nullptr)),
        statements_(std::exchange(other.statements_, {})) {}
  Database& operator=(Database&&) = delete;

  // Prepared once a connection; `sql` must live as long as the connection (a literal), and two
  // loans of the same literal must not overlap.
  absl::StatusOr<Statement> Prepare(const char* sql);
  // One or more statements without parameters or results.
  absl::Status Execute(const std::string& sql);
  absl::StatusOr<std::int64_t> Pragma(const char* sql);
  // Copies one committed state page by page, each to where it was: of two copies only those pages
  // differ that were changed between them. ALREADY_EXISTS; the errors of CheckPages(), which the
  // copy has to pass. An error leaves an unusable file.
  absl::Status CopyTo(const std::filesystem::path& file, const Stop& stop);
  // DATA_LOSS, naming the first fault, if the pages do not hang together; UNAVAILABLE if the disk
  // does not give them; CANCELLED, DEADLINE_EXCEEDED by `stop`.
  absl::Status CheckPages(const Stop& stop);
  // Whether the file under its name is still the one that is open.
  bool InPlace() const;
  std::filesystem::path File() const;
  // Its write-ahead log, where there is one.
  std::filesystem::path LogFile() const;

 private:
  friend class Transaction;
  explicit Database(sqlite3* connection) : connection_(connection) {}

  sqlite3* connection_;
  std::map<const char*, sqlite3_stmt*> statements_;
};

// `begin` … "COMMIT"; rolled back on destruction unless Commit() succeeded.
class Transaction {
 public:
  // `begin`: "BEGIN" for reads, "BEGIN IMMEDIATE" for writes.
  static absl::StatusOr<Transaction> Begin(Database& database, const char* begin);
  ~Transaction();
  Transaction(Transaction&& other) noexcept : database_(std::exchange(other.database_, nullptr)) {}
  Transaction& operator=(Transaction&&) = delete;

  absl::Status Commit();

 private:
  explicit Transaction(Database& database) : database_(&database) {}
  Database* database_;
};

// Calls `row` for every row of `statement`.
absl::Status ForEachRow(Statement& statement, absl::FunctionRef<absl::Status()> row);

}  // namespace strata

#endif  // STRATA_CORE_STORAGE_SQLITE_DATABASE_H_
