#include "tests/client/cli/terminal/terminal_run.h"

#include <cstdlib>
#include <string>
#include <vector>

#include "absl/strings/str_replace.h"
#include <gtest/gtest.h>
#include <pty.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/support/paths.h"

namespace strata::cli {

Ran RunOnTerminal(std::vector<std::string> arguments,
                  const std::string& answer,
                  unsigned short columns) {
  arguments.insert(arguments.begin(), testing::StrataProgram());
  std::vector<char*> argv;
  for (std::string& word : arguments) argv.push_back(word.data());
  argv.push_back(nullptr);
  Ran ran;
  int terminal = -1;
  const winsize size{.ws_row = 24, .ws_col = columns, .ws_xpixel = 0, .ws_ypixel = 0};
  const pid_t child = forkpty(&terminal, nullptr, nullptr, &size);
  if (child == 0) {
    setenv("TERM", "xterm", 1);
    execv(argv[0], argv.data());
    _exit(127);
  }
  if (child < 0) return ran;
  EXPECT_EQ(write(terminal, answer.data(), answer.size()), static_cast<ssize_t>(answer.size()));
  char bytes[512];
  for (ssize_t n = 0; (n = read(terminal, bytes, sizeof(bytes))) > 0;) ran.out.append(bytes, n);
  int status = 0;
  waitpid(child, &status, 0);
  close(terminal);
  ran.out = absl::StrReplaceAll(ran.out, {{"\r\n", "\n"}});
  ran.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return ran;
}

}  // namespace strata::cli
