// A stratad with TLS and tokens, and `strata` as its user has it.
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "tests/client/cli/run_strata.h"
#include "tests/integration/stratad_process.h"
#include "tests/server/test_certificates.h"
#include "tests/support/temp_dir.h"

namespace strata::testing {
namespace {

using cli::Ran;
using cli::RunStrata;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class DoorsTest : public ::testing::Test {
 protected:
  using Words = std::vector<std::string>;

  std::string Path(const std::string& name) const { return (dir_.path() / name).string(); }

  // The standard output of `stratad` with these words; it must end with `exit_code`.
  static std::string RunStratad(const Words& words, int exit_code = 0) {
    StratadProcess stratad(words);
    std::string out;
    for (std::string line = stratad.ReadLine(); !line.empty(); line = stratad.ReadLine()) {
      out += line + "\n";
    }
    EXPECT_EQ(stratad.Wait(), exit_code) << out;
    return out;
  }
  // Makes access for `name` and keeps the token in a file of that name.
  void Give(const std::string& name, const Words& rights) const {
    Words words = {"token", "add", name, "--tokens", Path("tokens.json")};
    words.insert(words.end(), rights.begin(), rights.end());
    std::ofstream(Path(name)) << RunStratad(words);
  }
  Words ServeOptions() const {
    const TestCertificate certificate = authority_.Issue("server", "strata.example");
    return {"--data",
            Path("maps"),
            "--listen",
            "127.0.0.1:0",
            "--tls-cert",
            certificate.certificate.string(),
            "--tls-key",
            certificate.key.string(),
            "--tokens",
            Path("tokens.json")};
  }
  Ran Strata(StratadProcess& stratad, const std::string& token_of, const Words& verb) const {
    Words words = {"--server", stratad.Address(), "--tls-ca", Path("authority.pem")};
    if (!token_of.empty()) words.insert(words.end(), {"--token-file", Path(token_of)});
    words.insert(words.end(), verb.begin(), verb.end());
    return RunStrata(words);
  }

  TempDir dir_;
  const TestAuthority authority_{dir_.path(), "authority"};
};

TEST_F(DoorsTest, AContextHoldsServerAuthorityAndToken) {
  Give("ada", {"--right", "admin", "--all-maps"});
  Give("guest", {"--right", "read", "--map", "harbour"});
  StratadProcess stratad(ServeOptions());
  setenv("XDG_CONFIG_HOME", Path("config").c_str(), 1);
  for (const char* who : {"ada", "guest"}) {
    const Ran added = Strata(stratad, who, {"context", "add", who});
    EXPECT_EQ(added.exit_code, 0) << added.err;
  }
  EXPECT_EQ(RunStrata({"context", "use", "ada"}).exit_code, 0);
  EXPECT_EQ(RunStrata({"map", "create", "campus"}).exit_code, 0);
  EXPECT_EQ(RunStrata({"map", "create", "harbour"}).exit_code, 0);
  EXPECT_EQ(RunStrata({"complete", "maps"}).out, "campus\nharbour\n");
  EXPECT_EQ(RunStrata({"complete", "profiles", "campus"}).out, "default\n");
  // The guest sees one map, and is named with its context where it may not do something.
  EXPECT_EQ(RunStrata({"complete", "maps", "--context", "guest"}).out, "harbour\n");
  EXPECT_EQ(RunStrata({"map", "delete", "harbour", "--context", "guest"}).exit_code, 1);
  // The current context has the token of its own server only: elsewhere nothing is shown.
  const Ran elsewhere =
      RunStrata({"map", "list", "--server", stratad.Address(), "--tls-ca", Path("authority.pem")});
  EXPECT_EQ(elsewhere.exit_code, 1);
  EXPECT_THAT(elsewhere.err, HasSubstr("--token-file"));
  EXPECT_THAT(elsewhere.err, Not(HasSubstr("context ada")));
  std::ofstream(Path("guest")) << "ofnobody\n";
  EXPECT_THAT(RunStrata({"map", "list", "--context", "guest"}).err, HasSubstr("of context guest"));
  unsetenv("XDG_CONFIG_HOME");
}

TEST_F(DoorsTest, TheCommandLineComesInWithATokenAndDoesWhatItMay) {
  Give("ada", {"--right", "admin", "--all-maps"});
  Give("robot7", {"--right", "write", "--map", "campus"});
  Give("guest", {"--right", "read", "--map", "harbour"});
  StratadProcess stratad(ServeOptions());
  EXPECT_EQ(Strata(stratad, "ada", {"map", "create", "campus"}).exit_code, 0);
  EXPECT_EQ(Strata(stratad, "ada", {"map", "create", "harbour"}).exit_code, 0);
  EXPECT_THAT(Strata(stratad, "robot7", {"map", "list"}).out, HasSubstr("campus"));
  EXPECT_THAT(Strata(stratad, "guest", {"map", "list"}).out, Not(HasSubstr("campus")));

  const Ran refused = Strata(stratad, "robot7", {"map", "delete", "campus"});
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_THAT(refused.err, HasSubstr("robot7 lacks the right 'admin' on map campus"));
  const Ran none = Strata(stratad, "", {"map", "list"});
  EXPECT_EQ(none.exit_code, 1);
  EXPECT_THAT(none.err, HasSubstr("show a token with --token-file FILE"));
  const Ran foreign = Strata(stratad, "guest", {"map", "show", "campus"});
  EXPECT_EQ(foreign.exit_code, 1);
  EXPECT_THAT(foreign.err, HasSubstr("guest lacks the right 'read' on map campus"));

  const Ran plain = RunStrata({"--server", stratad.Address(), "map", "list"});
  EXPECT_EQ(plain.exit_code, 1);
  EXPECT_THAT(plain.err, HasSubstr("wants TLS"));
  stratad.Signal(SIGTERM);
  EXPECT_EQ(stratad.Wait(), 0);
}

TEST_F(DoorsTest, CheckSaysWhetherItCouldServe) {
  Give("ada", {"--right", "admin", "--all-maps"});
  Words words = ServeOptions();
  words.insert(words.begin(), "check");
  EXPECT_THAT(RunStratad(words), AllOf(HasSubstr("tokens: "), HasSubstr("1 clients, 0 expired")));
  std::ofstream(Path("tokens.json")) << "{";
  EXPECT_THAT(RunStratad(words, 1), HasSubstr("error   tokens: "));
}

TEST_F(DoorsTest, AFileThatIsNoMapKeepsNobodyFromStarting) {
  std::filesystem::create_directory(Path("maps"));
  std::ofstream(Path("maps/foreign.strata")) << "of another program";
  const Words words = {"--data", Path("maps"), "--listen", "127.0.0.1:0"};
  Words check = words;
  check.insert(check.begin(), "check");
  EXPECT_THAT(RunStratad(check), Not(HasSubstr("error")));
  check.emplace_back("--maps");
  EXPECT_THAT(RunStratad(check, 1), HasSubstr("error   map foreign: "));
  StratadProcess stratad(words);
  EXPECT_EQ(RunStrata({"--server", stratad.Address(), "map", "create", "campus"}).exit_code, 0);
}

TEST_F(DoorsTest, WhatItMakesIsNotForEverybodyOfTheMachine) {
  const mode_t before = ::umask(0);
  StratadProcess stratad({"--data", Path("maps"), "--listen", "127.0.0.1:0"});
  ::umask(before);
  EXPECT_EQ(RunStrata({"--server", stratad.Address(), "map", "create", "campus"}).exit_code, 0);
  std::vector<std::filesystem::path> made = {Path("maps")};
  for (const auto& entry : std::filesystem::directory_iterator(Path("maps"))) {
    made.push_back(entry.path());
  }
  EXPECT_GE(made.size(), 3);  // the folder, its lock, the map
  for (const std::filesystem::path& path : made) {
    const std::filesystem::perms mode = std::filesystem::status(path).permissions();
    EXPECT_EQ(mode & std::filesystem::perms::others_all, std::filesystem::perms::none) << path;
    EXPECT_EQ(mode & std::filesystem::perms::group_write, std::filesystem::perms::none) << path;
  }
}

TEST_F(DoorsTest, NorIsWhatTheCommandLineMakesByItself) {
  std::filesystem::create_directory(Path("open"));
  const mode_t before = ::umask(0);
  EXPECT_EQ(RunStrata({"--embedded", Path("open"), "map", "create", "campus"}).exit_code, 0);
  ::umask(before);
  for (const auto& entry : std::filesystem::directory_iterator(Path("open"))) {
    EXPECT_EQ(entry.status().permissions() & std::filesystem::perms::others_all,
              std::filesystem::perms::none)
        << entry.path();
  }
}

TEST_F(DoorsTest, BeyondLoopbackItNeedsTlsAndTokens) {
  Give("ada", {"--right", "admin", "--all-maps"});
  RunStratad({"--data", Path("maps"), "--listen", "0.0.0.0:0"}, 1);
  RunStratad({"--data", Path("maps"), "--listen", "0.0.0.0:0", "--tokens", Path("tokens.json")}, 1);
  RunStratad({"--data", Path("maps"), "--metrics", "0.0.0.0:0"}, 1);
  EXPECT_FALSE(std::filesystem::exists(Path("maps")));
  Words words = ServeOptions();
  words[3] = "0.0.0.0:0";
  StratadProcess stratad(words);
  EXPECT_THAT(stratad.Address(), HasSubstr("0.0.0.0:"));
}

}  // namespace
}  // namespace strata::testing
