// Completion as shells do it, held against what --help lists.
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/client/cli/strata_fixture.h"
#include "tests/support/paths.h"

namespace strata::cli {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;
using Words = std::vector<std::string>;

bool Has(const std::string& program) {
  return std::system(("command -v " + program + " >/dev/null").c_str()) == 0;
}

// Of the lines of a help text below `heading`, the first words.
Words Listed(const std::string& help, const std::string& heading) {
  Words names;
  std::istringstream lines(help);
  bool below = false;
  for (std::string line; std::getline(lines, line);) {
    if (line == heading) {
      below = true;
    } else if (below && line.rfind("  ", 0) != 0) {
      break;
    } else if (below && line[2] != ' ') {
      names.push_back(line.substr(2, line.find_first_of(" ", 2) - 2));
    }
  }
  return names;
}

// All options that a help text shows, whatever they stand below.
std::set<std::string> OptionsOf(const std::string& help) {
  std::set<std::string> options;
  static const std::regex kOption("\n  +(-[^ ]+)");
  for (std::sregex_iterator at(help.begin(), help.end(), kOption), end; at != end; ++at) {
    std::istringstream names((*at)[1]);
    for (std::string name; std::getline(names, name, ',');) options.insert(name);
  }
  return options;
}

class CompletionTest : public StrataTest {
 protected:
  void SetUp() override {
    setenv("XDG_CONFIG_HOME", dir_.path().c_str(), 1);
    setenv("PROGRAM", testing::StrataProgram().c_str(), 1);
    for (const char* shell : {"bash", "zsh", "fish"}) {
      Write(shell, RunStrata({"completion", shell}).out);
    }
  }
  void TearDown() override { unsetenv("XDG_CONFIG_HOME"); }

  // What `script` prints when `shell` runs it.
  std::string RunShell(const std::string& shell, const std::string& script) const {
    const std::string file = Write("script", script);
    const std::string out = (dir_.path() / "out").string();
    EXPECT_EQ(std::system((shell + " " + file + " >" + out).c_str()), 0) << script;
    return Contents(out);
  }
  // What bash offers for each of these lines, the cursor at their ends.
  std::vector<Words> Bash(const Words& lines) const {
    std::string script = "source " + (dir_.path() / "bash").string() +
                         "\n"
                         "try() {\n"
                         "  COMP_LINE=\"$PROGRAM $1\"; COMP_POINT=${#COMP_LINE}\n"
                         "  COMPREPLY=(); _strata 2>&1; echo \"${COMPREPLY[*]}\"\n"
                         "}\n";
    for (const std::string& line : lines) script += "try '" + line + "'\n";
    std::istringstream printed(RunShell("bash", script));
    std::vector<Words> offered;
    for (std::string line; std::getline(printed, line);) {
      std::istringstream words(line);
      offered.emplace_back();
      for (std::string word; words >> word;) offered.back().push_back(word);
    }
    EXPECT_EQ(offered.size(), lines.size());
    offered.resize(lines.size());
    return offered;
  }
  Words Bash(const std::string& line) const { return Bash(Words{line}).front(); }
};

TEST_F(CompletionTest, EveryNounVerbAndOptionThatHelpShowsIsOffered) {
  const std::set<std::string> global = OptionsOf(RunStrata({"--help"}).out);
  Words lines;
  std::vector<std::set<std::string>> expected;
  const auto expect = [&](const std::string& line, const std::set<std::string>& words) {
    lines.push_back(line);
    expected.push_back(words);
  };
  const auto walk = [&](const auto& self, const Words& path) -> void {
    Words asked = path;
    asked.emplace_back("--help");
    const std::string help = RunStrata(asked).out;
    std::string line;
    for (const std::string& word : path) line += word + " ";
    std::set<std::string> options = OptionsOf(help);
    options.insert(global.begin(), global.end());
    expect(line + "-", options);
    const Words below = Listed(help, "Subcommands:");
    if (below.empty()) return;
    expect(line, {below.begin(), below.end()});
    // Verbs of two nouns are enough; their options are in no other way made than those of others.
    if (!path.empty() && path[0] != "map" && path[0] != "scan") return;
    for (const std::string& word : below) {
      Words longer = path;
      longer.push_back(word);
      self(self, longer);
    }
  };
  walk(walk, {});
  ASSERT_GT(lines.size(), 40U);
  const std::vector<Words> offered = Bash(lines);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    EXPECT_EQ(std::set<std::string>(offered[i].begin(), offered[i].end()), expected[i]) << lines[i];
  }
}

TEST_F(CompletionTest, ChoicesFilesAndFoldersOfOptions) {
  EXPECT_THAT(Bash("map render m --view "), UnorderedElementsAre("top", "oblique"));
  EXPECT_THAT(Bash("map render m --view=o"), ElementsAre("oblique"));
  EXPECT_THAT(Bash("map list -o "), UnorderedElementsAre("text", "table", "json", "csv"));
  EXPECT_THAT(Bash("--color "), UnorderedElementsAre("auto", "always", "never"));
  EXPECT_THAT(Bash("completion z"), ElementsAre("zsh"));
  EXPECT_THAT(Bash("job start m opt"), ElementsAre("optimize"));
  EXPECT_THAT(Bash("scan import m --poses no"), ElementsAre("none"));
  const std::string file = Write("drive/scan0.pcd", "");
  const std::string folder = std::filesystem::path(file).parent_path().string();
  EXPECT_THAT(Bash("scan import m " + folder + "/s"), ElementsAre(file));
  EXPECT_THAT(Bash("scan import m a b c " + folder + "/s"), ElementsAre(file));
  EXPECT_THAT(Bash("--tls-ca " + folder + "/s"), ElementsAre(file));
  EXPECT_THAT(Bash("--embedded " + folder.substr(0, folder.size() - 2)), ElementsAre(folder));
  EXPECT_THAT(Bash("--embedded " + folder + "/s"), IsEmpty());  // a file is no folder
  EXPECT_THAT(Bash("map create m --cell-size "), IsEmpty());
}

TEST_F(CompletionTest, NamesAreThoseOfTheDatabaseAndOfContexts) {
  RunOk({"map", "create", "campus"});
  RunOk({"map", "create", "harbour"});
  const std::string embedded = "--embedded " + database_;
  EXPECT_THAT(Bash("map show " + embedded + " "), UnorderedElementsAre("campus", "harbour"));
  EXPECT_THAT(Bash(embedded + " plan h"), ElementsAre("harbour"));
  EXPECT_THAT(Bash("map show --embedded=" + database_ + " c"), ElementsAre("campus"));
  EXPECT_THAT(Bash(embedded + " map create "), IsEmpty());  // is to be a new one
  EXPECT_THAT(Bash(embedded + " map merge all ha"), ElementsAre("harbour"));
  ASSERT_EQ(RunStrata({"context", "add", "lab", "--embedded", database_, "--use"}).exit_code, 0);
  EXPECT_THAT(Bash("context use "), ElementsAre("lab"));
  EXPECT_THAT(Bash("map show --context "), ElementsAre("lab"));
  EXPECT_THAT(Bash("map show "), UnorderedElementsAre("campus", "harbour"));
}

TEST_F(CompletionTest, WhereNothingCanBeAskedNothingIsSaid) {
  for (const char* line : {"map show --server 127.0.0.1:1 ",
                           "job show --server 127.0.0.1:1 m ",
                           "map show --context nobody ",
                           "map show --embedded /nowhere "}) {
    EXPECT_THAT(Bash(line), IsEmpty()) << line;  // stderr of the function is in the answer
  }
  const Ran ran = RunStrata({"complete", "maps", "--server", "127.0.0.1:1"});
  EXPECT_EQ(ran.exit_code, 0);
  EXPECT_EQ(ran.out + ran.err, "");
}

TEST_F(CompletionTest, AnInteractiveBashCompletes) {
  const std::string script = (dir_.path() / "bash").string();
  const std::string out = (dir_.path() / "interactive").string();
  const std::string line = "source " + script + "; complete -p strata; _strata_below_is=1";
  ASSERT_EQ(std::system(("bash --norc -ic '" + line + "' >" + out + " 2>/dev/null").c_str()), 0);
  EXPECT_EQ(Contents(out), "complete -F _strata strata\n");
}

TEST_F(CompletionTest, ZshOffersTheSame) {
  if (!Has("zsh")) GTEST_SKIP() << "no zsh";
  const std::string script = (dir_.path() / "zsh").string();
  RunShell("zsh -n", Contents(script));
  RunOk({"map", "create", "campus"});
  // What the script tells the completion system of zsh, which is on terminals only.
  const std::string system =
      "compdef() { :; }\n"
      "compadd() { shift; (( $# )) && print -rl -- $@; }\n"
      "_files() { print files $*; }\n"
      "_describe() { local name=$argv[-1]; print -rl -- ${(P)name}; }\n"
      "compset() { words[CURRENT]=${words[CURRENT]#*=}; }\n"
      "source " +
      script + "\n";
  const auto offered = [&](const std::string& words) {
    return RunShell("zsh -f",
                    system + "words=($PROGRAM " + words + "); CURRENT=$#words; _strata; true");
  };
  EXPECT_EQ(offered("map ver"), offered("map ''"));  // zsh itself chooses
  EXPECT_THAT(offered("map ''"), ::testing::HasSubstr("create:Create a map\n"));
  EXPECT_EQ(offered("map render m --view ''"), "top\noblique\n");
  EXPECT_EQ(offered("map render m --view=''"), "top\noblique\n");
  EXPECT_EQ(offered("scan import m a b ''"), "files\n");
  EXPECT_EQ(offered("--embedded " + database_ + " map show ''"), "campus\n");
  EXPECT_EQ(offered("map show --server 127.0.0.1:1 ''"), "");
  EXPECT_THAT(offered("map create --"), ::testing::HasSubstr("--cell-size:Edge of a cell [m]\n"));
}

TEST_F(CompletionTest, FishOffersTheSame) {
  if (!Has("fish")) GTEST_SKIP() << "no fish";
  const std::string script = (dir_.path() / "fish").string();
  RunShell("fish -n", Contents(script));
  RunOk({"map", "create", "campus"});
  const auto offered = [&](const std::string& line) {
    return RunShell("fish -N", "source " + script + "\ncomplete -C '" + line + "'");
  };
  setenv("PATH",
         (std::filesystem::path(testing::StrataProgram()).parent_path().string() + ":" +
          std::getenv("PATH"))
             .c_str(),
         1);
  EXPECT_EQ(offered("strata map ver"), "verify\tCheck every checksum, count and derived thing\n");
  EXPECT_EQ(offered("strata map render m --view "), "oblique\ntop\n");
  EXPECT_EQ(offered("strata map render m --view=o"), "--view=oblique\n");
  EXPECT_EQ(offered("strata --embedded " + database_ + " map show "), "campus\n");
  EXPECT_EQ(offered("strata map show --server 127.0.0.1:1 "), "");
  EXPECT_EQ(offered("strata map create --cell"), "--cell-size\tEdge of a cell [m]\n");
}

}  // namespace
}  // namespace strata::cli
