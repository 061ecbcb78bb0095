// The database over gRPC: connect, then use it as if it were in the process.
//
//   STRATA_ASSIGN_OR_RETURN(auto db, strata::Connect({.target = "127.0.0.1:50051"}));
//   STRATA_ASSIGN_OR_RETURN(auto stats, db->maps().Stats({}, "campus"));
#ifndef STRATA_CLIENT_SDK_CLIENT_H_
#define STRATA_CLIENT_SDK_CLIENT_H_

#include <memory>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"

#include "core/api/database.h"

namespace strata {

// Pauses between attempts of one call.
struct BackoffOptions {
  // Attempts of one call, the first included; in [0, 100], 0: as many as it takes. More ride out
  // longer troubles, and tell of them later. An announced scan counts those since more of it has
  // come to the server.
  int max_attempts = 6;
  // Pause after the first attempt; doubles from one to the next, each shortened by up to a half at
  // random so that clients do not come back together. A server that names a longer pause gets it.
  absl::Duration initial = absl::Milliseconds(100);
  absl::Duration max = absl::Seconds(5);
  // Goes on beyond max_attempts until so long after the first attempt failed; as long as a database
  // takes to move to its replica. By default zero, with several servers two minutes.
  std::optional<absl::Duration> retry_for = std::nullopt;
};

// PEM files; nothing of them: plain text.
struct ClientTls {
  std::string ca_file;           // authorities whose servers are trusted; asks for TLS
  std::string certificate_file;  // the client's own, for servers that want one
  std::string key_file;          // of the certificate
  // The name to expect in the server's certificate; empty: the host of the target, of several
  // servers of the first.
  std::string server_name;

  bool enabled() const { return !ca_file.empty(); }
};

struct ClientOptions {
  // HOST:PORT or unix:PATH; several HOST:PORT with commas between them are servers on one store:
  // calls go to one after the other, and to the next where one is gone or has not the map. Their
  // names are looked up once.
  std::string target = "127.0.0.1:50051";
  ClientTls tls;
  // Shown with every call (stratad token add); empty: none.
  std::string token;
  // Show the token in plain text to a server that is not on this machine.
  bool insecure = false;
  // A server that says nothing for so long, while a call waits for it, is asked whether it is
  // there, and without an answer within half of that the call ends as if it were gone: a machine
  // that lost its power says nothing either. At least 10 s: servers send away who asks more often.
  absl::Duration keepalive = absl::Seconds(20);
  // How long Connect() waits for the server; > 0.
  absl::Duration connect_timeout = absl::Seconds(10);
  // For calls that may be repeated, when the server was not there (UNAVAILABLE) or said that it was
  // full and when to come back (RESOURCE_EXHAUSTED).
  BackoffOptions backoff;

  // INVALID_ARGUMENT naming every field out of range.
  absl::Status Validate() const;
};

// A database behind `options.target`. Thread-safe; any number of calls and uploads may be under way
// at once, on one connection that mends itself. UNAVAILABLE if no server answers in time, which is
// also all that is known where one does not trust the other's certificate; NOT_FOUND or
// PERMISSION_DENIED for a file of `tls`; FAILED_PRECONDITION for a token that would cross the
// network in plain text without `insecure`.
//
// As the engine's, but for these:
// - Every call may also answer UNAVAILABLE, UNAUTHENTICATED and PERMISSION_DENIED. Uploads,
// lookups, Localize, Cancel, SetPose and
//   EnableConstraint repeat themselves as `backoff` says (an upload keeps its points until they are
//   acknowledged); Create, Start, Accept, Revert, AddConstraint, RemoveConstraint and the two
//   Deletes do not, since their effect may have happened: look before calling them again (where
//   another server has the map nothing has happened, and all of them go there). A stream
//   repeats itself only while nothing of it was delivered; but Maps.Watch waits for its server
//   until the call is stopped, however many attempts that takes, and resumes where it was (with
//   `once` it waits as other calls do).
// - Maps.Watch delivers an update of more than 1024 scans or tiles in parts; until the last,
//   commit_sequence stays that of the update before.
// - The call's deadline and cancellation reach into the work on the server.
// - An error carries the server's ErrorDetail as payload
//   "type.googleapis.com/strata.v1.ErrorDetail" with the id of the call in the server's log.
// - SampleSurfaces asks for more than 10,000 places in several calls.
absl::StatusOr<std::unique_ptr<api::Database>> Connect(const ClientOptions& options);

}  // namespace strata

#endif  // STRATA_CLIENT_SDK_CLIENT_H_
