#include "core/storage/postgresql/connection.h"

#include <array>
#include <bit>
#include <climits>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include <libpq-fe.h>
#include <poll.h>

#include "core/common/status.h"
#include "core/storage/postgresql/sql_state.h"

namespace strata {
namespace {

// Types by their numbers in pg_type, which never change.
constexpr unsigned kBool = 16;
constexpr unsigned kBytea = 17;
constexpr unsigned kInt8 = 20;
constexpr unsigned kInt2 = 21;
constexpr unsigned kInt4 = 23;
constexpr unsigned kText = 25;
constexpr unsigned kFloat8 = 701;
constexpr unsigned kInt8Array = 1016;

constexpr int kOldestServer = 150'000;  // 15: what is tested

struct ResultDeleter {
  void operator()(PGresult* result) const { PQclear(result); }
};
using Result = std::unique_ptr<PGresult, ResultDeleter>;

template <typename Unsigned>
void AppendBigEndian(Unsigned value, std::string& to) {
  for (int shift = 8 * (sizeof(Unsigned) - 1); shift >= 0; shift -= 8) {
    to.push_back(static_cast<char>(value >> shift & 0xFF));
  }
}

std::uint64_t ReadBigEndian(const char* data, int size) {
  std::uint64_t value = 0;
  for (int i = 0; i < size; ++i) value = value << 8 | static_cast<std::uint8_t>(data[i]);
  return value;
}

// Of a value of that type; -1: any.
int SizeOfType(unsigned type) {
  switch (type) {
    case kBool:
      return 1;
    case kInt2:
      return 2;
    case kInt4:
      return 4;
    case kInt8:
    case kFloat8:
      return 8;
    default:
      return -1;
  }
}

bool IsKnownType(unsigned type) { return SizeOfType(type) > 0 || type == kText || type == kBytea; }

absl::Status CheckValue(const PGresult* result, int row, int column) {
  const int size = SizeOfType(PQftype(result, column));
  if (size < 0 || PQgetisnull(result, row, column) != 0 ||
      PQgetlength(result, row, column) == size) {
    return absl::OkStatus();
  }
  return absl::DataLossError(absl::StrCat("store: column ",
                                          PQfname(result, column),
                                          " has a value of ",
                                          PQgetlength(result, row, column),
                                          " bytes"));
}

// Whoever changed the tables by hand is told here, before anything is read as what it is not.
absl::Status CheckValues(const PGresult* result) {
  for (int column = 0; column < PQnfields(result); ++column) {
    if (IsKnownType(PQftype(result, column)) && PQfformat(result, column) == 1) continue;
    return absl::DataLossError(absl::StrCat(
        "store: column ", PQfname(result, column), " has type ", PQftype(result, column)));
  }
  for (int row = 0; row < PQntuples(result); ++row) {
    for (int column = 0; column < PQnfields(result); ++column) {
      STRATA_RETURN_IF_ERROR(CheckValue(result, row, column));
    }
  }
  return absl::OkStatus();
}

std::string OneLine(const char* message) {
  std::string line(absl::StripAsciiWhitespace(message == nullptr ? "" : message));
  for (char& c : line) c = c == '\n' ? ' ' : c;
  return line;
}

// libpq's words may repeat the address, which may hold a password.
absl::Status CheckAddress(const std::string& where) {
  PQconninfoOption* options = PQconninfoParse(where.c_str(), nullptr);
  if (options == nullptr) {
    return absl::InvalidArgumentError(
        "store: not an address of a PostgreSQL database; "
        "postgresql://USER@HOST/DATABASE is one");
  }
  PQconninfoFree(options);
  return absl::OkStatus();
}

void IgnoreNotice(void*, const PGresult*) {}

}  // namespace

void Parameters::AddValue(unsigned type, const char* data, std::size_t size) {
  too_large_ = too_large_ || size > INT_MAX / 2;
  types_.push_back(type);
  values_.push_back(data == nullptr ? "" : data);  // a null pointer would bind NULL
  lengths_.push_back(static_cast<int>(size));
  formats_.push_back(1);
}

void Parameters::Add(std::int64_t value) {
  const std::size_t at = fixed_.size();
  AppendBigEndian(static_cast<std::uint64_t>(value), fixed_);
  AddValue(kInt8, fixed_.data() + at, 8);
}

void Parameters::Add(double value) {
  const std::size_t at = fixed_.size();
  AppendBigEndian(std::bit_cast<std::uint64_t>(value), fixed_);
  AddValue(kFloat8, fixed_.data() + at, 8);
}

void Parameters::Add(absl::string_view text) { AddValue(kText, text.data(), text.size()); }

void Parameters::Add(Bytea bytes) { AddValue(kBytea, bytes.bytes.data(), bytes.bytes.size()); }

// Dimensions, no NULLs, the type; then of the one dimension size and first index, and each value
// behind its length.
void Parameters::Add(const std::vector<std::int64_t>& values) {
  auto bytes = std::make_unique<std::string>();
  bytes->reserve(20 + 12 * values.size());
  const std::uint32_t dimensions = values.empty() ? 0 : 1;
  for (const std::uint32_t word : {dimensions, std::uint32_t{0}, std::uint32_t{kInt8}}) {
    AppendBigEndian(word, *bytes);
  }
  if (!values.empty()) {
    AppendBigEndian(static_cast<std::uint32_t>(values.size()), *bytes);
    AppendBigEndian(std::uint32_t{1}, *bytes);
  }
  for (const std::int64_t value : values) {
    AppendBigEndian(std::uint32_t{8}, *bytes);
    AppendBigEndian(static_cast<std::uint64_t>(value), *bytes);
  }
  AddValue(kInt8Array, bytes->data(), bytes->size());
  own_.push_back(std::move(bytes));
}

absl::Status Parameters::status() const {
  if (!too_large_) return absl::OkStatus();
  return absl::ResourceExhaustedError("store: a value of more than 1 GiB");
}

Rows::~Rows() { PQclear(result_); }

int Rows::size() const { return PQntuples(result_); }

std::uint64_t Rows::changed() const {
  std::uint64_t rows = 0;
  if (!absl::SimpleAtoi(PQcmdTuples(result_), &rows)) return 0;
  return rows;
}

bool Rows::Next() { return ++row_ < size(); }

std::int64_t Rows::Int(int column) const {
  if (PQgetisnull(result_, row_, column) != 0) return 0;
  const char* data = PQgetvalue(result_, row_, column);
  switch (PQftype(result_, column)) {
    case kBool:
      return data[0] != 0;
    case kInt2:
      return static_cast<std::int16_t>(ReadBigEndian(data, 2));
    case kInt4:
      return static_cast<std::int32_t>(ReadBigEndian(data, 4));
    case kInt8:
      return static_cast<std::int64_t>(ReadBigEndian(data, 8));
    default:
      return 0;
  }
}

double Rows::Real(int column) const {
  if (PQftype(result_, column) != kFloat8 || PQgetisnull(result_, row_, column) != 0) return 0.0;
  return std::bit_cast<double>(ReadBigEndian(PQgetvalue(result_, row_, column), 8));
}

absl::string_view Rows::Bytes(int column) const {
  const int size = PQgetlength(result_, row_, column);
  return {PQgetvalue(result_, row_, column), static_cast<std::size_t>(size)};
}

// What stands before `dbname` counts where the address does not say otherwise.
absl::StatusOr<std::unique_ptr<Connection>> Connection::Open(const std::string& where) {
  constexpr std::array<const char*, 8> kKeywords = {"application_name",
                                                    "connect_timeout",
                                                    "tcp_user_timeout",
                                                    "keepalives_idle",
                                                    "target_session_attrs",
                                                    "dbname",
                                                    "client_encoding",
                                                    nullptr};
  const std::array<const char*, 8> values = {
      "strata", "10", "30000", "10", "read-write", where.c_str(), "UTF8", nullptr};
  STRATA_RETURN_IF_ERROR(CheckAddress(where));
  PGconn* made = PQconnectdbParams(kKeywords.data(), values.data(), /*expand_dbname=*/1);
  if (made == nullptr) return absl::ResourceExhaustedError("store: no memory for a connection");
  std::unique_ptr<Connection> connection(new Connection(made));
  if (PQstatus(made) != CONNECTION_OK) {
    const std::string message = OneLine(PQerrorMessage(made));
    const bool refused =
        PQconnectionNeedsPassword(made) != 0 || PQconnectionUsedPassword(made) != 0;
    return absl::Status(
        refused ? absl::StatusCode::kPermissionDenied : absl::StatusCode::kUnavailable,
        absl::StrCat("store: ", message));
  }
  PQsetNoticeReceiver(made, IgnoreNotice, nullptr);
  STRATA_RETURN_IF_ERROR(connection->CheckServer());
  // Ends those that wait for something frozen, and lets nobody's freezing hold a lock for long.
  STRATA_RETURN_IF_ERROR(connection->Execute(
      "SET lock_timeout = '10s'; SET statement_timeout = '5min'; "
      "SET idle_in_transaction_session_timeout = '20s'; SET default_transaction_isolation = "
      "'read committed'; SET bytea_output = 'hex'; SET extra_float_digits = 3; "
      "SET synchronous_commit = on"));
  return connection;
}

absl::Status Connection::CheckServer() {
  if (PQserverVersion(connection_) < kOldestServer) {
    return absl::FailedPreconditionError(absl::StrCat(
        "store: the server is version ", PQserverVersion(connection_) / 10'000, ", older than 15"));
  }
  const char* encoding = PQparameterStatus(connection_, "server_encoding");
  if (encoding != nullptr && absl::string_view(encoding) == "UTF8") return absl::OkStatus();
  return absl::FailedPreconditionError(
      absl::StrCat("store: the database has encoding ",
                   encoding == nullptr ? "unknown" : encoding,
                   "; make it with ENCODING 'UTF8' TEMPLATE template0"));
}

Connection::~Connection() { PQfinish(connection_); }

absl::Status Connection::StatusOf(const pg_result* result) {
  const ExecStatusType status = PQresultStatus(result);
  if (status == PGRES_COMMAND_OK || status == PGRES_TUPLES_OK || status == PGRES_SINGLE_TUPLE) {
    return absl::OkStatus();
  }
  const char* state = result == nullptr ? nullptr : PQresultErrorField(result, PG_DIAG_SQLSTATE);
  const absl::string_view code = state == nullptr ? "" : state;
  may_be_redone_ = may_be_redone_ || MayBeRedone(code);
  outdated_ = outdated_ || code == "0A000";
  const char* primary =
      result == nullptr ? nullptr : PQresultErrorField(result, PG_DIAG_MESSAGE_PRIMARY);
  const std::string message = OneLine(primary == nullptr ? PQerrorMessage(connection_) : primary);
  // libpq's own: memory, say. Where it could not send it says that the server is gone before it
  // knows that the connection is.
  if (code.empty() && PQconsumeInput(connection_) == 1 && !IsBroken()) {
    return absl::ResourceExhaustedError(absl::StrCat("store: ", message));
  }
  return absl::Status(CodeOfSqlState(code),
                      absl::StrCat("store: ", message, " (", code.empty() ? "cut" : code, ")"));
}

absl::StatusOr<const char*> Connection::Prepare(const char* sql, const Parameters& parameters) {
  const auto found = statements_.find(sql);
  if (found != statements_.end()) return found->second.c_str();
  const std::string name = absl::StrCat("s", statements_.size());
  const Result result(
      PQprepare(connection_, name.c_str(), sql, parameters.count(), parameters.types().data()));
  STRATA_RETURN_IF_ERROR(StatusOf(result.get()));
  return statements_.emplace(sql, name).first->second.c_str();
}

absl::StatusOr<Rows> Connection::Run(const char* sql, const Parameters& parameters) {
  STRATA_RETURN_IF_ERROR(parameters.status());
  STRATA_ASSIGN_OR_RETURN(const char* const name, Prepare(sql, parameters));
  Result result(PQexecPrepared(connection_,
                               name,
                               parameters.count(),
                               parameters.values(),
                               parameters.lengths(),
                               parameters.formats(),
                               /*resultFormat=*/1));
  STRATA_RETURN_IF_ERROR(StatusOf(result.get()));
  STRATA_RETURN_IF_ERROR(CheckValues(result.get()));
  return Rows(result.release());
}

absl::Status Connection::Execute(const char* sql) {
  const Result result(PQexec(connection_, sql));
  return StatusOf(result.get());
}

absl::Status Connection::Stream(const char* sql,
                                const Parameters& parameters,
                                absl::FunctionRef<absl::Status(const Row&)> row) {
  STRATA_RETURN_IF_ERROR(parameters.status());
  STRATA_ASSIGN_OR_RETURN(const char* const name, Prepare(sql, parameters));
  if (PQsendQueryPrepared(connection_,
                          name,
                          parameters.count(),
                          parameters.values(),
                          parameters.lengths(),
                          parameters.formats(),
                          /*resultFormat=*/1) != 1 ||
      PQsetSingleRowMode(connection_) != 1) {
    return StatusOf(nullptr);
  }
  while (true) {
    Result result(PQgetResult(connection_));
    if (result == nullptr) return absl::OkStatus();
    STRATA_RETURN_IF_ERROR(StatusOf(result.get()));
    STRATA_RETURN_IF_ERROR(CheckValues(result.get()));
    Rows rows(result.release());
    while (rows.Next()) STRATA_RETURN_IF_ERROR(row(rows));
  }
}

void CopiedRow::AddSize(std::size_t size) {
  too_large_ = too_large_ || size > INT_MAX / 2;
  AppendBigEndian(static_cast<std::uint32_t>(size), bytes_);
  ++columns_;
}

void CopiedRow::Add(std::int64_t value) {
  AddSize(8);
  AppendBigEndian(static_cast<std::uint64_t>(value), bytes_);
}

void CopiedRow::Add(double value) {
  AddSize(8);
  AppendBigEndian(std::bit_cast<std::uint64_t>(value), bytes_);
}

void CopiedRow::Add(absl::string_view text_or_bytes) {
  AddSize(text_or_bytes.size());
  bytes_.append(text_or_bytes.data(), text_or_bytes.size());
}

absl::Status CopySink::Send(absl::string_view bytes) {
  if (PQputCopyData(connection_, bytes.data(), static_cast<int>(bytes.size())) == 1) {
    return absl::OkStatus();
  }
  return absl::UnavailableError(absl::StrCat("store: ", OneLine(PQerrorMessage(connection_))));
}

absl::Status CopySink::Flush() {
  STRATA_RETURN_IF_ERROR(Send(waiting_));
  waiting_.clear();
  return absl::OkStatus();
}

absl::Status CopySink::Put(const CopiedRow& row) {
  constexpr std::size_t kMostWaiting = std::size_t{64} << 10;
  if (row.too_large_) return absl::ResourceExhaustedError("store: a value of more than 1 GiB");
  AppendBigEndian(static_cast<std::uint16_t>(row.columns_), waiting_);
  waiting_.append(row.bytes_);
  return waiting_.size() < kMostWaiting ? absl::OkStatus() : Flush();
}

// The format: postgresql.org/docs/15/sql-copy.html#id-1.9.3.55.9.4; no flags, no header extension.
absl::Status Connection::CopyIn(const char* sql, absl::FunctionRef<absl::Status(CopySink&)> rows) {
  {
    const Result begun(PQexec(connection_, sql));
    if (PQresultStatus(begun.get()) != PGRES_COPY_IN) return StatusOf(begun.get());
  }
  CopySink sink(connection_);
  sink.waiting_.assign("PGCOPY\n\377\r\n\0\0\0\0\0\0\0\0\0", 19);
  absl::Status put = rows(sink);
  AppendBigEndian(std::uint16_t{0xFFFF}, sink.waiting_);
  if (put.ok()) put = sink.Flush();
  PQputCopyEnd(connection_, put.ok() ? nullptr : "given up");
  absl::Status copied;
  while (true) {
    const Result result(PQgetResult(connection_));
    if (result == nullptr) break;
    if (copied.ok()) copied = StatusOf(result.get());
  }
  if (put.ok() && !IsBroken()) return copied;
  // What the server says of rows that it got is the better reason, unless it only repeats ours.
  return put.ok() ? StatusOf(nullptr) : put;
}

bool Connection::InFailedTransaction() const {
  return PQtransactionStatus(connection_) == PQTRANS_INERROR;
}

bool Connection::InTransaction() const {
  const PGTransactionStatusType status = PQtransactionStatus(connection_);
  return status == PQTRANS_INTRANS || status == PQTRANS_INERROR;
}

bool Connection::IsBroken() const { return PQstatus(connection_) != CONNECTION_OK; }

bool Connection::IsFresh() {
  if (outdated_ || IsBroken() || PQtransactionStatus(connection_) != PQTRANS_IDLE) return false;
  // Nothing is asked, so whatever has come is the server's farewell.
  struct pollfd socket = {PQsocket(connection_), POLLIN, 0};
  return poll(&socket, 1, 0) == 0;
}

}  // namespace strata
