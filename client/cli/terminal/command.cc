#include "client/cli/terminal/command.h"

#include <string>
#include <utility>

namespace strata::cli {

namespace {

constexpr char kGlobalOptions[] =
    "Also --server HOST:PORT, --embedded DIR, --context NAME, -o text|json|csv: see strata "
    "--help.\n\n";

}  // namespace

CLI::App* Commands::Noun(const std::string& name,
                         const std::string& description,
                         const std::string& example) {
  CLI::App* noun = root.add_subcommand(name, description);
  noun->require_subcommand(1);
  noun->footer(kGlobalOptions + ("Example:\n  " + example));
  return noun;
}

CLI::App* Commands::Verb(CLI::App* noun,
                         const std::string& name,
                         const std::string& description,
                         const std::string& example,
                         Action action) {
  CLI::App* verb = noun->add_subcommand(name, description);
  verb->footer(kGlobalOptions + ("Example:\n  " + example));
  verb->callback([this, action = std::move(action)] { selected = action; });
  return verb;
}

CLI::App* Commands::FileVerb(CLI::App* noun,
                             const std::string& name,
                             const std::string& description,
                             const std::string& example,
                             FileAction action) {
  CLI::App* verb = noun->add_subcommand(name, description);
  verb->footer("Also -o text|json|csv; no server is asked.\n\nExample:\n  " + example);
  verb->callback([this, action = std::move(action)] { selected_on_files = action; });
  return verb;
}

}  // namespace strata::cli
