#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_replace.h"

#include "client/cli/completion/scripts.h"

namespace strata::cli {
namespace {

constexpr char kZshHead[] = R"zsh(#compdef strata
# Completion of strata for zsh, made by 'strata completion zsh'.
# Tables by the words so far: what may follow, options, what options take, what arguments are.
typeset -gA _strata_below _strata_options _strata_values _strata_arguments
)zsh";

constexpr char kZshEngine[] = R"zsh(
# Candidates of a value: words, @files, @folders, or names that the server knows.
_strata_value() {
  local part names
  for part in ${(s: :)1}; do
    case $part in
      @files) _files ;;
      @folders) _files -/ ;;
      @*) names=$("$program" complete "${part#@}" ${map:+"$map"} "${target[@]}" 2>/dev/null </dev/null)
          compadd -- ${(f)names} ;;
      *) compadd -- $part ;;
    esac
  done
}

# What an option of the verb at $where, or else of the program, takes.
_strata_taken() {
  local key
  for key in "$where $1" " $1"; do
    if (( ${+_strata_values[$key]} )); then
      taken=$_strata_values[$key]
      return 0
    fi
  done
  taken=""
  return 1
}

_strata() {
  local program=$words[1] taken="" word option="" place=1 map="" where="" i
  local -a target arguments shown
  for ((i = 2; i < CURRENT; i++)); do
    word=${(Q)words[i]}
    if [[ -n $option ]]; then
      case $option in --server | --embedded | --context | --token-file | --tls-*) target+=("$option" "$word") ;; esac
      option=""
    elif [[ $word == --*=* ]]; then
      case $word in --server=* | --embedded=* | --context=* | --token-file=* | --tls-*) target+=("$word") ;; esac
    elif [[ $word == -?* ]]; then
      [[ $word == --insecure ]] && target+=("$word")
      _strata_taken $word && option=$word
    elif [[ $'\n'${_strata_below[$where.]-} == *$'\n'$word:* ]]; then
      where+=${where:+ }$word
    else
      ((place++ == 1)) && map=$word
    fi
  done
  if [[ -z $option && $words[CURRENT] == --*=* ]]; then
    option=${words[CURRENT]%%=*}
    compset -P '*='
  fi
  if [[ -n $option ]]; then
    _strata_taken $option
    _strata_value "$taken"
  elif [[ $words[CURRENT] == -* ]]; then
    shown=(${(f)_strata_options[$where.]-} ${(f)_strata_options[.]})
    _describe -o option shown
  elif [[ -n ${_strata_below[$where.]-} ]]; then
    shown=(${(f)_strata_below[$where.]})
    _describe command shown
  else
    arguments=("${(@f)_strata_arguments[$where.]-}")
    if [[ $arguments[-1] == ... ]]; then
      arguments[-1]=()
      ((place > $#arguments)) && place=$#arguments
    fi
    _strata_value "${arguments[place]-}"
  fi
}
if [[ $funcstack[1] == _strata ]]; then _strata "$@"; else compdef _strata strata; fi
)zsh";

// name:description as _describe takes it.
std::string Described(const std::string& name, const std::string& description) {
  return absl::StrCat(absl::StrReplaceAll(name, {{":", "\\:"}}), ":", description);
}

std::string ZshEntry(const std::string& table,
                     const std::string& key,
                     const std::vector<std::string>& lines) {
  if (lines.empty()) return "";
  return absl::StrCat(table, "+=(", Quoted(key), " ", Quoted(absl::StrJoin(lines, "\n")), ")\n");
}

std::string ZshTablesOf(const GrammarCommand& command) {
  std::string text;
  std::vector<std::string> below, options, arguments;
  for (const GrammarWord& word : command.below) {
    below.push_back(Described(word.name, word.description));
  }
  for (const GrammarOption& option : command.options) {
    for (const std::string& name : option.names) {
      options.push_back(Described(name, option.description));
      if (!option.takes_value) continue;
      text += ZshEntry(
          "_strata_values", absl::StrCat(command.path, " ", name), {ValueText(option.value)});
    }
  }
  for (const GrammarValue& value : command.arguments) arguments.push_back(ValueText(value));
  if (command.last_repeats) arguments.emplace_back("...");
  return absl::StrCat(text,
                      ZshEntry("_strata_below", command.path + ".", below),
                      ZshEntry("_strata_options", command.path + ".", options),
                      ZshEntry("_strata_arguments", command.path + ".", arguments));
}

}  // namespace

std::string ZshScript(const std::vector<GrammarCommand>& grammar) {
  std::string script = kZshHead;
  for (const GrammarCommand& command : grammar) script += ZshTablesOf(command);
  return script + kZshEngine;
}

}  // namespace strata::cli
