// strata: the command line of the map database.
#include <csignal>
#include <cstddef>
#include <cstdlib>
#include <exception>
#include <functional>
#include <iostream>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include <CLI/CLI.hpp>

#include "client/cli/connect.h"
#include "client/cli/terminal/command.h"
#include "client/cli/terminal/output.h"
#include "client/cli/usage.h"
#include "core/common/status.h"
#include "core/common/stop.h"

namespace strata::cli {
namespace {

constexpr int kExitFailed = 1;
constexpr int kExitUsage = 2;

// The running command's stop; the handler's only state.
const Stop* running = nullptr;

// The first signal asks the command to end, the second ends the process.
void OnSignal(int signal) {
  running->Request();
  std::signal(signal, SIG_DFL);
}

struct GlobalOptions {
  Target target;
  std::string output = "text";
};

// For CLI11: empty, or what is wrong.
std::string IsAddress(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  int port = 0;
  const bool good = absl::StartsWith(text, "unix:") ||
                    (colon != std::string::npos && colon > 0 &&
                     absl::SimpleAtoi(text.substr(colon + 1), &port) && port > 0 && port <= 65535);
  return good ? "" : "expected HOST:PORT, as in 127.0.0.1:50051, got '" + text + "'";
}

void AddDoorOptions(CLI::App& root, Target& target) {
  constexpr char kGroup[] = "Servers that ask who you are";
  const auto add = [&](const char* name, std::string& value, const char* type, const char* text) {
    root.add_option(name, value, text)->type_name(type)->group(kGroup);
  };
  add("--tls-ca", target.tls_ca, "FILE", "Use TLS, and trust servers of these authorities (PEM)");
  add("--tls-cert",
      target.tls_certificate,
      "FILE",
      "Certificate of yours (PEM), for servers that want one");
  add("--tls-key", target.tls_key, "FILE", "Its key (PEM)");
  add("--tls-name",
      target.tls_name,
      "NAME",
      "Expect this name in the server's certificate, not the host's");
  add("--token-file",
      target.token_file,
      "FILE",
      "A file with your token in its first line; else the environment's STRATA_TOKEN");
  root.add_flag("--insecure", target.insecure, "Show the token over the network in plain text")
      ->group(kGroup);
}

void AddGlobalOptions(CLI::App& root, GlobalOptions& options) {
  // No default of the parser's: it would exclude --embedded.
  if (const char* server = std::getenv("STRATA_SERVER")) options.target.server = server;
  root.fallthrough();  // options of the root are taken after noun and verb too
  root.require_subcommand(1);
  auto* server =
      root.add_option("--server", options.target.server, "Address of stratad; else STRATA_SERVER")
          ->type_name("HOST:PORT")
          ->check(IsAddress)
          ->capture_default_str();
  root.add_option("--embedded",
                  options.target.embedded,
                  "No server: open the maps in this directory in this process")
      ->type_name("DIR")
      ->excludes(server);
  root.add_option("--output", options.output, "text for people, json for programs")
      ->check(CLI::IsMember({"text", "json"}))
      ->capture_default_str();
  AddDoorOptions(root, options.target);
  root.set_version_flag("--version", "strata " STRATA_VERSION);
}

// Trouble with a server says with which, and the cure.
absl::Status Explained(const absl::Status& status, const Target& target) {
  if (!target.embedded.empty()) return status;
  if (absl::IsUnauthenticated(status)) {
    return absl::UnauthenticatedError(absl::StrCat(
        status.message(), " (from ", target.server, "; show a token with --token-file FILE)"));
  }
  if (!absl::IsUnavailable(status)) return status;
  return absl::UnavailableError(
      absl::StrCat(status.message(),
                   " (from ",
                   target.server,
                   "; if stratad does not run there, start it and run the command again)"));
}

int Fail(const absl::Status& status, Output& output) {
  output.Talk("error: " +
              (status.message().empty() ? status.ToString() : std::string(status.message())));
  return kExitFailed;
}

// The first Ctrl-C requests `stop` while `run` runs.
absl::Status RunWithSignals(const Stop& stop, const std::function<absl::Status()>& run) {
  running = &stop;
  std::signal(SIGINT, OnSignal);
  std::signal(SIGTERM, OnSignal);
  const absl::Status status = run();
  std::signal(SIGINT, SIG_DFL);
  std::signal(SIGTERM, SIG_DFL);
  return status;
}

absl::Status RunOnDatabase(const Target& target, const Action& action, Output& output) {
  STRATA_ASSIGN_OR_RETURN(const auto database, OpenDatabase(target));
  Context context{
      .database = *database, .call = {}, .output = output, .open_directory = OpenDirectory};
  const absl::Status status = RunWithSignals(context.call.stop, [&] { return action(context); });
  return Explained(status, target);
}

absl::Status RunOnFiles(const Target& target, const FileAction& action, Output& output) {
  const Stop stop;
  FileContext context{
      .stop = stop, .output = output, .open_database = [&] { return OpenDatabase(target); }};
  return RunWithSignals(stop, [&] { return action(context); });
}

int Run(const GlobalOptions& options, const Commands& commands) {
  Output output(
      options.output == "json" ? OutputFormat::kJson : OutputFormat::kText, std::cout, std::cerr);
  const absl::Status status = commands.selected_on_files
                                  ? RunOnFiles(options.target, commands.selected_on_files, output)
                                  : RunOnDatabase(options.target, commands.selected, output);
  if (!status.ok()) return Fail(status, output);
  // Data that did not arrive (a full disk behind a redirection) is not done.
  return std::cout.flush() ? 0 : Fail(absl::DataLossError("cannot write to stdout"), output);
}

int Main(int argc, char** argv) {
  CLI::App root("Strata: a map database for robots that live in three dimensions", "strata");
  root.footer(
      "Lengths are in metres, angles in radians; values may be negative (--from -14,0,0). Options "
      "above work\nbefore and after NOUN and VERB. Exit code: 0 done (\"no path\" included), 1 "
      "failed, 2 wrong usage.\n\nExample:\n  strata --embedded maps map create campus --cell-size "
      "0.1\n  strata map create --help");
  GlobalOptions options;
  AddGlobalOptions(root, options);
  Commands commands{.root = root, .selected = {}, .selected_on_files = {}};
  AddMapCommands(commands);
  AddScanCommands(commands);
  AddPoseCommands(commands);
  AddPosegraphCommands(commands);
  AddTileCommands(commands);
  AddSurfaceCommand(commands);
  AddPlanCommand(commands);
  AddPathCommands(commands);
  AddProfileCommands(commands);
  AddJobCommands(commands);
  AddPlanesCommands(commands);
  AddLocalizeCommand(commands);
  AddDriveCommand(commands);
  AddEgomotionCommand(commands);
  AddClassifierCommands(commands);
  AddSpoolCommands(commands);
  try {
    root.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) {
      return root.exit(error);  // --help, --version
    }
    std::cerr << UsageMessage(root, error) << std::endl;
    return kExitUsage;
  }
  options.target.make_directory = commands.creates;
  return Run(options, commands);
}

}  // namespace
}  // namespace strata::cli

int main(int argc, char** argv) {
  try {
    return strata::cli::Main(argc, argv);
  } catch (const std::exception& error) {
    std::cerr << "error: " << error.what() << std::endl;
    return strata::cli::kExitFailed;
  }
}
