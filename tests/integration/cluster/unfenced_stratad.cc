// A stratad whose commits do not ask whether its map was taken away: what a campaign must find.
#include <csignal>
#include <iostream>
#include <memory>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"
#include <CLI/CLI.hpp>

#include "core/common/status.h"
#include "core/engine/engine.h"
#include "core/engine/map/database_stores.h"
#include "core/engine/map/directory.h"
#include "core/engine/map/engine_options.h"
#include "core/engine/map/map_stores.h"
#include "server/options.h"
#include "server/server.h"

namespace strata::testing {
namespace {

absl::StatusOr<std::unique_ptr<MapStores>> OpenUnfenced(const EngineOptions& options,
                                                        const MapDirectory& directory) {
  STRATA_ASSIGN_OR_RETURN(PostgresOptions database, DatabaseOf(options, directory));
  database.fenced = false;
  return OpenDatabaseStores(database);
}

absl::Status ServeUnfenced(const server::ProgramOptions& options) {
  absl::SetMutexDeadlockDetectionMode(absl::OnDeadlockCycle::kIgnore);
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  STRATA_ASSIGN_OR_RETURN(const std::unique_ptr<api::Database> database,
                          OpenEngine(options.engine, OpenUnfenced));
  STRATA_ASSIGN_OR_RETURN(const std::unique_ptr<server::Server> server,
                          server::Server::Start(*database, options.server));
  std::cout << "listening " << server->address() << std::endl;
  int signal = 0;
  sigwait(&signals, &signal);
  server->Shutdown();
  return absl::OkStatus();
}

}  // namespace
}  // namespace strata::testing

int main(int argc, char** argv) {
  CLI::App app("stratad without the fence");
  const auto read_options = strata::server::AddServeOptions(app);
  CLI11_PARSE(app, argc, argv);
  const auto options = read_options();
  const absl::Status served =
      options.ok() ? strata::testing::ServeUnfenced(*options) : options.status();
  if (!served.ok()) std::cerr << served << std::endl;
  return served.ok() ? 0 : 1;
}
