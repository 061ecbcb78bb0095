// RAII around libpq: a connection, its prepared statements, their rows. libpq-fe.h stays in this
// folder's sources. Values go and come in binary; nothing is ever written into SQL.
#ifndef STRATA_CORE_STORAGE_POSTGRESQL_CONNECTION_H_
#define STRATA_CORE_STORAGE_POSTGRESQL_CONNECTION_H_

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/types/span.h"

#include "core/storage/row.h"

struct pg_conn;
struct pg_result;

namespace strata {

// Marks bytes to be bound as bytea.
struct Bytea {
  absl::string_view bytes;
};

// Parameters of one statement, in the order of $1, $2, …: bigint, double precision, text, bytea,
// bigint[]. Bytes and texts must outlive it.
class Parameters {
 public:
  template <typename... Values>
  explicit Parameters(const Values&... values) {
    fixed_.reserve(8 * sizeof...(values));  // so that it does not move
    (Add(values), ...);
  }

  int count() const { return static_cast<int>(values_.size()); }
  const std::vector<unsigned>& types() const { return types_; }
  const char* const* values() const { return values_.data(); }
  const int* lengths() const { return lengths_.data(); }
  const int* formats() const { return formats_.data(); }
  // OK, or RESOURCE_EXHAUSTED for more bytes than a message takes.
  absl::Status status() const;

 private:
  void Add(std::int64_t value);
  void Add(std::uint64_t value) { Add(static_cast<std::int64_t>(value)); }
  void Add(int value) { Add(std::int64_t{value}); }
  void Add(std::uint32_t value) { Add(std::int64_t{value}); }
  void Add(bool value) { Add(std::int64_t{value}); }
  void Add(double value);
  void Add(absl::string_view text);
  void Add(const std::string& text) { Add(absl::string_view(text)); }
  void Add(const char* text) { Add(absl::string_view(text)); }
  void Add(Bytea bytes);
  void Add(const std::vector<std::int64_t>& values);
  void AddValue(unsigned type, const char* data, std::size_t size);

  std::string fixed_;                              // numbers, in network order
  std::vector<std::unique_ptr<std::string>> own_;  // arrays
  std::vector<unsigned> types_;
  std::vector<const char*> values_;
  std::vector<int> lengths_;
  std::vector<int> formats_;
  bool too_large_ = false;
};

// The rows of one answer, the cursor before the first. NULL reads as 0 or no bytes; columns of
// other types than ours have made the query fail.
class Rows final : public Row {
 public:
  explicit Rows(pg_result* result) : result_(result) {}
  ~Rows() override;
  Rows(Rows&& other) noexcept
      : result_(std::exchange(other.result_, nullptr)), row_(std::exchange(other.row_, -1)) {}
  Rows& operator=(Rows&&) = delete;

  int size() const;
  // Rows that a statement without an answer changed.
  std::uint64_t changed() const;
  // To the next row; false behind the last.
  bool Next();

  std::int64_t Int(int column) const override;
  double Real(int column) const override;
  absl::string_view Bytes(int column) const override;

 private:
  pg_result* result_;
  int row_ = -1;
};

// A row on its way into a table, column by column, the map first.
class CopiedRow {
 public:
  explicit CopiedRow(std::int64_t map) { Add(map); }

  void Add(std::int64_t value);
  void Add(double value);
  void Add(absl::string_view text_or_bytes);

 private:
  friend class CopySink;
  void AddSize(std::size_t size);

  std::int16_t columns_ = 0;
  std::string bytes_;  // as COPY takes them
  bool too_large_ = false;
};

// Takes the rows of one COPY.
class CopySink {
 public:
  // Waits while the server takes them; of what the table refuses it may hear later.
  absl::Status Put(const CopiedRow& row);

 private:
  friend class Connection;
  explicit CopySink(pg_conn* connection) : connection_(connection) {}
  absl::Status Send(absl::string_view bytes);
  absl::Status Flush();

  pg_conn* connection_;
  std::string waiting_;  // a few rows
};

// One thread at a time.
class Connection {
 public:
  // `where`: a connection string or address (postgresql.org/docs/15/libpq-connect.html).
  // UNAVAILABLE where nobody answers, PERMISSION_DENIED, NOT_FOUND for its database,
  // FAILED_PRECONDITION for a server that is too old or has another encoding than UTF-8. Messages
  // hold no password.
  static absl::StatusOr<std::unique_ptr<Connection>> Open(const std::string& where);
  ~Connection();
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  // Prepared once a connection; `sql` is a literal.
  template <typename... Values>
  absl::StatusOr<Rows> Query(const char* sql, const Values&... values) {
    return Run(sql, Parameters(values...));
  }
  // The number of rows that it changed.
  template <typename... Values>
  absl::StatusOr<std::uint64_t> Change(const char* sql, const Values&... values) {
    absl::StatusOr<Rows> rows = Run(sql, Parameters(values...));
    if (!rows.ok()) return rows.status();
    return rows->changed();
  }
  // One or more statements without parameters or results.
  absl::Status Execute(const char* sql);
  // Calls `row` for each row as it arrives, so that one is in memory at a time. After an error the
  // connection is broken.
  absl::Status Stream(const char* sql,
                      const Parameters& parameters,
                      absl::FunctionRef<absl::Status(const Row&)> row);

  // Runs `sql`, "COPY … FROM STDIN (FORMAT binary)", on the rows that `rows` puts. An error of
  // either undoes all of it; the connection can be used.
  absl::Status CopyIn(const char* sql, absl::FunctionRef<absl::Status(CopySink&)> rows);

  // Of the last call that failed: whether its transaction, begun anew, may do better.
  bool may_be_redone() const { return may_be_redone_; }
  void ForgetError() { may_be_redone_ = false; }
  // Whether the open transaction can only be rolled back.
  bool InFailedTransaction() const;
  bool InTransaction() const;
  // Whether it can be used: in no transaction, and the server has not hung up.
  bool IsFresh();
  bool IsBroken() const;

 private:
  explicit Connection(pg_conn* connection) : connection_(connection) {}
  absl::StatusOr<Rows> Run(const char* sql, const Parameters& parameters);
  // The name of the prepared statement.
  absl::StatusOr<const char*> Prepare(const char* sql, const Parameters& parameters);
  absl::Status StatusOf(const pg_result* result);
  absl::Status CheckServer();

  pg_conn* connection_;
  std::map<const char*, std::string> statements_;
  bool may_be_redone_ = false;
  bool outdated_ = false;  // a table has changed beneath its prepared statements
};

}  // namespace strata

#endif  // STRATA_CORE_STORAGE_POSTGRESQL_CONNECTION_H_
