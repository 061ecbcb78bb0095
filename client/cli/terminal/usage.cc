#include "client/cli/terminal/usage.h"

#include <algorithm>
#include <cstddef>
#include <string>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"

namespace strata::cli {
namespace {

// Optimal string alignment: a swap of neighbours counts once.
std::size_t Distance(absl::string_view a, absl::string_view b) {
  std::vector<std::vector<std::size_t>> d(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) {
    for (std::size_t k = 0; k <= b.size(); ++k) {
      if (i == 0 || k == 0) {
        d[i][k] = i + k;
        continue;
      }
      const std::size_t changed = a[i - 1] == b[k - 1] ? 0 : 1;
      d[i][k] = std::min({d[i - 1][k] + 1, d[i][k - 1] + 1, d[i - 1][k - 1] + changed});
      if (i > 1 && k > 1 && a[i - 1] == b[k - 2] && a[i - 2] == b[k - 1]) {
        d[i][k] = std::min(d[i][k], d[i - 2][k - 2] + 1);
      }
    }
  }
  return d[a.size()][b.size()];
}

// The commands below `app` that have a name and are shown: option groups have none.
std::vector<std::string> CommandsOf(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands({})) {
    if (!command->get_name().empty() && !command->get_group().empty()) {
      names.push_back(command->get_name());
    }
  }
  return names;
}

void AddOptions(const CLI::App& app, std::vector<std::string>& names) {
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) {
      names.push_back("--" + name);
    }
  }
  for (const CLI::App* group : app.get_subcommands({})) {
    if (group->get_name().empty()) {
      AddOptions(*group, names);
    }
  }
}

// The commands on the line, from the program to the verb.
std::vector<const CLI::App*> Chosen(const CLI::App& root) {
  std::vector<const CLI::App*> chosen = {&root};
  while (true) {
    const CLI::App* next = nullptr;
    for (const CLI::App* command : chosen.back()->get_subcommands()) {
      if (!command->get_name().empty()) {
        next = command;
      }
    }
    if (next == nullptr) {
      return chosen;
    }
    chosen.push_back(next);
  }
}

// "scan import or kind import" of verbs with that name below the nouns of `app`.
std::string VerbsCalled(const CLI::App& app, const std::string& name) {
  std::vector<std::string> verbs;
  for (const CLI::App* noun : app.get_subcommands({})) {
    for (const std::string& verb : CommandsOf(*noun)) {
      if (verb == name) verbs.push_back(absl::StrCat(noun->get_name(), " ", verb));
    }
  }
  if (verbs.size() < 2) return absl::StrJoin(verbs, "");
  const std::string last = verbs.back();
  verbs.pop_back();
  return absl::StrCat(absl::StrJoin(verbs, ", "), " or ", last);
}

std::string DidYouMean(const std::string& nearest) {
  return nearest.empty() ? "" : absl::StrCat("; did you mean ", nearest, "?");
}

// What nobody knew, in the order of the line; CLI11 hands back several in the opposite order.
std::string Unknown(const CLI::App& root) {
  const std::vector<std::string> left = root.remaining(true);
  for (const std::string& word : left) {
    if (absl::StartsWith(word, "-")) {
      return word;
    }
  }
  return left.empty() ? "" : left.front();
}

std::string Complaint(const std::vector<const CLI::App*>& chosen,
                      const std::string& command,
                      const CLI::ParseError& error) {
  const std::string unknown = Unknown(*chosen.front());
  const std::vector<std::string> commands = CommandsOf(*chosen.back());
  if (absl::StartsWith(unknown, "-")) {
    std::vector<std::string> options;
    for (const CLI::App* app : chosen) {
      AddOptions(*app, options);
    }
    const std::string name = unknown.substr(0, unknown.find('='));
    return absl::StrCat("'", command, "' has no option ", name, DidYouMean(Nearest(name, options)));
  }
  if (!commands.empty()) {
    const std::string nearest = Nearest(unknown, commands);
    const std::string list =
        absl::StrCat("one of these is needed: ", absl::StrJoin(commands, ", "));
    const std::string below = nearest.empty() ? VerbsCalled(*chosen.back(), unknown) : "";
    if (unknown.empty()) {
      return absl::StrCat("after '", command, "' ", list);
    }
    return absl::StrCat(
        "'",
        command,
        "' has no command ",
        unknown,
        nearest.empty() && below.empty() ? "; " + list : DidYouMean(nearest + below));
  }
  if (!unknown.empty()) {
    return absl::StrCat("'", command, "' does not expect the word '", unknown, "'");
  }
  return error.what();
}

}  // namespace

std::string Nearest(absl::string_view word, const std::vector<std::string>& names) {
  std::string nearest;
  std::size_t least = word.size() / 3 + 1;
  for (const std::string& name : names) {
    const std::size_t distance = Distance(word, name);
    if (distance < least) {
      least = distance;
      nearest = name;
    }
  }
  return nearest;
}

std::string UsageMessage(const CLI::App& root, const CLI::ParseError& error) {
  const std::vector<const CLI::App*> chosen = Chosen(root);
  const std::string command = absl::StrJoin(
      chosen, " ", [](std::string* out, const CLI::App* app) { out->append(app->get_name()); });
  return absl::StrCat("error: ",
                      Complaint(chosen, command, error),
                      "\nRun '",
                      command,
                      " --help' for what it takes and an example.");
}

}  // namespace strata::cli
