// stratad check: whether the server could run, told without serving.
#ifndef STRATA_SERVER_CHECK_H_
#define STRATA_SERVER_CHECK_H_

#include <string>
#include <vector>

#include "core/engine/engine.h"
#include "server/options.h"

namespace strata::server {

enum class Verdict { kOk, kWarning, kError };

struct Finding {
  Verdict verdict = Verdict::kOk;
  std::string what;     // "listen", "tls", "tokens", "data", "map campus"
  std::string message;  // in one line
};

// Looks at all that `options` name but the insides of maps, in a moment: what would keep the server
// from starting is an error, what will soon, keeps it from taking more, or looks like a mistake is
// a warning. Changes nothing but for a file of its own in the data directory, which goes again.
std::vector<Finding> CheckInstallation(const ProgramOptions& options);

// Reads every page of every map file, or every row of every map of the database. One that would not
// be served is an error, though the server starts and serves the others.
std::vector<Finding> CheckMaps(const EngineOptions& engine);

// "ok      listen: …", one a line.
std::string ToText(const std::vector<Finding>& findings);
// {"ok": true, "findings": [{"verdict": "ok", "what": "listen", "message": "…"}, …]}
std::string ToJson(const std::vector<Finding>& findings);
bool AnyError(const std::vector<Finding>& findings);

}  // namespace strata::server

#endif  // STRATA_SERVER_CHECK_H_
