// How the commands of `strata` are put together: a noun file adds its verbs to the parser, the
// parser selects one action, main() runs it against a database.
#ifndef STRATA_CLIENT_CLI_TERMINAL_COMMAND_H_
#define STRATA_CLIENT_CLI_TERMINAL_COMMAND_H_

#include <functional>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include <CLI/CLI.hpp>

#include "client/cli/terminal/arguments.h"
#include "client/cli/terminal/output.h"
#include "core/api/call.h"
#include "core/api/database.h"
#include "core/common/stop.h"

namespace strata::cli {

// What a running command has at hand.
struct Context {
  api::Database& database;
  api::Call call;  // stops on the first Ctrl-C
  Output& output;
  // Opens a directory of maps in this process.
  std::function<absl::StatusOr<std::unique_ptr<api::Database>>(const std::string&)> open_directory =
      nullptr;
};

// What a running command has at hand that works on files and needs no database.
struct FileContext {
  const Stop& stop;  // on the first Ctrl-C
  Output& output;
  // The one that the command line names, for commands that can do with and without.
  std::function<absl::StatusOr<std::unique_ptr<api::Database>>()> open_database;
};

// OK: exit 0. Any other status: its message on stderr and exit 1.
using Action = std::function<absl::Status(Context&)>;
using FileAction = std::function<absl::Status(FileContext&)>;

// The parser's root and the action that the verb on the command line chose.
struct Commands {
  CLI::App& root;
  Action selected;
  FileAction selected_on_files;  // in place of `selected`
  bool creates = false;          // the chosen verb may be the first in a directory

  // `example` appears below the --help of a noun or a verb.
  CLI::App* Noun(const std::string& name,
                 const std::string& description,
                 const std::string& example);
  // A verb under `noun` (the root for `surface`, `plan` and `explore`).
  CLI::App* Verb(CLI::App* noun,
                 const std::string& name,
                 const std::string& description,
                 const std::string& example,
                 Action action);
  CLI::App* FileVerb(CLI::App* noun,
                     const std::string& name,
                     const std::string& description,
                     const std::string& example,
                     FileAction action);
};

// Adds verbs under `noun` whose first argument is the NAME of a map: (name, description, example,
// run), where run(context, *options) acts on options->map. Returns the verb's parser.
template <typename Options>
auto MapVerbs(Commands& commands, CLI::App* noun, const std::shared_ptr<Options>& options) {
  return [&commands, noun, options](
             const char* name, const char* description, const char* example, auto run) {
    CLI::App* app =
        commands.Verb(noun, name, description, example, [options, run](Context& context) {
          return run(context, *options);
        });
    AddMapName(app, options->map);
    return app;
  };
}

void AddMapCommands(Commands& commands);
void AddScanCommands(Commands& commands);
void AddPoseCommands(Commands& commands);
void AddPosegraphCommands(Commands& commands);
void AddTileCommands(Commands& commands);
void AddSurfaceCommand(Commands& commands);
void AddPlanCommand(Commands& commands);
void AddPathCommands(Commands& commands);
void AddExploreCommand(Commands& commands);
void AddProfileCommands(Commands& commands);
void AddJobCommands(Commands& commands);
void AddPlanesCommands(Commands& commands);
void AddObjectsCommands(Commands& commands);
void AddKindCommands(Commands& commands);
void AddLocalizeCommand(Commands& commands);
void AddDriveCommand(Commands& commands);
void AddEgomotionCommand(Commands& commands);
void AddClassifierCommands(Commands& commands);
void AddSpoolCommands(Commands& commands);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_TERMINAL_COMMAND_H_
