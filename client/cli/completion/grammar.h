// What a command line may look like, read from the parser's tree: the tables of completion.
#ifndef STRATA_CLIENT_CLI_COMPLETION_GRAMMAR_H_
#define STRATA_CLIENT_CLI_COMPLETION_GRAMMAR_H_

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

namespace strata::cli {

// What may stand where a value is wanted.
struct GrammarValue {
  bool files = false;
  bool folders = false;
  std::string names;               // of these things (terminal/names.h); empty: of none
  std::vector<std::string> words;  // one of them
};

struct GrammarOption {
  std::vector<std::string> names;  // with their dashes
  std::string description;         // its first sentence
  bool takes_value = false;
  GrammarValue value;
};

struct GrammarWord {
  std::string name;
  std::string description;  // its first sentence
};

// A program, noun or verb.
struct GrammarCommand {
  std::string path;  // of words, as in "map create"; empty: the program
  std::vector<GrammarWord> below;
  std::vector<GrammarOption> options;   // also those of option groups
  std::vector<GrammarValue> arguments;  // in their order
  bool last_repeats = false;            // any number of the last argument may come
};

// The program first, everything else after what it stands below. What help does not show is left
// out.
std::vector<GrammarCommand> GrammarOf(CLI::App& root);

// Of `value`: "@files", "@folders", "@maps" and words, separated by blanks, as scripts read it.
std::string ValueText(const GrammarValue& value);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_COMPLETION_GRAMMAR_H_
