// strata: the command line of the map database.
#include <algorithm>
#include <csignal>
#include <exception>
#include <functional>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include <CLI/CLI.hpp>
#include <unistd.h>

#include "client/cli/completion/completion_commands.h"
#include "client/cli/connect.h"
#include "client/cli/context/context_commands.h"
#include "client/cli/terminal/command.h"
#include "client/cli/terminal/contexts.h"
#include "client/cli/terminal/names.h"
#include "client/cli/terminal/output.h"
#include "client/cli/terminal/screen.h"
#include "client/cli/terminal/server_options.h"
#include "client/cli/terminal/spelling.h"
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
  Said said;
  std::string output = "text";
  std::string colour = "auto";
};

void AddGlobalOptions(CLI::App& root, GlobalOptions& options) {
  root.fallthrough();  // options of the root are taken after noun and verb too
  root.require_subcommand(1);
  CLI::Option* const server = AddServerOptions(root, options.said.flags);
  CLI::Option* const embedded =
      root.add_option("--embedded",
                      options.said.embedded,
                      "No server: open the maps in this directory in this process")
          ->type_name("DIR")
          ->excludes(server);
  TakesName(root.add_option("--context",
                            options.said.context,
                            "The server or directory that has this name; see context list")
                ->type_name("NAME")
                ->excludes(embedded),
            kContextNames);
  root.add_option("-o,--output",
                  options.output,
                  "text (also called table) for people, json for programs, csv for what is a table")
      ->check(CLI::IsMember({"text", "table", "json", "csv"}))
      ->capture_default_str();
  root.add_option("--color,--colour",
                  options.colour,
                  "auto: on terminals, unless the environment's NO_COLOR is set")
      ->check(CLI::IsMember({"auto", "always", "never"}))
      ->capture_default_str();
  root.set_version_flag("--version", "strata " STRATA_VERSION);
  root.parse_complete_callback([server, &options] { options.said.server = server->count() > 0; });
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

absl::Status RunOnDatabase(const Said& said, const Commands& commands, Output& output) {
  STRATA_ASSIGN_OR_RETURN(const SavedContext target, TargetOf(said));
  STRATA_ASSIGN_OR_RETURN(const auto database, OpenDatabase(target, commands.creates));
  Context context{
      .database = *database, .call = {}, .output = output, .open_directory = OpenDirectory};
  const absl::Status status =
      RunWithSignals(context.call.stop, [&] { return commands.selected(context); });
  if (absl::IsNotFound(status)) return WithNearestMap(status, *database);
  return target.embedded.empty() ? Explained(status, target.server) : status;
}

absl::Status RunOnFiles(const Said& said, const FileAction& action, Output& output) {
  const Stop stop;
  const auto open = [&]() -> absl::StatusOr<std::unique_ptr<api::Database>> {
    STRATA_ASSIGN_OR_RETURN(const SavedContext target, TargetOf(said));
    return OpenDatabase(target, false);
  };
  FileContext context{.stop = stop, .output = output, .open_database = open};
  return RunWithSignals(stop, [&] { return action(context); });
}

int Run(const GlobalOptions& options, const Commands& commands) {
  Output output(ParseOutputFormat(options.output),
                std::cout,
                std::cerr,
                ScreenOf(STDOUT_FILENO, options.colour),
                ScreenOf(STDERR_FILENO, options.colour));
  const absl::Status status = commands.selected_on_files
                                  ? RunOnFiles(options.said, commands.selected_on_files, output)
                                  : RunOnDatabase(options.said, commands, output);
  output.Finish();
  if (!status.ok()) return Fail(status, output);
  // Data that did not arrive (a full disk behind a redirection) is not done.
  return std::cout.flush() ? 0 : Fail(absl::DataLossError("cannot write to stdout"), output);
}

// Help as wide as the terminal, the version, or what is wrong.
int Answer(CLI::App& root, const CLI::ParseError& error) {
  if (dynamic_cast<const CLI::CallForHelp*>(&error) != nullptr) {
    std::cout << FilledHelp(root.help(), ScreenOf(STDOUT_FILENO, "never").columns) << std::flush;
    return 0;
  }
  if (error.get_exit_code() == 0) return root.exit(error);  // --version
  Output(OutputFormat::kText, std::cout, std::cerr, {}, ScreenOf(STDERR_FILENO, "auto"))
      .Talk(UsageMessage(root, error));
  return kExitUsage;
}

void AddCommands(Commands& commands, const GlobalOptions& options) {
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
  AddContextCommands(commands, options.said);
  AddCompletionCommands(commands, options.said, TargetOf, [](const SavedContext& target) {
    return OpenDatabase(target, false);
  });
}

int Main(int argc, char** argv) {
  CLI::App root("Strata: a map database for robots that live in three dimensions", "strata");
  root.footer(
      "Lengths are in metres, angles in radians unless they end with deg, as in 20deg; values may "
      "be negative (--from -14,0,0). Options above work before and after NOUN and VERB. Exit code: "
      "0 done (\"no path\" included), 1 failed, 2 wrong usage.\n\nExample:\n  strata --embedded "
      "maps map create campus --cell-size 0.1\n  strata map create --help");
  GlobalOptions options;
  AddGlobalOptions(root, options);
  Commands commands{.root = root, .selected = {}, .selected_on_files = {}};
  AddCommands(commands, options);
  try {
    std::vector<std::string> words = Spelled(root, {argv + 1, argv + argc});
    std::reverse(words.begin(), words.end());  // as the parser takes them
    root.parse(words);
  } catch (const CLI::ParseError& error) {
    return Answer(root, error);
  }
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
