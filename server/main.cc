// stratad: the database behind gRPC.
#include <csignal>
#include <iostream>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include <CLI/CLI.hpp>
#include <glog/logging.h>
#include <pthread.h>

#include "core/common/status.h"
#include "core/engine/engine.h"
#include "server/server.h"

namespace strata {
namespace {

constexpr int kFailed = 1;
constexpr int kUsage = 2;

// SIGTERM and SIGINT wait for WaitForSignal(). Called before there are other threads, which inherit
// it.
sigset_t BlockSignals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  return signals;
}

CLI::Validator SecondsUpTo(double most) {
  return CLI::Validator(
      [most](const std::string& text) {
        double seconds = 0.0;
        const bool good = absl::SimpleAtod(text, &seconds) && seconds >= 0.0 && seconds <= most;
        return good ? std::string() : absl::StrCat("expected 0 to ", most, " seconds, got ", text);
      },
      "");
}

absl::Status Serve(const EngineOptions& engine_options,
                   const server::ServerOptions& server_options,
                   const sigset_t& signals) {
  STRATA_ASSIGN_OR_RETURN(const std::unique_ptr<api::Database> database,
                          OpenEngine(engine_options));
  STRATA_ASSIGN_OR_RETURN(const std::unique_ptr<server::Server> server,
                          server::Server::Start(*database, server_options));
  // Before any other line with an address, for scripts that read both streams as one.
  std::cout << "listening " << server->address() << std::endl;
  LOG(INFO) << "event=start version=" << STRATA_VERSION << " data=" << engine_options.directory
            << " listen=" << server->address() << " query_threads=" << server_options.query_threads
            << " stream_threads=" << server_options.stream_threads
            << " upload_threads=" << server_options.upload_threads
            << " max_calls=" << server_options.max_calls
            << " max_watches=" << server_options.max_watches
            << " optimize_every=" << engine_options.optimize_interval;
  int signal = 0;
  sigwait(&signals, &signal);
  LOG(INFO) << "event=shutdown signal=" << signal;
  server->Shutdown();
  return absl::OkStatus();
}

int Main(int argc, char** argv) {
  CLI::App app("stratad, the server of Strata, a map database for robots.");
  app.footer(
      "Once it serves, it prints one line on stdout: listening HOST:PORT\n\n"
      "Example:\n  stratad --data ./maps --listen 127.0.0.1:50051");
  EngineOptions engine_options;
  server::ServerOptions options;
  double optimize_every_s = 60.0;
  double upload_keep_s = absl::ToDoubleSeconds(engine_options.upload_keep);
  double drain_s = absl::ToDoubleSeconds(options.drain_timeout);
  std::string directory;
  app.set_version_flag("--version", absl::StrCat("stratad ", STRATA_VERSION));
  app.add_option("--data", directory, "Directory that holds the maps; made if absent")->required();
  app.add_option("--listen", options.listen, "HOST:PORT to listen on; port 0 takes a free one")
      ->capture_default_str();
  app.add_flag("--insecure",
               options.insecure,
               "Listen beyond loopback without TLS and tokens, which are not there yet");
  app.add_option("--query-threads", options.query_threads, "Calls answered at a time")
      ->capture_default_str();
  app.add_option("--stream-threads", options.stream_threads, "Downloads served at a time")
      ->capture_default_str();
  app.add_option("--upload-threads", options.upload_threads, "Scans taken in at a time")
      ->capture_default_str();
  app.add_option("--max-watches",
                 options.max_watches,
                 "Watches of maps and jobs under way before more are sent away; they are no calls")
      ->capture_default_str();
  app.add_option("--max-calls", options.max_calls, "Calls under way before clients are sent away")
      ->capture_default_str();
  app.add_option(
         "--optimize-every",
         optimize_every_s,
         "After a loop was closed, and at most so often [s], optimize a map's poses without "
         "being asked; 0: never")
      ->check(SecondsUpTo(86400.0))
      ->capture_default_str();
  app.add_option("--upload-keep",
                 upload_keep_s,
                 "How long [s] the points of an announced scan whose upload broke off stay for its "
                 "client to go on with")
      ->check(SecondsUpTo(86400.0))
      ->capture_default_str();
  app.add_option("--drain", drain_s, "Seconds that calls may take to end at shutdown")
      ->check(SecondsUpTo(3600.0))
      ->capture_default_str();
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : kUsage;
  }
  engine_options.directory = directory;
  engine_options.optimize_interval = absl::Seconds(optimize_every_s);
  engine_options.upload_keep = absl::Seconds(upload_keep_s);
  options.drain_timeout = absl::Seconds(drain_s);

  FLAGS_logtostderr = true;
  google::InitGoogleLogging(argv[0]);
  const sigset_t signals = BlockSignals();
  const absl::Status status = Serve(engine_options, options, signals);
  if (status.ok()) return 0;
  std::cerr << "stratad: " << status.message() << std::endl;
  return kFailed;
}

}  // namespace
}  // namespace strata

int main(int argc, char** argv) { return strata::Main(argc, argv); }
