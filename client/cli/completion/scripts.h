// The scripts by which shells complete command lines of `strata`.
#ifndef STRATA_CLIENT_CLI_COMPLETION_SCRIPTS_H_
#define STRATA_CLIENT_CLI_COMPLETION_SCRIPTS_H_

#include <string>
#include <vector>

#include "client/cli/completion/grammar.h"

namespace strata::cli {

// Each holds the whole grammar, so that a key starts no program; only names of maps and of what is
// in them are asked for, by `strata complete NAMES [MAP]` with what the line says about the server.
std::string BashScript(const std::vector<GrammarCommand>& grammar);
std::string ZshScript(const std::vector<GrammarCommand>& grammar);
std::string FishScript(const std::vector<GrammarCommand>& grammar);

// `text` as one word of a shell.
std::string Quoted(const std::string& text);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_COMPLETION_SCRIPTS_H_
