#include "client/cli/terminal/confirm.h"

#include <csignal>
#include <iostream>
#include <string>

#include "absl/strings/ascii.h"
#include <unistd.h>

namespace strata::cli {

void AddYes(CLI::App* verb, bool& yes) {
  verb->add_flag("--yes", yes, "Do not ask, as where there is no terminal");
}

absl::Status Ask(const std::string& question, std::istream& answers, std::ostream& talk) {
  talk << question << " [y/N] " << std::flush;
  std::string answer;
  std::getline(answers, answer);
  answer = absl::AsciiStrToLower(absl::StripAsciiWhitespace(answer));
  if (answer == "y" || answer == "yes") return absl::OkStatus();
  return absl::CancelledError("nothing was deleted; --yes deletes without being asked");
}

absl::Status Confirm(bool yes, const std::string& question) {
  if (yes || isatty(STDIN_FILENO) != 1 || isatty(STDERR_FILENO) != 1) return absl::OkStatus();
  const auto handler = std::signal(SIGINT, SIG_DFL);  // Ctrl-C is an answer
  const absl::Status answer = Ask(question, std::cin, std::cerr);
  std::signal(SIGINT, handler);
  return answer;
}

}  // namespace strata::cli
