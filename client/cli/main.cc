// strata: the command line of the map database.
#include <csignal>
#include <exception>
#include <functional>
#include <iostream>
#include <string>

#include "absl/status/status.h"
#include <CLI/CLI.hpp>

#include "client/cli/connect.h"
#include "client/cli/terminal/command.h"
#include "client/cli/terminal/output.h"
#include "client/cli/terminal/server_options.h"
#include "client/cli/terminal/usage.h"
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

void AddGlobalOptions(CLI::App& root, GlobalOptions& options) {
  root.fallthrough();  // options of the root are taken after noun and verb too
  root.require_subcommand(1);
  CLI::Option* const server = AddServerOptions(root, options.target.server);
  root.add_option("--embedded",
                  options.target.embedded,
                  "No server: open the maps in this directory in this process")
      ->type_name("DIR")
      ->excludes(server);
  root.add_option("--output", options.output, "text for people, json for programs")
      ->check(CLI::IsMember({"text", "json"}))
      ->capture_default_str();
  root.set_version_flag("--version", "strata " STRATA_VERSION);
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
  return target.embedded.empty() ? Explained(status, target.server) : status;
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
  AddExploreCommand(commands);
  AddProfileCommands(commands);
  AddJobCommands(commands);
  AddPlanesCommands(commands);
  AddObjectsCommands(commands);
  AddKindCommands(commands);
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
