// What stratad is told on its command line and in its configuration file.
#ifndef STRATA_SERVER_OPTIONS_H_
#define STRATA_SERVER_OPTIONS_H_

#include <functional>
#include <string>

#include "absl/status/statusor.h"
#include <CLI/CLI.hpp>

#include "core/engine/engine.h"
#include "server/server.h"

namespace strata::server {

struct ProgramOptions {
  EngineOptions engine;
  ServerOptions server;
};

// The options of serving, under `app` and in a file (--config). Every text has its unit; values out
// of range are CLI11's errors. The function answers, after parsing, what was said:
// INVALID_ARGUMENT without --data.
std::function<absl::StatusOr<ProgramOptions>()> AddServeOptions(CLI::App& app);

}  // namespace strata::server

#endif  // STRATA_SERVER_OPTIONS_H_
