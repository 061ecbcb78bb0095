// strata: the command line of the map database.
#include <csignal>
#include <exception>
#include <iostream>
#include <string>

#include <CLI/CLI.hpp>

#include "client/cli/command.h"
#include "client/cli/connect.h"
#include "client/cli/output.h"

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
  auto* server = root.add_option("--server", options.target.server, "Address of stratad")
                     ->type_name("HOST:PORT")
                     ->capture_default_str();
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

int Run(const GlobalOptions& options, const Action& action) {
  Output output(
      options.output == "json" ? OutputFormat::kJson : OutputFormat::kText, std::cout, std::cerr);
  auto database = OpenDatabase(options.target);
  if (!database.ok()) {
    output.Talk("error: " + std::string(database.status().message()));
    return kExitFailed;
  }
  Context context{.database = **database, .call = {}, .output = output};
  running = &context.call.stop;
  std::signal(SIGINT, OnSignal);
  std::signal(SIGTERM, OnSignal);
  const absl::Status status = action(context);
  std::signal(SIGINT, SIG_DFL);
  std::signal(SIGTERM, SIG_DFL);
  if (!status.ok()) {
    output.Talk("error: " +
                (status.message().empty() ? status.ToString() : std::string(status.message())));
    return kExitFailed;
  }
  return 0;
}

int Main(int argc, char** argv) {
  CLI::App root("Strata: a map database for robots that live in three dimensions", "strata");
  root.footer(
      "Lengths are in metres, angles in radians. `strata NOUN VERB --help` shows an example.");
  GlobalOptions options;
  AddGlobalOptions(root, options);
  Commands commands{.root = root, .selected = {}};
  AddMapCommands(commands);
  AddScanCommands(commands);
  AddPoseCommands(commands);
  AddTileCommands(commands);
  AddSurfaceCommand(commands);
  AddPlanCommand(commands);
  AddProfileCommands(commands);
  AddJobCommands(commands);
  try {
    root.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return root.exit(error) == 0 ? 0 : kExitUsage;
  }
  return Run(options, commands.selected);
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
