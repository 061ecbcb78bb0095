#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_replace.h"

#include "client/cli/completion/scripts.h"

namespace strata::cli {
namespace {

constexpr char kBashHead[] =
    R"bash(# Completion of strata for bash, made by 'strata completion bash'.
# Tables by the words so far: what may follow, options, what options take, what arguments are.
declare -A _strata_below _strata_options _strata_values _strata_arguments
)bash";

constexpr char kBashEngine[] = R"bash(
# Candidates of a value: words, @files, @folders, or names that the server knows.
_strata_value() {
  local part names words=""
  for part in $1; do
    case $part in
      @files) compopt -o filenames 2>/dev/null; mapfile -t -O ${#COMPREPLY[@]} COMPREPLY < <(compgen -f -- "$cur") ;;
      @folders) compopt -o filenames 2>/dev/null; mapfile -t -O ${#COMPREPLY[@]} COMPREPLY < <(compgen -d -- "$cur") ;;
      @*) names=$("$program" complete "${part#@}" ${map:+"$map"} "${target[@]}" 2>/dev/null </dev/null); words+=" $names" ;;
      *) words+=" $part" ;;
    esac
  done
  mapfile -t -O ${#COMPREPLY[@]} COMPREPLY < <(compgen -W "$words" -- "$cur")
}

_strata() {
  local words cur program word option="" value="" path="" map="" place=0 i arguments
  local -a target=()
  read -ra words <<<"${COMP_LINE:0:COMP_POINT}"
  [[ ${COMP_LINE:0:COMP_POINT} == *[[:space:]] ]] && words+=("")
  program=${words[0]/#\~/$HOME}
  cur=${words[-1]}
  COMPREPLY=()
  for ((i = 1; i < ${#words[@]} - 1; i++)); do
    word=${words[i]}
    if [[ -n $option ]]; then
      case $option in --server | --embedded | --context | --token-file | --tls-*) target+=("$option" "$word") ;; esac
      option=""
    elif [[ $word == --*=* ]]; then
      case $word in --server=* | --embedded=* | --context=* | --token-file=* | --tls-*) target+=("$word") ;; esac
    elif [[ $word == -?* ]]; then
      [[ $word == --insecure ]] && target+=("$word")
      [[ -n ${_strata_values["$path $word"]+x}${_strata_values[" $word"]+x} ]] && option=$word
    elif [[ " ${_strata_below["$path."]-} " == *" $word "* ]]; then
      path+=${path:+ }$word
    else
      ((place++)) || map=$word
    fi
  done
  if [[ -n $option ]]; then
    _strata_value "${_strata_values["$path $option"]-${_strata_values[" $option"]-}}"
  elif [[ $cur == --*=* ]]; then
    option=${cur%%=*} cur=${cur#*=}
    _strata_value "${_strata_values["$path $option"]-${_strata_values[" $option"]-}}"
  elif [[ $cur == -* ]]; then
    mapfile -t COMPREPLY < <(compgen -W "${_strata_options["$path."]-} ${_strata_options["."]}" -- "$cur")
  elif [[ -n ${_strata_below["$path."]-} ]]; then
    mapfile -t COMPREPLY < <(compgen -W "${_strata_below["$path."]}" -- "$cur")
  else
    mapfile -t arguments <<<"${_strata_arguments["$path."]-}"
    [[ ${arguments[-1]} == ... ]] && unset 'arguments[-1]' && ((place >= ${#arguments[@]})) && place=$((${#arguments[@]} - 1))
    _strata_value "${arguments[place]-}"
  fi
}
complete -F _strata strata
)bash";

std::string BashEntry(const std::string& table, const std::string& key, const std::string& value) {
  return absl::StrCat(table, "[", Quoted(key), "]=", Quoted(value), "\n");
}

std::string BashTablesOf(const GrammarCommand& command) {
  std::string text;
  std::vector<std::string> below;
  for (const GrammarWord& word : command.below) below.push_back(word.name);
  if (!below.empty())
    text += BashEntry("_strata_below", command.path + ".", absl::StrJoin(below, " "));
  std::vector<std::string> options;
  for (const GrammarOption& option : command.options) {
    options.insert(options.end(), option.names.begin(), option.names.end());
    if (!option.takes_value) continue;
    for (const std::string& name : option.names) {
      text += BashEntry(
          "_strata_values", absl::StrCat(command.path, " ", name), ValueText(option.value));
    }
  }
  text += BashEntry("_strata_options", command.path + ".", absl::StrJoin(options, " "));
  std::vector<std::string> arguments;
  for (const GrammarValue& value : command.arguments) arguments.push_back(ValueText(value));
  if (command.last_repeats) arguments.emplace_back("...");
  if (!arguments.empty()) {
    text += BashEntry("_strata_arguments", command.path + ".", absl::StrJoin(arguments, "\n"));
  }
  return text;
}

}  // namespace

std::string Quoted(const std::string& text) {
  return absl::StrCat("'", absl::StrReplaceAll(text, {{"'", "'\\''"}}), "'");
}

std::string BashScript(const std::vector<GrammarCommand>& grammar) {
  std::string script = kBashHead;
  for (const GrammarCommand& command : grammar) script += BashTablesOf(command);
  return script + kBashEngine;
}

}  // namespace strata::cli
