#include "client/cli/completion/grammar.h"

#include <algorithm>
#include <cstddef>
#include <string>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "absl/strings/string_view.h"

#include "client/cli/terminal/names.h"

namespace strata::cli {
namespace {

// A line that a shell can show beside a word.
std::string FirstSentence(const std::string& text) {
  std::size_t end = std::min({text.find('\n'), text.find("; "), text.find(". "), text.size()});
  const std::size_t colon = text.find(": ");
  // Not the first of several choices, as in "ply: points; obj: …".
  if (colon < end && text.find(' ') < colon) end = colon;
  return text.substr(0, end);
}

bool IsWord(absl::string_view text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [](char letter) {
    return absl::ascii_islower(static_cast<unsigned char>(letter)) ||
           absl::ascii_isdigit(static_cast<unsigned char>(letter)) || letter == '-' ||
           letter == '_';
  });
}

// Choices stand in the type as in TEXT:{ply,pcd}, words beside others as in FILE|none.
std::vector<std::string> WordsOf(const std::string& type) {
  const std::size_t open = type.find('{');
  const std::size_t close = type.find('}');
  std::vector<std::string> words;
  if (open != std::string::npos && close != std::string::npos && open < close) {
    words = absl::StrSplit(type.substr(open + 1, close - open - 1), ',');
  } else {
    words = absl::StrSplit(type, '|');
  }
  std::erase_if(words, [](const std::string& word) { return !IsWord(word); });
  return words;
}

GrammarValue ValueOf(CLI::Option* option) {
  const std::string type = option->get_type_name();
  GrammarValue value;
  value.names = NamesTaken(option);
  value.words = WordsTaken(option);
  if (value.words.empty()) value.words = WordsOf(type);
  // An argument's description says that it is a file where its type does not.
  const bool argument = option->get_positional() && value.names.empty();
  const std::string told = argument ? absl::AsciiStrToLower(option->get_description()) : "";
  const auto says = [&](absl::string_view word) { return absl::StrContains(type, word); };
  value.files =
      says("FILE") || absl::StrContains(told, "file") || absl::StartsWith(type, "run.csv");
  value.folders = says("DIR") || says("FOLDER") || absl::StrContains(told, "folder");
  return value;
}

bool IsShown(const CLI::App& app) { return !app.get_group().empty(); }

void AddOptions(CLI::App& app, GrammarCommand& command) {
  for (CLI::Option* option : app.get_options()) {
    if (option->get_group().empty()) continue;
    if (option->get_positional()) {
      command.arguments.push_back(ValueOf(option));
      command.last_repeats = option->get_items_expected_max() > 1;
      continue;
    }
    GrammarOption added{.names = {},
                        .description = FirstSentence(option->get_description()),
                        .takes_value = option->get_items_expected_max() > 0,
                        .value = {}};
    for (const std::string& name : option->get_lnames()) added.names.push_back("--" + name);
    for (const std::string& name : option->get_snames()) added.names.push_back("-" + name);
    if (added.takes_value) added.value = ValueOf(option);
    command.options.push_back(added);
  }
  for (CLI::App* group : app.get_subcommands({})) {
    if (group->get_name().empty()) AddOptions(*group, command);
  }
}

void AddCommand(CLI::App& app, const std::string& path, std::vector<GrammarCommand>& grammar) {
  GrammarCommand command;
  command.path = path;
  AddOptions(app, command);
  std::vector<CLI::App*> below;
  for (CLI::App* each : app.get_subcommands({})) {
    if (each->get_name().empty() || !IsShown(*each)) continue;
    below.push_back(each);
    command.below.push_back({each->get_name(), FirstSentence(each->get_description())});
  }
  grammar.push_back(command);
  for (CLI::App* each : below) {
    AddCommand(*each, absl::StrCat(path, path.empty() ? "" : " ", each->get_name()), grammar);
  }
}

}  // namespace

std::vector<GrammarCommand> GrammarOf(CLI::App& root) {
  std::vector<GrammarCommand> grammar;
  AddCommand(root, "", grammar);
  return grammar;
}

std::string ValueText(const GrammarValue& value) {
  std::vector<std::string> parts;
  if (value.files) parts.emplace_back("@files");
  if (value.folders && !value.files) parts.emplace_back("@folders");
  if (!value.names.empty()) parts.push_back("@" + value.names);
  parts.insert(parts.end(), value.words.begin(), value.words.end());
  return absl::StrJoin(parts, " ");
}

}  // namespace strata::cli
