// PostgreSQL's error codes as canonical ones.
#ifndef STRATA_CORE_STORAGE_POSTGRESQL_SQL_STATE_H_
#define STRATA_CORE_STORAGE_POSTGRESQL_SQL_STATE_H_

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace strata {

// `state`: five characters (postgresql.org/docs/15/errcodes-appendix.html); empty: the connection
// is lost.
absl::StatusCode CodeOfSqlState(absl::string_view state);

// Whether the same transaction, begun anew, may do better: a deadlock or a serialisation failure.
bool MayBeRedone(absl::string_view state);

}  // namespace strata

#endif  // STRATA_CORE_STORAGE_POSTGRESQL_SQL_STATE_H_
