// Deleting as a person does it, on a terminal.
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pty.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/client/cli/run_strata.h"
#include "tests/support/paths.h"
#include "tests/support/temp_dir.h"

namespace strata::cli {
namespace {

using ::testing::HasSubstr;

// Runs the program on a terminal of its own, where somebody types `answer`; `out` has all that the
// terminal shows.
Ran RunOnTerminal(std::vector<std::string> arguments, const std::string& answer) {
  arguments.insert(arguments.begin(), testing::StrataProgram());
  std::vector<char*> argv;
  for (std::string& word : arguments) argv.push_back(word.data());
  argv.push_back(nullptr);
  Ran ran;
  int terminal = -1;
  const pid_t child = forkpty(&terminal, nullptr, nullptr, nullptr);
  if (child == 0) {
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
  ran.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return ran;
}

TEST(ConfirmOnTerminalTest, AMapIsDeletedWhenAPersonSaysSo) {
  const testing::TempDir dir;
  const std::string db = (dir.path() / "db").string();
  const auto exists = [&db] {
    return RunStrata({"map", "show", "m", "--embedded", db}).exit_code == 0;
  };
  ASSERT_EQ(RunStrata({"map", "create", "m", "--embedded", db}).exit_code, 0);
  const std::vector<std::string> erase = {"map", "delete", "m", "--embedded", db};
  const Ran kept = RunOnTerminal(erase, "n\n");
  EXPECT_EQ(kept.exit_code, 1) << kept.out;
  EXPECT_THAT(kept.out, HasSubstr("delete map m of 0 scans and its file for good? [y/N]"));
  EXPECT_TRUE(exists());
  EXPECT_EQ(RunOnTerminal(erase, "y\n").exit_code, 0);
  EXPECT_FALSE(exists());
  ASSERT_EQ(RunStrata({"map", "create", "m", "--embedded", db}).exit_code, 0);
  const Ran told = RunOnTerminal({"map", "delete", "m", "--yes", "--embedded", db}, "");
  EXPECT_EQ(told.exit_code, 0) << told.out;
  EXPECT_THAT(told.out, ::testing::Not(HasSubstr("[y/N]")));
}

TEST(ConfirmOnTerminalTest, ScriptsAreNotAsked) {
  const testing::TempDir dir;
  const std::string db = (dir.path() / "db").string();
  ASSERT_EQ(RunStrata({"map", "create", "m", "--embedded", db}).exit_code, 0);
  EXPECT_EQ(RunStrata({"map", "delete", "m", "--embedded", db}).exit_code, 0);
}

}  // namespace
}  // namespace strata::cli
