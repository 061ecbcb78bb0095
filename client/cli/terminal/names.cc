#include "client/cli/terminal/names.h"

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"

namespace strata::cli {
namespace {

// The parser keeps no notes on an option but its validators, which have names that nobody sees.
constexpr char kNameNote[] = "takes one of ";
constexpr char kWordNote[] = "takes the word ";
constexpr std::size_t kMostNotes = 8;

CLI::Option* Note(CLI::Option* option, const std::string& note) {
  return option->check(CLI::Validator([](std::string&) { return std::string(); }, "", note));
}

// What follows `kind` in the note of that kind.
std::string NoteOf(CLI::Option* option, const std::string& kind) {
  for (int i = 0; i < static_cast<int>(kMostNotes); ++i) {
    try {
      const std::string& name = option->get_validator(i)->get_name();
      if (name.rfind(kind, 0) == 0) return name.substr(kind.size());
    } catch (const CLI::OptionNotFound&) {
      break;
    }
  }
  return "";
}

}  // namespace

CLI::Option* TakesName(CLI::Option* option, absl::string_view names) {
  return Note(option, absl::StrCat(kNameNote, names));
}

CLI::Option* TakesWord(CLI::Option* option, const std::vector<std::string>& words) {
  return Note(option, absl::StrCat(kWordNote, absl::StrJoin(words, " ")));
}

std::string NamesTaken(CLI::Option* option) { return NoteOf(option, kNameNote); }

std::vector<std::string> WordsTaken(CLI::Option* option) {
  return absl::StrSplit(NoteOf(option, kWordNote), ' ', absl::SkipEmpty());
}

}  // namespace strata::cli
