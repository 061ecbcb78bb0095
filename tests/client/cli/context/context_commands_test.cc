// strata context, as its users have it.
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/client/cli/strata_fixture.h"

namespace strata::cli {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class ContextCommandsTest : public StrataTest {
 protected:
  void SetUp() override {
    setenv("XDG_CONFIG_HOME", (dir_.path() / "config").c_str(), 1);
    unsetenv("STRATA_SERVER");
    unsetenv("STRATA_TOKEN");
  }
  void TearDown() override { unsetenv("XDG_CONFIG_HOME"); }

  // Of `strata context WORDS`.
  json Ok(std::vector<std::string> words) const {
    words.insert(words.begin(), "context");
    words.insert(words.end(), {"-o", "json"});
    const Ran ran = RunStrata(words);
    EXPECT_EQ(ran.exit_code, 0) << ran.err;
    return json::parse(ran.out, nullptr, false);
  }
  static std::string Error(const std::vector<std::string>& words) {
    const Ran ran = RunStrata(words);
    EXPECT_NE(ran.exit_code, 0);
    EXPECT_EQ(ran.out, "");
    return ran.err;
  }
  std::string File() const { return (dir_.path() / "config/strata/contexts.json").string(); }
};

TEST_F(ContextCommandsTest, ADirectoryIsMeantOnceItIsCurrent) {
  RunOk({"map", "create", "m"});
  EXPECT_EQ(Ok({"list"}), json::array());
  EXPECT_EQ(Ok({"add", "here", "--embedded", database_}).at("current"), false);
  EXPECT_THAT(Error({"context", "show"}), HasSubstr("no context is current"));
  EXPECT_EQ(Ok({"use", "here"}).at("current"), "here");
  EXPECT_EQ(Ok({"show"}).at("embedded"), database_);
  EXPECT_THAT(RunStrata({"map", "list"}).out, HasSubstr("\nm "));
  EXPECT_EQ(Ok({"use", "--none"}).at("current"), json());
  EXPECT_THAT(RunStrata({"map", "list", "--context", "here"}).out, HasSubstr("\nm "));
  EXPECT_EQ(Ok({"delete", "here"}).at("deleted"), "here");
  EXPECT_EQ(Ok({"list"}), json::array());
}

TEST_F(ContextCommandsTest, TokensAreKeptAsTheNamesOfTheirFilesUnlessAsked) {
  const std::string token = Write("token", "secret\n");
  Ok({"add", "lab", "--server", "127.0.0.1:1", "--token-file", token});
  EXPECT_THAT(Contents(File()), Not(HasSubstr("secret")));
  EXPECT_EQ(Ok({"show", "lab"}).at("token"), token);
  const Ran copied = RunStrata(
      {"context", "add", "copy", "--server", "127.0.0.1:1", "--token-file", token, "--copy-token"});
  EXPECT_EQ(copied.exit_code, 0) << copied.err;
  EXPECT_THAT(copied.out, Not(HasSubstr("secret")));
  EXPECT_THAT(Contents(File()), HasSubstr("\"token\": \"secret\""));
  EXPECT_EQ(Ok({"show", "copy"}).at("token"), "kept here");
  EXPECT_EQ(std::filesystem::status(File()).permissions() & std::filesystem::perms::all,
            std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
}

TEST_F(ContextCommandsTest, TroubleWithAServerNamesTheContext) {
  Ok({"add", "lab", "--server", "127.0.0.1:1", "--use"});
  EXPECT_THAT(Error({"map", "list"}), HasSubstr("context lab: no server answers at 127.0.0.1:1"));
  EXPECT_THAT(Error({"map", "list", "--server", "127.0.0.1:2"}), Not(HasSubstr("context")));
  EXPECT_THAT(Error({"map", "list", "--context", "lav"}), HasSubstr("did you mean lab?"));
}

TEST_F(ContextCommandsTest, WhatIsWrongIsSaid) {
  EXPECT_THAT(Error({"context", "add", "lab"}), HasSubstr("--server HOST:PORT"));
  EXPECT_THAT(Error({"context", "add", "a b", "--server", "x:1"}), HasSubstr("letters"));
  Ok({"add", "lab", "--server", "x:1"});
  EXPECT_THAT(Error({"context", "add", "lab", "--server", "y:2"}), HasSubstr("--replace"));
  EXPECT_EQ(Ok({"add", "lab", "--server", "y:2", "--replace"}).at("server"), "y:2");
  EXPECT_THAT(Error({"context", "use"}), HasSubstr("NAME is required"));
  EXPECT_THAT(Error({"context", "use", "lib"}), HasSubstr("did you mean lab?"));
  EXPECT_THAT(Error({"context", "delete", "sea"}), HasSubstr("does not exist"));
  EXPECT_THAT(Error({"context", "add", "t", "--server", "x:1", "--copy-token"}),
              HasSubstr("no token"));
  EXPECT_THAT(Error({"map", "list", "--context", "lab", "--embedded", database_}),
              HasSubstr("excludes"));
  Write("config/strata/contexts.json", "{");
  EXPECT_THAT(Error({"map", "list"}), HasSubstr("contexts.json"));
}

}  // namespace
}  // namespace strata::cli
