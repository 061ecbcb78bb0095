#include "core/storage/postgresql/sql_state.h"

#include <algorithm>
#include <array>

#include "absl/status/status.h"
#include "absl/strings/match.h"
#include "absl/strings/string_view.h"

namespace strata {
namespace {

using Code = absl::StatusCode;

struct Meaning {
  const char* prefix;
  Code code;
};

// The first that fits counts.
constexpr std::array<Meaning, 33> kMeanings = {{
    {"40001", Code::kAborted},            // serialisation failure
    {"40P01", Code::kAborted},            // deadlock
    {"40003", Code::kUnavailable},        // statement completion unknown
    {"08", Code::kUnavailable},           // connection
    {"57P", Code::kUnavailable},          // shut down, crashed, starting
    {"25P03", Code::kUnavailable},        // idle in a transaction for too long: cut
    {"25006", Code::kUnavailable},        // read only: a replica, or a primary that was one
    {"58", Code::kUnavailable},           // its disk
    {"57014", Code::kDeadlineExceeded},   // statement_timeout
    {"55P03", Code::kResourceExhausted},  // lock_timeout
    {"53", Code::kResourceExhausted},     // disk full, memory, connections
    {"54", Code::kResourceExhausted},     // too large for it
    {"23505", Code::kAlreadyExists},      // unique
    {"23514", Code::kInvalidArgument},    // check
    {"22021", Code::kInvalidArgument},    // text that is none in the database's encoding
    {"22P05", Code::kInvalidArgument},    // the same
    {"22P03", Code::kInternal},           // our binary parameter
    {"22", Code::kDataLoss},              // values that sums and casts cannot take
    {"42501", Code::kPermissionDenied},   // privilege
    {"28", Code::kPermissionDenied},      // authentication
    {"3D000", Code::kNotFound},           // database
    {"3F000", Code::kNotFound},           // schema
    // Our text is right, so the database lacks a table or a column that it names, or has it
    // otherwise.
    {"42P01", Code::kDataLoss},
    {"42703", Code::kDataLoss},
    {"42883", Code::kDataLoss},
    {"42804", Code::kDataLoss},
    {"42P10", Code::kDataLoss},
    {"42P18", Code::kDataLoss},
    {"0A000", Code::kUnavailable},  // a table was changed beneath a prepared statement
    {"XX001", Code::kDataLoss},     // corrupted
    {"XX002", Code::kDataLoss},     // index corrupted
    {"F0", Code::kUnavailable},     // configuration
    {"", Code::kInternal},
}};

}  // namespace

absl::StatusCode CodeOfSqlState(absl::string_view state) {
  if (state.empty()) return Code::kUnavailable;
  const auto fits = [state](const Meaning& m) { return absl::StartsWith(state, m.prefix); };
  return std::find_if(kMeanings.begin(), kMeanings.end(), fits)->code;
}

bool MayBeRedone(absl::string_view state) { return state == "40001" || state == "40P01"; }

}  // namespace strata
