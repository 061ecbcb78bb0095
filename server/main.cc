// stratad: the database behind gRPC.
#include <csignal>
#include <ctime>
#include <functional>
#include <iostream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"
#include <CLI/CLI.hpp>
#include <glog/logging.h>
#include <malloc.h>
#include <pthread.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/common/log_line.h"
#include "core/common/status.h"
#include "core/engine/engine.h"
#include "server/check.h"
#include "server/import_command.h"
#include "server/last_end.h"
#include "server/log_writer.h"
#include "server/options.h"
#include "server/quarantine_commands.h"
#include "server/readiness.h"
#include "server/server.h"
#include "server/token_commands.h"

namespace strata::server {
namespace {

constexpr int kFailed = 1;
constexpr int kUsage = 2;

// SIGTERM and SIGINT wait for AwaitSignal(). Called before there are other threads, which inherit
// it.
sigset_t BlockSignals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  return signals;
}

// Every connection is a file, and so are the maps: as many as the system lets this process have.
void RaiseFileLimit() {
  rlimit files{};
  if (getrlimit(RLIMIT_NOFILE, &files) != 0) return;
  files.rlim_cur = files.rlim_max;
  setrlimit(RLIMIT_NOFILE, &files);
}

// What is in maps is nobody else's: folders and files that it makes are 0750 and 0640, or stricter.
void KeepFilesPrivate() { ::umask(::umask(0077) | 0027); }

// By default every thread has a heap of its own, and what it freed in the middle of it stays with
// the process: beside hostile clients a gigabyte of which half was free.
void KeepHeapsSmall() {
  mallopt(M_ARENA_MAX, 4);
  mallopt(M_MMAP_THRESHOLD, 256 << 10);  // larger blocks go back at once
}

// Gives free memory back from time to time.
int AwaitSignal(const sigset_t& signals) {
  constexpr timespec kInterval{1, 0};
  while (true) {
    const int signal = sigtimedwait(&signals, nullptr, &kInterval);
    if (signal > 0) return signal;
    malloc_trim(0);
  }
}

ReadinessCheck LogCheck(const LogWriter& log) {
  static constexpr absl::Duration kLong = absl::Seconds(10);
  return {"log", [&log] {
            return log.stuck() < kLong
                       ? ""
                       : absl::StrCat("nobody reads stderr, ", log.dropped(), " lines are lost");
          }};
}

LogLine StartLine(const ProgramOptions& options, const std::string& address) {
  const ServerOptions& server = options.server;
  LogLine line("start");
  line.Add("version", STRATA_VERSION)
      .Add("data", options.engine.directory.string())
      .Add("store", options.engine.store.empty() ? "files" : "postgresql")
      .Add("role", RolesOf(options.engine))
      .Add("listen", address)
      .Add("tls", server.tls.enabled() ? (server.tls.client_ca.empty() ? "yes" : "mutual") : "no")
      .Add("tokens", server.token_file.empty() ? "no" : "yes")
      .Add("max_calls", server.max_calls)
      .Add("max_watches", server.max_watches)
      .Add("client_calls", server.client.max_calls)
      .Add("client_rate", server.client.calls_per_second)
      .Add("optimize_every", absl::FormatDuration(options.engine.optimize_interval));
  return line;
}

absl::Status Serve(const ProgramOptions& options) {
  KeepHeapsSmall();
  KeepFilesPrivate();
  // Debian's Abseil is built to look for cycles whenever a mutex is locked, and to abort at one.
  absl::SetMutexDeadlockDetectionMode(absl::OnDeadlockCycle::kIgnore);
  FLAGS_logtostderr = true;
  google::InitGoogleLogging("stratad");
  const sigset_t signals = BlockSignals();
  signal(SIGPIPE, SIG_IGN);  // that nobody reads the log is no reason to end
  RaiseFileLimit();
  const LogWriter log(STDERR_FILENO);
  STRATA_RETURN_IF_ERROR(CheckExposure(options.server));  // before a directory is made
  EngineOptions engine = options.engine;
  engine.killed_from_outside = BeginRun(engine.directory);
  STRATA_ASSIGN_OR_RETURN(const std::unique_ptr<api::Database> database, OpenEngine(engine));
  STRATA_ASSIGN_OR_RETURN(const std::unique_ptr<Server> server,
                          Server::Start(*database, options.server, {LogCheck(log)}));
  // Before any other line with an address, for scripts that read both streams as one.
  std::cout << "listening " << server->address() << std::endl;
  if (!server->web_url().empty()) std::cout << "web " << server->web_url() << std::endl;
  LOG(INFO) << StartLine(options, server->address());
  const int signal = AwaitSignal(signals);
  LOG(INFO) << LogLine("shutdown").Add("signal", signal);
  server->Shutdown();
  return absl::OkStatus();
}

int Check(const ProgramOptions& options, bool maps, bool json) {
  std::vector<Finding> findings = CheckInstallation(options);
  if (maps) {
    for (Finding& finding : CheckMaps(options.engine)) {
      findings.push_back(std::move(finding));
    }
  }
  std::cout << (json ? ToJson(findings) : ToText(findings)) << std::flush;
  return AnyError(findings) ? kFailed : 0;
}

int Exit(const absl::Status& status) {
  if (status.ok()) return 0;
  std::cerr << "stratad: " << status.message() << std::endl;
  return kFailed;
}

int Main(int argc, char** argv) {
  CLI::App app("stratad, the server of Strata, a map database for robots.", "stratad");
  app.footer(
      "Once it serves, it prints on stdout: listening HOST:PORT, and with --web then: web URL\n\n"
      "Example:\n  stratad --data ./maps --listen 127.0.0.1:50051");
  app.set_version_flag("--version", absl::StrCat("stratad ", STRATA_VERSION));
  const std::function<absl::StatusOr<ProgramOptions>()> read_options = AddServeOptions(app);
  app.require_subcommand(0, 1);
  app.fallthrough();  // check takes the options of serving
  std::string output = "text";
  CLI::App* check = app.add_subcommand(
      "check", "Say whether the server could run with these options, without serving");
  check->add_option("--output", output, "text for people, json for programs")
      ->check(CLI::IsMember({"text", "json"}))
      ->capture_default_str();
  bool maps = false;
  check->add_flag(
      "--maps",
      maps,
      "Read every page of every map, too, with --store every row; takes as long as the disk");
  check->footer(
      "Takes the options of serving. Exit code: 0 it could, 1 something is an error; a map that "
      "is\n"
      "damaged or another program's file is one with --maps only: the others are served.\n\n"
      "Example:\n  stratad check --config /etc/strata/stratad.conf");
  CommandAction action;
  AddTokenCommands(app, action);
  AddImportCommand(app, action);
  AddQuarantineCommands(app, action);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : kUsage;
  }
  if (action) return Exit(action(std::cout));
  const absl::StatusOr<ProgramOptions> options = read_options();
  if (!options.ok()) {
    std::cerr << "stratad: " << options.status().message() << "\nSee stratad --help" << std::endl;
    return kUsage;
  }
  return check->parsed() ? Check(*options, maps, output == "json") : Exit(Serve(*options));
}

}  // namespace
}  // namespace strata::server

int main(int argc, char** argv) { return strata::server::Main(argc, argv); }
