#include "client/cli/command.h"

#include <string>
#include <utility>

namespace strata::cli {

CLI::App* Commands::Noun(const std::string& name, const std::string& description) {
  CLI::App* noun = root.add_subcommand(name, description);
  noun->require_subcommand(1);
  return noun;
}

CLI::App* Commands::Verb(CLI::App* noun,
                         const std::string& name,
                         const std::string& description,
                         const std::string& example,
                         Action action) {
  CLI::App* verb = noun->add_subcommand(name, description);
  verb->footer("Example:\n  " + example);
  verb->callback([this, action = std::move(action)] { selected = action; });
  return verb;
}

}  // namespace strata::cli
