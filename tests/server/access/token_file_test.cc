#include "server/access/token_file.h"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "server/access/token.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata::server {
namespace {

namespace fs = std::filesystem;
using ::strata::testing::IsOk;
using ::strata::testing::StatusIs;
using ::testing::HasSubstr;
using Code = absl::StatusCode;

Grant MakeGrant(const std::string& name, int number = 1) {
  Grant grant;
  grant.id = absl::StrCat(absl::Hex(number, absl::kZeroPad12));
  grant.name = name;
  grant.secret_sha256 = SecretHash(name);
  grant.maps = {{"campus", Right::kWrite}, {"*", Right::kRead}};
  grant.created = absl::FromUnixSeconds(1'700'000'000);
  grant.expires = absl::FromUnixSeconds(1'800'000'000);
  return grant;
}

TEST(TokenFileTest, ReadsWhatItWrote) {
  Grant certificate = MakeGrant("robot8", 2);
  certificate.secret_sha256.clear();
  certificate.expires = absl::InfiniteFuture();
  STRATA_ASSERT_OK_AND_ASSIGN(const std::vector<Grant> read,
                              DecodeGrants(EncodeGrants({MakeGrant("robot7"), certificate})));
  ASSERT_EQ(read.size(), 2);
  EXPECT_EQ(read[0].id, "000000000001");
  EXPECT_EQ(read[0].name, "robot7");
  EXPECT_EQ(read[0].secret_sha256, SecretHash("robot7"));
  EXPECT_EQ(read[0].maps, MakeGrant("robot7").maps);
  EXPECT_EQ(read[0].created, MakeGrant("robot7").created);
  EXPECT_EQ(read[0].expires, MakeGrant("robot7").expires);
  EXPECT_TRUE(read[1].by_certificate());
  EXPECT_EQ(read[1].expires, absl::InfiniteFuture());
}

TEST(TokenFileTest, RefusesWhatItDoesNotUnderstand) {
  const std::string good = EncodeGrants({MakeGrant("robot7")});
  ASSERT_THAT(DecodeGrants(good), IsOk());
  const auto with = [&good](const std::string& from, const std::string& to) {
    const std::string text = absl::StrReplaceAll(good, {{from, to}});
    EXPECT_NE(text, good) << from;
    return DecodeGrants(text).status();
  };
  EXPECT_THAT(with("\"expires\"", "\"expire\""),
              StatusIs(Code::kInvalidArgument, HasSubstr("grant 1: unknown field \"expire\"")));
  EXPECT_THAT(with("2027-01-15T08:00:00Z", "soon"),
              StatusIs(Code::kInvalidArgument, HasSubstr("no RFC 3339 time")));
  EXPECT_THAT(with("\"write\"", "\"own\""), StatusIs(Code::kInvalidArgument, HasSubstr("campus")));
  EXPECT_THAT(with("\"campus\"", "\"../x\""), StatusIs(Code::kInvalidArgument, HasSubstr("../x")));
  EXPECT_THAT(with("robot7", "robot 7"), StatusIs(Code::kInvalidArgument, HasSubstr("robot 7")));
  EXPECT_THAT(with("000000000001", "1"), StatusIs(Code::kInvalidArgument, HasSubstr("\"id\"")));
  EXPECT_THAT(with("\"version\": 1", "\"version\": 2"),
              StatusIs(Code::kInvalidArgument, HasSubstr("version")));
  EXPECT_THAT(DecodeGrants(EncodeGrants({MakeGrant("robot7", 1), MakeGrant("robot7", 2)})),
              StatusIs(Code::kInvalidArgument, HasSubstr("twice")));
  for (const char* text : {"", "[]", "{}", "null", "{\"version\":1,\"grants\":{}}", "\xff"}) {
    EXPECT_THAT(DecodeGrants(text), StatusIs(Code::kInvalidArgument, HasSubstr("token file")));
  }
  // A file that was cut off anywhere says nothing wrong.
  for (std::size_t size = 0; size + 2 < good.size(); ++size) {
    EXPECT_FALSE(DecodeGrants(good.substr(0, size)).ok()) << size;
  }
}

TEST(TokenFileTest, IsItsOwnersAloneAndStaysAsItsOwnerMadeIt) {
  const testing::TempDir dir;
  const fs::path path = dir.path() / "tokens.json";
  STRATA_ASSERT_OK(WriteTokenFile(path, {MakeGrant("robot7")}));
  struct stat made {};
  ASSERT_EQ(::stat(path.c_str(), &made), 0);
  EXPECT_EQ(made.st_mode & 0777U, 0600U);
  ASSERT_EQ(::chmod(path.c_str(), 0640), 0);
  STRATA_ASSERT_OK(WriteTokenFile(path, {}));
  ASSERT_EQ(::stat(path.c_str(), &made), 0);
  EXPECT_EQ(made.st_mode & 0777U, 0640U);
}

TEST(TokenFileTest, AFailedWriteLeavesTheOldFileAndNothingElse) {
  const testing::TempDir dir;
  const fs::path path = dir.path() / "tokens.json";
  // A directory cannot be replaced by a file.
  ASSERT_TRUE(fs::create_directory(path));
  EXPECT_FALSE(WriteTokenFile(path, {MakeGrant("robot7")}).ok());
  EXPECT_EQ(std::distance(fs::directory_iterator(dir.path()), fs::directory_iterator()), 1);
}

TEST(TokenFileTest, NobodysChangeIsLost) {
  const testing::TempDir dir;
  const fs::path path = dir.path() / "tokens.json";
  constexpr int kWriters = 8;
  constexpr int kEach = 5;
  std::vector<std::thread> writers;
  for (int w = 0; w < kWriters; ++w) {
    writers.emplace_back([&path, w] {
      for (int i = 0; i < kEach; ++i) {
        EXPECT_THAT(
            ChangeTokenFile(path,
                            [&](std::vector<Grant>& grants) {
                              const int number = w * kEach + i;
                              grants.push_back(MakeGrant(absl::StrCat("r", number), number));
                              return absl::OkStatus();
                            }),
            IsOk());
      }
    });
  }
  // A reader sees a whole file at any moment.
  for (int i = 0; i < 200; ++i) {
    const auto grants = ReadTokenFile(path);
    EXPECT_TRUE(grants.ok() || absl::IsNotFound(grants.status())) << grants.status();
  }
  for (std::thread& writer : writers) writer.join();
  STRATA_ASSERT_OK_AND_ASSIGN(const std::vector<Grant> grants, ReadTokenFile(path));
  EXPECT_EQ(grants.size(), kWriters * kEach);
}

TEST(TokenFileTest, AChangeThatIsRefusedChangesNothing) {
  const testing::TempDir dir;
  const fs::path path = dir.path() / "tokens.json";
  STRATA_ASSERT_OK(WriteTokenFile(path, {MakeGrant("robot7")}));
  EXPECT_THAT(ChangeTokenFile(path,
                              [](std::vector<Grant>& grants) {
                                grants.clear();
                                return absl::NotFoundError("nobody");
                              }),
              StatusIs(Code::kNotFound, "nobody"));
  EXPECT_EQ(ReadTokenFile(path)->size(), 1);
  // A file that cannot be read is not written over.
  std::ofstream(path) << "{";
  EXPECT_THAT(ChangeTokenFile(path, [](std::vector<Grant>&) { return absl::OkStatus(); }),
              StatusIs(Code::kInvalidArgument, HasSubstr("no JSON")));
}

}  // namespace
}  // namespace strata::server
