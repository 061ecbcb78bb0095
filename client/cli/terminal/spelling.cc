#include "client/cli/terminal/spelling.h"

#include <cstddef>
#include <string>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_split.h"

namespace strata::cli {
namespace {

const CLI::App* Below(const CLI::App& app, const std::string& name) {
  for (const CLI::App* below : app.get_subcommands({})) {
    if (below->get_name() == name) return below;
  }
  return nullptr;
}

// Where the word after `begin` is that is no option of `root` and no value of one.
std::size_t NextWord(const CLI::App& root,
                     const std::vector<std::string>& words,
                     std::size_t begin) {
  std::size_t i = begin;
  while (i < words.size() && absl::StartsWith(words[i], "-")) {
    const CLI::Option* option = root.get_option_no_throw(words[i]);
    i += option != nullptr && option->get_items_expected_min() > 0 ? 2 : 1;
  }
  return i;
}

void Replace(std::vector<std::string>& words, std::size_t at, const std::string& by) {
  const std::vector<std::string> others = absl::StrSplit(by, ' ');
  words.erase(words.begin() + static_cast<std::ptrdiff_t>(at));
  words.insert(words.begin() + static_cast<std::ptrdiff_t>(at), others.begin(), others.end());
}

void SpellBelow(const CLI::App& app, bool root, std::size_t at, std::vector<std::string>& words) {
  const std::string word = words[at];
  if (Below(app, word) != nullptr) return;
  if (word == "help") {
    words.erase(words.begin() + static_cast<std::ptrdiff_t>(at));
    words.push_back("--help");
  } else if (root && word == "version") {
    words[at] = "--version";
  } else if (root && word == "ls") {
    Replace(words, at, "map list");
  } else if (word == "ls" && Below(app, "list") != nullptr) {
    words[at] = "list";
  } else if (word == "rm" && Below(app, "delete") != nullptr) {
    words[at] = "delete";
  }
}

}  // namespace

std::vector<std::string> Spelled(const CLI::App& root, std::vector<std::string> words) {
  const std::size_t noun = NextWord(root, words, 0);
  if (noun >= words.size()) return words;
  SpellBelow(root, true, noun, words);
  const std::size_t again = NextWord(root, words, 0);
  const CLI::App* app = again < words.size() ? Below(root, words[again]) : nullptr;
  const std::size_t verb = NextWord(root, words, again + 1);
  if (app == nullptr || app->get_subcommands({}).empty() || verb >= words.size()) return words;
  SpellBelow(*app, false, verb, words);
  return words;
}

}  // namespace strata::cli
