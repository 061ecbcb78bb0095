#include "client/cli/completion/completion_commands.h"

#include <csignal>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include <unistd.h>

#include "client/cli/completion/grammar.h"
#include "client/cli/completion/scripts.h"
#include "client/cli/terminal/names.h"
#include "core/common/status.h"
#include "core/common/steady_time.h"
#include "core/common/stop.h"

namespace strata::cli {
namespace {

// Nobody waits longer for a key.
constexpr absl::Duration kDeadline = absl::Seconds(1);
constexpr unsigned kHardDeadlineSeconds = 3;  // a name service that does not answer, a slow disk

struct CompleteOptions {
  std::string names;
  std::string map;
};

absl::StatusOr<std::vector<std::string>> ContextNames() {
  STRATA_ASSIGN_OR_RETURN(const std::filesystem::path path, ContextsPath());
  STRATA_ASSIGN_OR_RETURN(const Contexts contexts, ReadContexts(path));
  std::vector<std::string> names;
  for (const auto& [name, context] : contexts.named) names.push_back(name);
  return names;
}

// Another process may have the directory open; its files can be listed all the same.
std::vector<std::string> MapsIn(const std::string& directory) {
  std::vector<std::string> names;
  std::error_code error;
  for (std::filesystem::directory_iterator entry(directory, error), end; !error && entry != end;
       entry.increment(error)) {
    if (entry->path().extension() == ".strata") names.push_back(entry->path().stem().string());
  }
  return names;
}

absl::StatusOr<std::vector<std::string>> NamesIn(api::Database& database,
                                                 const CompleteOptions& options) {
  const api::Call call{.stop = Stop(SteadyNow() + kDeadline), .request_id = "", .principal = ""};
  std::vector<std::string> names;
  if (options.names == kMapNames) {
    STRATA_ASSIGN_OR_RETURN(const auto maps, database.maps().List(call));
    for (const MapInfo& map : maps) names.push_back(map.name);
  } else if (options.names == kJobNames) {
    STRATA_ASSIGN_OR_RETURN(const auto jobs, database.jobs().List(call, options.map));
    for (const JobInfo& job : jobs) names.push_back(absl::StrCat(job.id));
  } else if (options.names == kClassifierNames) {
    STRATA_ASSIGN_OR_RETURN(const auto all, database.classifiers().List(call, options.map));
    for (const ClassifierInfo& classifier : all) names.push_back(classifier.name);
  } else if (options.names == kKindNames) {
    STRATA_ASSIGN_OR_RETURN(const auto kinds, database.objects().ListKinds(call, options.map));
    for (const KindInfo& kind : kinds) names.push_back(kind.name);
  } else if (options.names == kProfileNames) {
    STRATA_ASSIGN_OR_RETURN(const auto all, database.planning().ListProfiles(call, options.map));
    for (const auto& [name, profile] : all) names.push_back(name);
  }
  return names;
}

absl::StatusOr<std::vector<std::string>> NamesOf(const CompleteOptions& options,
                                                 const Said& said,
                                                 const FindTarget& find,
                                                 const OpenTarget& open) {
  if (options.names == kContextNames) return ContextNames();
  STRATA_ASSIGN_OR_RETURN(SavedContext target, find(said));
  if (!target.embedded.empty()) {
    return options.names == kMapNames ? MapsIn(target.embedded) : std::vector<std::string>();
  }
  target.server.connect_timeout = kDeadline;
  STRATA_ASSIGN_OR_RETURN(const auto database, open(target));
  return NamesIn(*database, options);
}

// Whatever goes wrong, a person who pressed a key is not told.
absl::Status Complete(FileContext& context,
                      const std::function<absl::StatusOr<std::vector<std::string>>()>& names_of) {
  std::signal(SIGALRM, [](int) { _exit(0); });
  alarm(kHardDeadlineSeconds);
  const absl::StatusOr<std::vector<std::string>> names = names_of();
  if (!names.ok()) return absl::OkStatus();
  for (const std::string& name : *names) {
    if (name.find_first_of(" \t\r\n'\"\\$`") == std::string::npos) context.output.Text(name);
  }
  return absl::OkStatus();
}

absl::Status Script(FileContext& context, CLI::App& root, const std::string& shell) {
  const std::vector<GrammarCommand> grammar = GrammarOf(root);
  const std::string script = shell == "bash"  ? BashScript(grammar)
                             : shell == "zsh" ? ZshScript(grammar)
                                              : FishScript(grammar);
  context.output.Text(script.substr(0, script.size() - 1));
  return absl::OkStatus();
}

}  // namespace

void AddCompletionCommands(Commands& commands, const Said& said, FindTarget find, OpenTarget open) {
  auto shell = std::make_shared<std::string>();
  CLI::App& root = commands.root;
  CLI::App* completion = commands.FileVerb(
      &root,
      "completion",
      "The script by which a shell completes command lines of strata: words, options, choices, "
      "files, and names of maps from the server",
      "source <(strata completion bash)   # in ~/.bashrc\n"
      "  strata completion zsh > ~/.zfunc/_strata   # a folder of $fpath, before compinit\n"
      "  strata completion fish > ~/.config/fish/completions/strata.fish",
      [shell, &root](FileContext& context) { return Script(context, root, *shell); });
  completion->add_option("SHELL", *shell, "Whose script")
      ->check(CLI::IsMember({"bash", "zsh", "fish"}))
      ->required();
  auto options = std::make_shared<CompleteOptions>();
  CLI::App* complete = commands.FileVerb(
      &root,
      "complete",
      "Names for the scripts of completion, one a line; nothing where they cannot be had",
      "strata complete maps",
      [options, &said, find = std::move(find), open = std::move(open)](FileContext& context) {
        return Complete(context, [&] { return NamesOf(*options, said, find, open); });
      });
  complete->group("");  // hidden
  complete->add_option("NAMES", options->names, "maps, jobs, classifiers, kinds …")->required();
  complete->add_option("MAP", options->map, "Whose");
}

}  // namespace strata::cli
