// The program on terminals of several widths, and in pipes.
#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/client/cli/strata_fixture.h"
#include "tests/client/cli/terminal/terminal_run.h"

namespace strata::cli {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// Bytes that begin a letter.
std::size_t Width(const std::string& line) {
  return static_cast<std::size_t>(std::count_if(line.begin(), line.end(), [](char byte) {
    return (static_cast<unsigned char>(byte) >> 6U) != 2U;
  }));
}

std::size_t WidestLine(const std::string& text) {
  std::size_t widest = 0;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) widest = std::max(widest, Width(line));
  return widest;
}

std::string WithoutBlanks(const std::string& text) {
  std::string letters;
  for (const char letter : text) {
    if (letter != ' ' && letter != '\n') letters += letter;
  }
  return letters;
}

class TerminalTest : public StrataTest {
 protected:
  void SetUp() override { unsetenv("NO_COLOR"); }
  void TearDown() override { unsetenv("NO_COLOR"); }
};

TEST_F(TerminalTest, HelpIsAsWideAsTheTerminalAndSaysTheSame) {
  const std::string whole = RunStrata({"scan", "import", "--help"}).out;
  EXPECT_GT(WidestLine(whole), 183U);
  for (const unsigned short columns : {72, 100}) {
    const std::string shown = RunOnTerminal({"scan", "import", "--help"}, "", columns).out;
    // One word is wider: the formats there are.
    std::istringstream lines(shown);
    for (std::string line; std::getline(lines, line);) {
      const bool one_word = line.find(' ', line.find_first_not_of(' ')) == std::string::npos;
      EXPECT_TRUE(Width(line) <= columns || one_word || line.find("{auto") != std::string::npos)
          << line;
    }
    EXPECT_EQ(WithoutBlanks(shown), WithoutBlanks(whole));
  }
}

TEST_F(TerminalTest, ColourIsForTerminalsAndWhoeverWantsIt) {
  const std::string red = "\x1b[31m";
  const auto on_terminal = [this](std::vector<std::string> words) {
    words.insert(words.end(), {"--embedded", database_});
    return RunOnTerminal(words, "").out;
  };
  RunOk({"map", "create", "m"});
  EXPECT_THAT(on_terminal({"map", "show", "x"}), HasSubstr(red + "error:"));
  EXPECT_THAT(on_terminal({"map", "show", "x", "--color", "never"}), Not(HasSubstr("\x1b")));
  EXPECT_THAT(on_terminal({"map", "list"}), HasSubstr("\x1b[1mNAME"));
  setenv("NO_COLOR", "1", 1);
  EXPECT_THAT(on_terminal({"map", "show", "x"}), Not(HasSubstr("\x1b")));
  EXPECT_THAT(on_terminal({"map", "show", "x", "--colour", "always"}), HasSubstr(red));
  unsetenv("NO_COLOR");
  EXPECT_THAT(RunStrata({"map", "show", "x", "--embedded", database_}).err, Not(HasSubstr("\x1b")));
  EXPECT_THAT(RunStrata({"map", "show", "x", "--embedded", database_, "--color", "always"}).err,
              HasSubstr(red));
}

TEST_F(TerminalTest, LongListsAreCutToTheTerminalAndWholeInAPipe) {
  RunOk({"map", "create", "m"});
  for (int i = 0; i < 30; ++i) RunOk({"profile", "set", "m", "robot" + std::to_string(i)});
  const std::string shown =
      RunOnTerminal({"profile", "list", "m", "--embedded", database_}, "").out;
  EXPECT_THAT(shown, HasSubstr("… and 11 more"));
  const std::string all = RunStrata({"profile", "list", "m", "--embedded", database_}).out;
  EXPECT_THAT(all, HasSubstr("\nrobot9 "));
  EXPECT_THAT(all, Not(HasSubstr("…")));
}

TEST_F(TerminalTest, HabitsOfOtherProgramsWork) {
  RunOk({"map", "create", "campus"});
  EXPECT_THAT(RunOk({"ls"}).at(0).at("name"), "campus");
  EXPECT_THAT(RunOk({"map", "ls"}).at(0).at("scans"), 0);
  EXPECT_EQ(RunStrata({"version"}).out, RunStrata({"--version"}).out);
  EXPECT_EQ(RunStrata({"help"}).out, RunStrata({"--help"}).out);
  EXPECT_EQ(RunStrata({"help", "map", "create"}).out, RunStrata({"map", "create", "--help"}).out);
  const Ran missing = Run({"map", "show", "campsu"});
  EXPECT_EQ(missing.exit_code, 1);
  EXPECT_THAT(missing.err, HasSubstr("map campsu does not exist; did you mean campus?"));
  EXPECT_THAT(Run({"map", "show", "harbour"}).err, Not(HasSubstr("did you mean")));
  EXPECT_THAT(RunStrata({"import"}).err, HasSubstr("did you mean scan import, "));
  RunOk({"map", "rm", "campus"});
  EXPECT_TRUE(RunOk({"ls"}).empty());
}

TEST_F(TerminalTest, TablesAreCsvForEveryCommandThatListsRows) {
  RunOk({"map", "create", "m"});
  const auto csv = [this](std::vector<std::string> words) {
    words.insert(words.end(), {"--embedded", database_, "-o", "csv"});
    const Ran ran = RunStrata(words);
    EXPECT_EQ(ran.exit_code, 0) << ran.err;
    return ran.out;
  };
  EXPECT_THAT(csv({"map", "list"}), HasSubstr("name,created,cell_size_m"));
  EXPECT_THAT(csv({"map", "list"}), HasSubstr("\nm,"));
  for (const std::vector<std::string>& words :
       std::vector<std::vector<std::string>>{{"map", "show", "m"},
                                             {"map", "history", "m"},
                                             {"map", "classes", "m"},
                                             {"map", "floors", "m"},
                                             {"map", "places", "m"},
                                             {"scan", "list", "m"},
                                             {"pose", "list", "m"},
                                             {"tile", "list", "m"},
                                             {"profile", "list", "m"},
                                             {"job", "list", "m"},
                                             {"classifier", "list", "m"},
                                             {"kind", "list", "m"},
                                             {"posegraph", "show", "m"},
                                             {"surface", "m", "--at", "1,2"},
                                             {"plan", "m", "--from", "1,2", "--to", "3,4"},
                                             {"context", "list"}}) {
    const std::string table = csv(words);
    const std::string titles = table.substr(0, table.find('\n'));
    EXPECT_THAT(titles, HasSubstr(",")) << ::testing::PrintToString(words) << table;
    EXPECT_THAT(titles, Not(HasSubstr(" "))) << titles;
  }
}

}  // namespace
}  // namespace strata::cli
