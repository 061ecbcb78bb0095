// Servers with names, as users keep them: what to say on the command line said once.
#ifndef STRATA_CLIENT_CLI_TERMINAL_CONTEXTS_H_
#define STRATA_CLIENT_CLI_TERMINAL_CONTEXTS_H_

#include <filesystem>
#include <map>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "client/cli/terminal/server_options.h"

namespace strata::cli {

// A server and who one is there, or a directory of maps in place of both.
struct SavedContext {
  ServerOptions server;
  std::string embedded;
};

struct Contexts {
  std::map<std::string, SavedContext> named;
  std::string current;  // used where nothing else is said; empty: none
};

// $XDG_CONFIG_HOME/strata/contexts.json, else that below ~/.config. NOT_FOUND without a home.
absl::StatusOr<std::filesystem::path> ContextsPath();

// None where there is no file. INVALID_ARGUMENT naming the file and what is wrong in it.
absl::StatusOr<Contexts> ReadContexts(const std::filesystem::path& path);

// Replaces the file as a whole; only its user can read it.
absl::Status WriteContexts(const std::filesystem::path& path, const Contexts& contexts);

// Letters, digits, dots, dashes and underscores, at most 64; else INVALID_ARGUMENT.
absl::Status ValidateContextName(const std::string& name);

// NOT_FOUND, with the nearest name there is.
absl::StatusOr<SavedContext> FindContext(const Contexts& contexts, const std::string& name);

// What the command line says beside a context.
struct Said {
  std::string context;   // --context
  bool server = false;   // --server
  std::string embedded;  // --embedded
  ServerOptions flags;   // the rest of them; the server is that of STRATA_SERVER without flag
};

// Whom to talk to: flags before the environment before a context before the default. A context of
// --context comes before the environment; the current one is for its own server only: it is left
// alone as soon as a server or a directory is named, so that nobody shows a token to another server
// by mistake. Reads `path` only if a context could matter.
absl::StatusOr<SavedContext> ResolveContext(const Said& said, const std::filesystem::path& path);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_TERMINAL_CONTEXTS_H_
