// What stratad does beside serving: options, tokens, check.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "absl/time/clock.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "core/engine/engine.h"
#include "server/access/token.h"
#include "server/access/token_file.h"
#include "server/check.h"
#include "server/options.h"
#include "server/token_commands.h"
#include "tests/server/new_grant.h"
#include "tests/server/test_certificates.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata::server {
namespace {

namespace fs = std::filesystem;
using ::strata::testing::IsOk;
using ::strata::testing::StatusIs;
using ::testing::AllOf;
using ::testing::Each;
using ::testing::Field;
using ::testing::HasSubstr;
using Code = absl::StatusCode;

absl::StatusOr<ProgramOptions> Parsed(std::vector<std::string> words) {
  CLI::App app;
  const auto read = AddServeOptions(app);
  std::reverse(words.begin(), words.end());  // as CLI11 takes them
  try {
    app.parse(words);
  } catch (const CLI::ParseError& error) {
    return absl::InvalidArgumentError(error.what());
  }
  return read();
}

TEST(OptionsTest, DefaultsAreThoseOfTheLibraries) {
  STRATA_ASSERT_OK_AND_ASSIGN(const ProgramOptions options, Parsed({"--data", "maps"}));
  const ServerOptions server;
  const EngineOptions engine;
  EXPECT_EQ(options.engine.directory, "maps");
  EXPECT_EQ(options.engine.queue_bytes, engine.queue_bytes);
  EXPECT_EQ(options.engine.cache_bytes, engine.cache_bytes);
  EXPECT_EQ(options.engine.max_map_bytes, engine.max_map_bytes);
  EXPECT_EQ(options.server.drain_timeout, server.drain_timeout);
  EXPECT_EQ(options.server.slow_sender_timeout, server.slow_sender_timeout);
  EXPECT_EQ(options.server.max_query_time, server.max_query_time);
  EXPECT_EQ(options.server.slow_reader_timeout, server.slow_reader_timeout);
  EXPECT_EQ(options.server.max_message_bytes, server.max_message_bytes);
  EXPECT_EQ(options.engine.optimize_interval, absl::Seconds(60));
  EXPECT_THAT(options.server.Validate(), IsOk());
  EXPECT_THAT(options.engine.Validate(), IsOk());
}

TEST(OptionsTest, AFileSaysTheSameAsTheCommandLineWhichGoesFirst) {
  const testing::TempDir dir;
  const std::string file = (dir.path() / "stratad.conf").string();
  std::ofstream(file)
      << "# of this site\ndata = /srv/maps\nlisten = \"0.0.0.0:1\"\nclient-rate = 20\n"
         "upload-idle = 1.5\ntokens = /etc/t.json\ninsecure = true\n";
  STRATA_ASSERT_OK_AND_ASSIGN(const ProgramOptions options,
                              Parsed({"--config", file, "--client-rate", "30"}));
  EXPECT_EQ(options.engine.directory, "/srv/maps");
  EXPECT_EQ(options.server.listen, "0.0.0.0:1");
  EXPECT_EQ(options.server.client.calls_per_second, 30);
  EXPECT_EQ(options.server.slow_sender_timeout, absl::Milliseconds(1500));
  EXPECT_EQ(options.server.token_file, "/etc/t.json");
  EXPECT_TRUE(options.server.insecure);
  std::ofstream(file) << "data = maps\nlisen = 127.0.0.1:1\n";
  EXPECT_THAT(Parsed({"--config", file}), StatusIs(Code::kInvalidArgument, HasSubstr("lisen")));
  EXPECT_THAT(Parsed({"--config", file + "x"}),
              StatusIs(Code::kInvalidArgument, HasSubstr("conf")));
}

TEST(OptionsTest, TheWebHasAnAddressNamesAndAViewer) {
  const testing::TempDir dir;
  STRATA_ASSERT_OK_AND_ASSIGN(const ProgramOptions none, Parsed({"--data", "maps"}));
  EXPECT_EQ(none.server.web_listen, "");
  STRATA_ASSERT_OK_AND_ASSIGN(const ProgramOptions options,
                              Parsed({"--data",
                                      "maps",
                                      "--web",
                                      "127.0.0.1:8080",
                                      "--web-name",
                                      "a.example",
                                      "--web-name",
                                      "b.example",
                                      "--web-viewer",
                                      "/srv/viewer"}));
  EXPECT_EQ(options.server.web_listen, "127.0.0.1:8080");
  EXPECT_THAT(options.server.web_names, ::testing::ElementsAre("a.example", "b.example"));
  EXPECT_EQ(options.server.web_viewer, "/srv/viewer");
  const std::string file = (dir.path() / "stratad.conf").string();
  std::ofstream(file) << "data = maps\nweb = 127.0.0.1:0\nweb-name = maps.example\n";
  STRATA_ASSERT_OK_AND_ASSIGN(const ProgramOptions written, Parsed({"--config", file}));
  EXPECT_EQ(written.server.web_listen, "127.0.0.1:0");
  EXPECT_THAT(written.server.web_names, ::testing::ElementsAre("maps.example"));
}

TEST(OptionsTest, NamesWhatIsOutOfRange) {
  const auto status = [](const char* option, const char* value) {
    return Parsed({"--data", "maps", option, value}).status();
  };
  EXPECT_THAT(status("--max-calls", "0"), StatusIs(Code::kInvalidArgument, HasSubstr("got 0")));
  EXPECT_THAT(status("--client-rate", "-1"),
              StatusIs(Code::kInvalidArgument, HasSubstr("calls/s")));
  EXPECT_THAT(status("--upload-idle", "nan"),
              StatusIs(Code::kInvalidArgument, HasSubstr("86400 s")));
  EXPECT_THAT(status("--max-message", "65"), StatusIs(Code::kInvalidArgument, HasSubstr("64 MiB")));
  EXPECT_THAT(Parsed({}), StatusIs(Code::kInvalidArgument, HasSubstr("--data is missing")));
}

// The output of `stratad token …`.
absl::StatusOr<std::string> RunToken(std::vector<std::string> words) {
  CLI::App app;
  CommandAction selected;
  AddTokenCommands(app, selected);
  words.insert(words.begin(), "token");
  std::reverse(words.begin(), words.end());
  try {
    app.parse(words);
  } catch (const CLI::ParseError& error) {
    return absl::InvalidArgumentError(error.what());
  }
  std::ostringstream out;
  const absl::Status status = selected(out);
  if (!status.ok()) return status;
  return out.str();
}

TEST(TokenCommandsTest, AddPrintsATokenThatTheFileKnowsByItsHash) {
  const testing::TempDir dir;
  const std::string file = (dir.path() / "tokens.json").string();
  STRATA_ASSERT_OK_AND_ASSIGN(const std::string printed,
                              RunToken({"add",
                                        "robot7",
                                        "--right",
                                        "write",
                                        "--map",
                                        "campus",
                                        "--map",
                                        "harbour",
                                        "--expires",
                                        "30d",
                                        "--tokens",
                                        file}));
  const auto token = ParseToken(printed.substr(0, printed.size() - 1));
  ASSERT_TRUE(token.has_value()) << printed;
  STRATA_ASSERT_OK_AND_ASSIGN(const std::vector<Grant> grants, ReadTokenFile(file));
  ASSERT_EQ(grants.size(), 1);
  EXPECT_EQ(grants[0].id, token->id);
  EXPECT_TRUE(SecretMatches(token->secret, grants[0].secret_sha256));
  EXPECT_TRUE(grants[0].Allows(Right::kWrite, "harbour"));
  EXPECT_FALSE(grants[0].Allows(Right::kAdmin, "harbour"));
  EXPECT_FALSE(grants[0].Allows(Right::kRead, "moon"));
  EXPECT_LT(absl::AbsDuration(grants[0].expires - absl::Now() - absl::Hours(720)),
            absl::Minutes(1));
  std::ifstream stream(file);
  std::stringstream text;
  text << stream.rdbuf();
  EXPECT_THAT(text.str(), ::testing::Not(HasSubstr(token->secret)));
}

TEST(TokenCommandsTest, ListShowsAndRevokeTakesAway) {
  const testing::TempDir dir;
  const std::string file = (dir.path() / "tokens.json").string();
  STRATA_ASSERT_OK(
      RunToken({"add", "ada", "--right", "admin", "--all-maps", "--tokens", file}).status());
  EXPECT_EQ(RunToken({"add",
                      "cam",
                      "--right",
                      "read",
                      "--all-maps",
                      "--certificate",
                      "--expires",
                      "never",
                      "--tokens",
                      file})
                .value(),
            "");
  EXPECT_THAT(RunToken({"add", "ada", "--right", "read", "--all-maps", "--tokens", file}),
              StatusIs(Code::kAlreadyExists, HasSubstr("ada")));
  EXPECT_THAT(RunToken({"list", "--tokens", file}).value(),
              AllOf(HasSubstr("*:admin"), HasSubstr("certificate"), HasSubstr("never")));
  STRATA_ASSERT_OK(RunToken({"revoke", "ada", "--tokens", file}).status());
  EXPECT_THAT(RunToken({"list", "--tokens", file}).value(), ::testing::Not(HasSubstr("ada")));
  EXPECT_THAT(RunToken({"revoke", "ada", "--tokens", file}),
              StatusIs(Code::kNotFound, HasSubstr("ada")));
}

TEST(TokenCommandsTest, RefusesWhatIsNotWhole) {
  const testing::TempDir dir;
  const std::string file = (dir.path() / "tokens.json").string();
  EXPECT_THAT(RunToken({"add", "ada", "--right", "admin", "--tokens", file}),
              StatusIs(Code::kInvalidArgument, HasSubstr("--all-maps")));
  EXPECT_THAT(RunToken({"add", "a b", "--right", "read", "--all-maps", "--tokens", file}),
              StatusIs(Code::kInvalidArgument, HasSubstr("a b")));
  EXPECT_THAT(RunToken({"add", "ada", "--right", "own", "--all-maps", "--tokens", file}),
              StatusIs(Code::kInvalidArgument, HasSubstr("own")));
  EXPECT_FALSE(fs::exists(file));
  EXPECT_EQ(ParseLifetime("90m").value(), absl::Minutes(90));
  EXPECT_EQ(ParseLifetime("12h").value(), absl::Hours(12));
  EXPECT_EQ(ParseLifetime("never").value(), absl::InfiniteDuration());
  for (const char* text : {"", "d", "30", "-1d", "0d", "1.5h", "30w", "99999999d", "1dd"}) {
    EXPECT_THAT(ParseLifetime(text), StatusIs(Code::kInvalidArgument, HasSubstr("never"))) << text;
  }
}

class CheckTest : public ::testing::Test {
 protected:
  CheckTest() {
    options_.engine.directory = dir_.path() / "maps";
    options_.server.listen = "127.0.0.1:0";
  }
  void MakeMap(const std::string& name) {
    const auto engine = OpenEngine(options_.engine);
    ASSERT_THAT(engine, IsOk());
    ASSERT_THAT((*engine)->maps().Create({}, name, {}), IsOk());
  }
  // The one finding about `what`.
  Finding Of(const std::string& what) {
    std::vector<Finding> findings = CheckInstallation(options_);
    for (Finding& map : CheckMaps(options_.engine)) findings.push_back(std::move(map));
    for (const Finding& finding : findings) {
      if (finding.what == what) return finding;
    }
    ADD_FAILURE() << "nothing about " << what;
    return {};
  }

  testing::TempDir dir_;
  ProgramOptions options_;
};

TEST_F(CheckTest, ASoundInstallationIsSound) {
  MakeMap("campus");
  const testing::TestAuthority authority(dir_.path(), "authority");
  const auto certificate =
      authority.Issue("server", "strata.example", -absl::Hours(1), absl::Hours(24 * 30));
  options_.server.tls.certificate = certificate.certificate;
  options_.server.tls.key = certificate.key;
  options_.server.token_file = dir_.path() / "tokens.json";
  AddToFile(options_.server.token_file, NewGrant("robot", {{kAllMaps, Right::kRead}}).first);
  options_.server.listen = "0.0.0.0:0";
  const std::vector<Finding> findings = CheckInstallation(options_);
  EXPECT_THAT(findings, Each(Field(&Finding::verdict, ::testing::Ne(Verdict::kError))))
      << ToText(findings);
  EXPECT_FALSE(AnyError(findings));
  const std::vector<Finding> maps = CheckMaps(options_.engine);
  EXPECT_THAT(ToText(maps), HasSubstr("ok      map campus: sound, format 3"));
  EXPECT_THAT(ToJson(maps), AllOf(HasSubstr("\"ok\": true"), HasSubstr("\"map campus\"")));
}

TEST_F(CheckTest, NamesEachThingThatIsWrong) {
  options_.server.listen = "0.0.0.0:0";
  EXPECT_EQ(Of("listen").verdict, Verdict::kError);
  options_.server.insecure = true;
  EXPECT_EQ(Of("listen").verdict, Verdict::kWarning);
  EXPECT_EQ(Of("data").verdict, Verdict::kWarning);  // not there yet
  EXPECT_FALSE(fs::exists(options_.engine.directory));
  std::ofstream(options_.engine.directory) << "a file";
  EXPECT_EQ(Of("data").verdict, Verdict::kError);

  const testing::TestAuthority authority(dir_.path(), "authority");
  const auto certificate = authority.Issue("server", "x", -absl::Hours(1), absl::Hours(24));
  options_.server.tls.certificate = certificate.certificate;
  options_.server.tls.key = certificate.key;
  EXPECT_EQ(Of("tls").verdict, Verdict::kWarning);
  EXPECT_THAT(Of("tls").message, HasSubstr("expires soon"));
  options_.server.tls.key = authority.Issue("other", "x").key;
  EXPECT_THAT(Of("tls").message, HasSubstr("is not the key"));

  options_.server.token_file = dir_.path() / "tokens.json";
  EXPECT_THAT(Of("tokens").message, HasSubstr("tokens.json"));
  EXPECT_EQ(Of("tokens").verdict, Verdict::kError);
  AddToFile(options_.server.token_file, NewGrant("robot", {{kAllMaps, Right::kRead}}).first);
  EXPECT_EQ(Of("tokens").verdict, Verdict::kOk);
  ::chmod(options_.server.token_file.c_str(), 0666);
  EXPECT_THAT(Of("tokens").message, HasSubstr("chmod 600"));
}

TEST_F(CheckTest, FindsDamageInAMap) {
  MakeMap("campus");
  MakeMap("moon");
  EXPECT_EQ(Of("map campus").verdict, Verdict::kOk);
  const fs::path file = options_.engine.directory / "campus.strata";
  {
    std::fstream bytes(file, std::ios::in | std::ios::out | std::ios::binary);
    bytes.seekp(16 << 10);  // behind the first pages, which say what the file is
    bytes << std::string(64 << 10, '\x5a');
  }
  EXPECT_EQ(Of("map campus").verdict, Verdict::kError) << Of("map campus").message;
  EXPECT_EQ(Of("map moon").verdict, Verdict::kOk);
  std::ofstream(file) << "no database";
  EXPECT_THAT(Of("map campus").message, HasSubstr("not a Strata map"));
  EXPECT_TRUE(AnyError(CheckMaps(options_.engine)));
  EXPECT_FALSE(AnyError(CheckInstallation(options_)));  // the server starts and serves the moon
}

}  // namespace
}  // namespace strata::server
