#include "client/cli/terminal/contexts.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata::cli {
namespace {

using ::strata::testing::IsOk;
using ::strata::testing::StatusIs;
using ::testing::_;
using ::testing::HasSubstr;
using Code = absl::StatusCode;

class ContextsTest : public ::testing::Test {
 protected:
  ContextsTest() {
    unsetenv(kServerVariable);
    unsetenv(kTokenVariable);
  }
  ~ContextsTest() override {
    unsetenv(kServerVariable);
    unsetenv(kTokenVariable);
  }
  static SavedContext Context(const std::string& server) {
    SavedContext context;
    context.server.server = server;
    return context;
  }
  // lab is current and has a token of its own, field has neither.
  void WriteTwo() {
    Contexts contexts;
    contexts.named["lab"] = Context("lab:1");
    contexts.named["lab"].server.tls_ca = "/lab.pem";
    contexts.named["lab"].server.token = "of-lab";
    contexts.named["field"] = Context("field:2");
    contexts.current = "lab";
    ASSERT_THAT(WriteContexts(path_, contexts), IsOk());
  }
  void Write(const std::string& text) {
    std::filesystem::create_directories(path_.parent_path());
    std::ofstream(path_) << text;
  }
  std::string Bytes() const {
    std::ostringstream bytes;
    bytes << std::ifstream(path_).rdbuf();
    return bytes.str();
  }
  // SERVER, CA and TOKEN of what is meant.
  std::string Meant(const Said& said) const {
    const auto target = ResolveContext(said, path_);
    if (!target.ok()) return target.status().ToString();
    const ServerOptions& server = target->server;
    const std::string token = server.token_file.empty() ? server.token : "@" + server.token_file;
    return target->embedded + server.server + " " + server.tls_ca + " " + token + " " +
           server.context;
  }

  testing::TempDir dir_;
  std::filesystem::path path_ = dir_.path() / "config" / "strata" / "contexts.json";
};

TEST_F(ContextsTest, WhatIsWrittenIsReadAgainAndOnlyItsUserCan) {
  WriteTwo();
  STRATA_ASSERT_OK_AND_ASSIGN(const Contexts read, ReadContexts(path_));
  EXPECT_EQ(read.current, "lab");
  ASSERT_EQ(read.named.size(), 2U);
  EXPECT_EQ(read.named.at("lab").server.server, "lab:1");
  EXPECT_EQ(read.named.at("lab").server.token, "of-lab");
  EXPECT_EQ(read.named.at("lab").server.context, "lab");
  EXPECT_EQ(read.named.at("field").server.tls_ca, "");
  const auto file = std::filesystem::status(path_).permissions();
  EXPECT_EQ(file & std::filesystem::perms::all,
            std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
  const auto folder = std::filesystem::status(path_.parent_path()).permissions();
  EXPECT_EQ(folder & std::filesystem::perms::all, std::filesystem::perms::owner_all);
  const std::string first = Bytes();
  ASSERT_THAT(WriteContexts(path_, read), IsOk());
  EXPECT_EQ(Bytes(), first);
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(path_.parent_path())) {
    files += entry.is_regular_file() ? 1 : 0;
  }
  EXPECT_EQ(files, 1);  // nothing half-written stays
}

TEST_F(ContextsTest, NoFileIsNoContextAndADamagedOneSaysWhatIsWrong) {
  STRATA_ASSERT_OK_AND_ASSIGN(const Contexts none, ReadContexts(path_));
  EXPECT_TRUE(none.named.empty());
  for (const char* text : {"{",
                           "[]",
                           R"({"contexts": []})",
                           R"({"current": 5})",
                           R"({"contexts": {"lab": 5}})",
                           R"({"contexts": {"lab": {}}})",
                           R"({"contexts": {"lab": {"server": 5}}})",
                           R"({"contexts": {"a b": {"server": "x:1"}}})",
                           R"({"contexts": {"lab": {"server": "x:1", "embedded": "y"}}})"}) {
    Write(text);
    EXPECT_THAT(ReadContexts(path_).status(),
                StatusIs(Code::kInvalidArgument, HasSubstr("contexts.json")))
        << text;
  }
  Write(std::string((1 << 20) + 1, ' '));
  EXPECT_THAT(ReadContexts(path_).status(), StatusIs(Code::kInvalidArgument, HasSubstr("bytes")));
}

TEST_F(ContextsTest, FlagsComeBeforeTheEnvironmentBeforeContextsBeforeTheDefault) {
  const std::string fallback = ServerOptions().server;
  EXPECT_EQ(Meant({}), fallback + "   ");
  WriteTwo();
  EXPECT_EQ(Meant({}), "lab:1 /lab.pem of-lab lab");
  Said field;
  field.context = "field";
  EXPECT_EQ(Meant(field), "field:2   field");
  Said server;
  server.server = true;
  server.flags.server = "flag:3";
  EXPECT_EQ(Meant(server), "flag:3   ");
  Said embedded;
  embedded.embedded = "maps";
  EXPECT_EQ(ResolveContext(embedded, path_)->embedded, "maps");
  setenv(kServerVariable, "env:4", 1);
  Said env;
  env.flags.server = "env:4";  // as the parser has it then
  EXPECT_EQ(Meant(env), "env:4   ");
  env.context = "lab";  // a flag
  EXPECT_EQ(Meant(env), "lab:1 /lab.pem of-lab lab");
}

TEST_F(ContextsTest, TheTokenOfAContextIsForItsServer) {
  WriteTwo();
  Said file;
  file.flags.token_file = "/mine";
  EXPECT_EQ(Meant(file), "lab:1 /lab.pem @/mine lab");
  setenv(kTokenVariable, "of-env", 1);
  EXPECT_EQ(Meant({}), "lab:1 /lab.pem  lab");  // that of the environment is shown
  Said lab;
  lab.context = "lab";
  EXPECT_EQ(Meant(lab), "lab:1 /lab.pem of-lab lab");
  // Said with both: an address for who one is in the context.
  lab.server = true;
  lab.flags.server = "tunnel:5";
  EXPECT_EQ(Meant(lab), "tunnel:5 /lab.pem of-lab lab");
}

TEST_F(ContextsTest, ADamagedFileIsInTheWayOnlyOfWhoNeedsIt) {
  Write("{");
  EXPECT_THAT(Meant({}), HasSubstr("contexts.json"));
  Said server;
  server.server = true;
  server.flags.server = "flag:3";
  EXPECT_EQ(Meant(server), "flag:3   ");
}

TEST_F(ContextsTest, AnUnknownNameIsAnsweredWithTheNearest) {
  WriteTwo();
  Said said;
  said.context = "fild";
  EXPECT_THAT(Meant(said), HasSubstr("context fild does not exist; did you mean field?"));
  said.context = "sea";
  EXPECT_THAT(Meant(said), HasSubstr("see strata context list"));
}

TEST_F(ContextsTest, NamesAreSimple) {
  for (const char* good : {"lab", "a.b-c_9"}) EXPECT_THAT(ValidateContextName(good), IsOk());
  for (const std::string bad : {"", "a b", "-x", "a/b", "ä"}) {
    EXPECT_THAT(ValidateContextName(bad), StatusIs(Code::kInvalidArgument, _)) << bad;
  }
  EXPECT_THAT(ValidateContextName(std::string(65, 'a')), StatusIs(Code::kInvalidArgument, _));
}

}  // namespace
}  // namespace strata::cli
