#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"

#include "client/cli/completion/scripts.h"

namespace strata::cli {
namespace {

constexpr char kFishHead[] =
    R"fish(# Completion of strata for fish, made by 'strata completion fish'.
# Tables with tabs between the words so far, a name, and what is said of it.
)fish";

constexpr char kFishEngine[] = R"fish(
# The rest of the lines of a table that begin with these words and, if given, this name.
function __strata_rows --argument-names table path name
    set -l key "^$path\t"
    test -n "$name"; and set key "$key$name\t"
    string replace --filter --regex -- $key '' $$table
end

# Candidates of a value: words, @files, @folders, or names that the server knows.
function __strata_value --argument-names values current
    for part in (string split --no-empty ' ' -- $values)
        switch $part
            case @files
                __fish_complete_path $current
            case @folders
                __fish_complete_directories $current ''
            case '@*'
                $__strata_program complete (string sub --start 2 -- $part) $__strata_map $__strata_target 2>/dev/null </dev/null
            case '*'
                echo $part
        end
    end
end

# What an option of the verb, or else of the program, takes.
function __strata_taken --argument-names path option
    if not __strata_rows __strata_values "$path" $option
        __strata_rows __strata_values '' $option
    end
end

function __strata_complete
    set -l words (commandline -opc)
    set -l current (commandline -ct)
    set -g __strata_program $words[1]
    set -g __strata_map
    set -g __strata_target
    set -l path ''
    set -l option ''
    set -l place 1
    for word in $words[2..-1]
        if test -n "$option"
            string match --quiet --regex -- '^--(server|embedded|context|token-file|tls-.*)$' $option
            and set -ga __strata_target $option $word
            set option ''
        else if string match --quiet -- '--*=*' $word
            string match --quiet --regex -- '^--(server|embedded|context|token-file|tls-.*)=' $word
            and set -ga __strata_target $word
        else if string match --quiet -- '-?*' $word
            test $word = --insecure; and set -ga __strata_target $word
            __strata_taken "$path" $word >/dev/null; and set option $word
        else if __strata_rows __strata_below "$path" $word >/dev/null
            set path (string trim -- "$path $word")
        else
            test $place -eq 1; and set __strata_map $word
            set place (math $place + 1)
        end
    end
    if test -n "$option"
        __strata_value "$(__strata_taken "$path" $option)" $current
    else if string match --quiet -- '--*=*' $current
        set -l parts (string split --max 1 = -- $current)
        __strata_value "$(__strata_taken "$path" $parts[1])" $parts[2] | string replace --regex '^' -- "$parts[1]="
    else if string match --quiet -- '-*' $current
        __strata_rows __strata_options "$path"
        test -n "$path"; and __strata_rows __strata_options ''
    else if __strata_rows __strata_below "$path" >/dev/null
        __strata_rows __strata_below "$path"
    else
        set -l arguments (__strata_rows __strata_arguments "$path")
        if test (count $arguments) -gt 0; and test "$arguments[-1]" = ...
            set -e arguments[-1]
            test $place -gt (count $arguments); and set place (count $arguments)
        end
        __strata_value "$arguments[$place]" $current
    end
end

complete --command strata --no-files --arguments '(__strata_complete)'
)fish";

// One word of fish, whose quotes know two escapes.
std::string FishLine(const std::string& path, const std::string& name, const std::string& rest) {
  const std::string line = absl::StrCat(path, "\t", name, name.empty() ? "" : "\t", rest);
  return absl::StrCat("    '", absl::StrReplaceAll(line, {{"\\", "\\\\"}, {"'", "\\'"}}), "' \\\n");
}

struct FishTables {
  std::string below, options, values, arguments;
};

void AddTo(const GrammarCommand& command, FishTables& tables) {
  const std::string& path = command.path;
  for (const GrammarWord& word : command.below) {
    tables.below += FishLine(path, word.name, word.description);
  }
  for (const GrammarOption& option : command.options) {
    for (const std::string& name : option.names) {
      tables.options += FishLine(path, name, option.description);
      if (option.takes_value) tables.values += FishLine(path, name, ValueText(option.value));
    }
  }
  for (const GrammarValue& value : command.arguments) {
    tables.arguments += FishLine(path, "", ValueText(value));
  }
  if (command.last_repeats) tables.arguments += FishLine(path, "", "...");
}

std::string FishSet(const std::string& table, const std::string& lines) {
  return absl::StrCat("set -g ", table, " \\\n", lines.substr(0, lines.size() - 3), "\n");
}

}  // namespace

std::string FishScript(const std::vector<GrammarCommand>& grammar) {
  FishTables tables;
  for (const GrammarCommand& command : grammar) AddTo(command, tables);
  return absl::StrCat(kFishHead,
                      FishSet("__strata_below", tables.below),
                      FishSet("__strata_options", tables.options),
                      FishSet("__strata_values", tables.values),
                      FishSet("__strata_arguments", tables.arguments),
                      kFishEngine);
}

}  // namespace strata::cli
