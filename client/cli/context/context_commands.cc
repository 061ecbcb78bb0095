#include "client/cli/context/context_commands.h"

#include <filesystem>
#include <memory>
#include <string>
#include <system_error>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

#include "client/cli/terminal/confirm.h"
#include "client/cli/terminal/names.h"
#include "core/common/status.h"

namespace strata::cli {
namespace {

struct ContextOptions {
  std::string name;
  bool copy_token = false;
  bool replace = false;
  bool use = false;
  bool none = false;
  bool yes = false;
};

// Files are found from every folder.
void MakeAbsolute(std::string& file) {
  std::error_code error;
  if (!file.empty()) file = std::filesystem::absolute(file, error).lexically_normal().string();
}

Json ContextJson(const std::string& name, const SavedContext& context, const std::string& current) {
  const auto or_null = [](const std::string& text) { return text.empty() ? Json() : Json(text); };
  const ServerOptions& server = context.server;
  return {{"name", name},
          {"current", name == current},
          {"server", or_null(server.server)},
          {"embedded", or_null(context.embedded)},
          {"tls_ca", or_null(server.tls_ca)},
          {"tls_cert", or_null(server.tls_certificate)},
          {"tls_key", or_null(server.tls_key)},
          {"tls_name", or_null(server.tls_name)},
          {"token", server.token.empty() ? or_null(server.token_file) : Json("kept here")},
          {"insecure", server.insecure}};
}

absl::StatusOr<SavedContext> ContextSaid(const ContextOptions& options, const Said& said) {
  STRATA_RETURN_IF_ERROR(ValidateContextName(options.name));
  if (!said.server && said.embedded.empty()) {
    return absl::InvalidArgumentError(
        "say which server it is with --server HOST:PORT, or which directory with --embedded DIR");
  }
  SavedContext context{.server = said.flags, .embedded = said.embedded};
  if (!said.server) context.server.server.clear();
  if (options.copy_token) {
    STRATA_ASSIGN_OR_RETURN(const ClientOptions client, ClientOptionsOf(said.flags));
    if (client.token.empty()) {
      return absl::InvalidArgumentError("--copy-token: no token; name one with --token-file FILE");
    }
    context.server.token = client.token;
    context.server.token_file.clear();
  }
  for (std::string* file : {&context.embedded,
                            &context.server.tls_ca,
                            &context.server.tls_certificate,
                            &context.server.tls_key,
                            &context.server.token_file}) {
    MakeAbsolute(*file);
  }
  return context;
}

absl::Status Add(FileContext& context, const ContextOptions& options, const Said& said) {
  STRATA_ASSIGN_OR_RETURN(const std::filesystem::path path, ContextsPath());
  STRATA_ASSIGN_OR_RETURN(Contexts contexts, ReadContexts(path));
  STRATA_ASSIGN_OR_RETURN(SavedContext added, ContextSaid(options, said));
  if (contexts.named.contains(options.name) && !options.replace) {
    return absl::AlreadyExistsError(
        absl::StrCat("context ", options.name, " exists; --replace puts this one in its place"));
  }
  if (options.use) contexts.current = options.name;
  const Json json = ContextJson(options.name, added, contexts.current);
  contexts.named[options.name] = std::move(added);
  STRATA_RETURN_IF_ERROR(WriteContexts(path, contexts));
  context.output.Object(json);
  return absl::OkStatus();
}

absl::Status Use(FileContext& context, const ContextOptions& options) {
  STRATA_ASSIGN_OR_RETURN(const std::filesystem::path path, ContextsPath());
  STRATA_ASSIGN_OR_RETURN(Contexts contexts, ReadContexts(path));
  if (!options.none) STRATA_RETURN_IF_ERROR(FindContext(contexts, options.name).status());
  contexts.current = options.none ? "" : options.name;
  STRATA_RETURN_IF_ERROR(WriteContexts(path, contexts));
  context.output.Object({{"current", options.none ? Json() : Json(options.name)}});
  return absl::OkStatus();
}

absl::Status List(FileContext& context) {
  STRATA_ASSIGN_OR_RETURN(const std::filesystem::path path, ContextsPath());
  STRATA_ASSIGN_OR_RETURN(const Contexts contexts, ReadContexts(path));
  Json rows = Json::array();
  for (const auto& [name, each] : contexts.named) {
    rows.push_back(ContextJson(name, each, contexts.current));
  }
  context.output.List(rows,
                      {{"name", "NAME"},
                       {"current", "CURRENT"},
                       {"server", "SERVER"},
                       {"embedded", "EMBEDDED"},
                       {"tls_ca", "TLS CA"},
                       {"token", "TOKEN"}});
  return absl::OkStatus();
}

absl::Status Show(FileContext& context, const ContextOptions& options) {
  STRATA_ASSIGN_OR_RETURN(const std::filesystem::path path, ContextsPath());
  STRATA_ASSIGN_OR_RETURN(const Contexts contexts, ReadContexts(path));
  const std::string name = options.name.empty() ? contexts.current : options.name;
  if (name.empty()) {
    return absl::NotFoundError("no context is current; see context list and context use");
  }
  STRATA_ASSIGN_OR_RETURN(const SavedContext found, FindContext(contexts, name));
  context.output.Object(ContextJson(name, found, contexts.current));
  return absl::OkStatus();
}

absl::Status Delete(FileContext& context, const ContextOptions& options) {
  STRATA_ASSIGN_OR_RETURN(const std::filesystem::path path, ContextsPath());
  STRATA_ASSIGN_OR_RETURN(Contexts contexts, ReadContexts(path));
  STRATA_RETURN_IF_ERROR(FindContext(contexts, options.name).status());
  STRATA_RETURN_IF_ERROR(
      Confirm(options.yes, absl::StrCat("forget the context ", options.name, "?")));
  contexts.named.erase(options.name);
  if (contexts.current == options.name) contexts.current.clear();
  STRATA_RETURN_IF_ERROR(WriteContexts(path, contexts));
  context.output.Object({{"deleted", options.name}});
  return absl::OkStatus();
}

void AddAdd(Commands& commands,
            CLI::App* noun,
            const std::shared_ptr<ContextOptions>& options,
            const Said& said) {
  CLI::App* add = commands.FileVerb(
      noun,
      "add",
      "Keep --server or --embedded, and with them --token-file, --tls-… and --insecure, under a "
      "name",
      "strata context add lab --server lab.example:50051 --tls-ca ca.pem --token-file token --use",
      [options, &said](FileContext& context) { return Add(context, *options, said); });
  add->add_option("NAME", options->name, "What it is called")->required();
  add->add_flag("--use", options->use, "Make it the current one, as context use does");
  add->add_flag("--copy-token",
                options->copy_token,
                "Keep the token itself, not the name of its file: a copy that goes on where the "
                "file is changed or gone");
  add->add_flag("--replace", options->replace, "Put it in the place of one that has the name");
}

}  // namespace

void AddContextCommands(Commands& commands, const Said& said) {
  auto options = std::make_shared<ContextOptions>();
  CLI::App* noun = commands.Noun("context",
                                 "Names of servers and directories, and which one is current",
                                 "strata context use lab");
  AddAdd(commands, noun, options, said);
  const auto verb = [&](const char* name, const char* description, const char* example, auto run) {
    return commands.FileVerb(
        noun, name, description, example, [options, run](FileContext& context) {
          return run(context, *options);
        });
  };
  const auto named = [&](CLI::App* app) {
    return TakesName(app->add_option("NAME", options->name, "The context"), kContextNames);
  };
  CLI::App* use = verb("use",
                       "Make a context the one that is meant where nothing else is said",
                       "strata context use lab",
                       Use);
  CLI::Option* const name = named(use);
  CLI::Option* const none = use->add_flag("--none", options->none, "None of them is, from now on");
  none->excludes(name);
  use->parse_complete_callback([name, none] {
    if (name->empty() && none->empty()) throw CLI::RequiredError("NAME");
  });
  verb("list", "All contexts", "strata context list", [](FileContext& context, const auto&) {
    return List(context);
  });
  named(verb("show", "One context; without NAME the current one", "strata context show lab", Show));
  CLI::App* remove = verb("delete", "Forget a context", "strata context delete lab", Delete);
  named(remove)->required();
  AddYes(remove, options->yes);
}

}  // namespace strata::cli
