#include "server/access/grant_table.h"

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include "core/common/log_line.h"
#include "server/access/right.h"
#include "server/access/token.h"
#include "server/access/token_file.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata::server {
namespace {

using ::strata::testing::StatusIs;
using ::testing::_;

class GrantTableTest : public ::testing::Test {
 protected:
  static Grant GrantNamed(const std::string& name, const std::string& id) {
    Grant grant;
    grant.id = id;
    grant.name = name;
    grant.secret_sha256 = SecretHash(name);
    grant.maps = {{"*", Right::kRead}};
    return grant;
  }

  testing::TempDir dir_;
  const std::filesystem::path path_ = dir_.path() / "tokens.json";
  const Grant robot7_ = GrantNamed("robot7", "000000000007");
  const Grant robot8_ = GrantNamed("robot8", "000000000008");
};

TEST_F(GrantTableTest, WithoutAFileThereIsNoTable) {
  EXPECT_THAT(GrantTable::Open(path_), StatusIs(absl::StatusCode::kNotFound, _));
}

TEST_F(GrantTableTest, FollowsItsFile) {
  STRATA_ASSERT_OK(WriteTokenFile(path_, {robot7_}));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto table, GrantTable::Open(path_, absl::ZeroDuration()));
  EXPECT_TRUE(table->Current()->by_id.contains("000000000007"));
  STRATA_ASSERT_OK(WriteTokenFile(path_, {robot7_, robot8_}));
  EXPECT_TRUE(table->Current()->by_id.contains("000000000008"));
  STRATA_ASSERT_OK(WriteTokenFile(path_, {robot8_}));
  EXPECT_FALSE(table->Current()->by_id.contains("000000000007"));
}

TEST_F(GrantTableTest, WhoCameWentAndMayNowDoMoreIsSaidWithoutSecrets) {
  Grants before;
  before.by_id = {{robot7_.id, robot7_}, {robot8_.id, robot8_}};
  EXPECT_THAT(ChangesBetween(before, before), ::testing::IsEmpty());
  Grant more = robot7_;
  more.maps = {{"campus", Right::kWrite}, {"yard", Right::kRead}};
  more.secret_sha256 = SecretHash("other");
  Grant robot9 = GrantNamed("robot9", "000000000009");
  robot9.expires = absl::FromUnixSeconds(1'800'000'000);
  Grants after;
  after.by_id = {{more.id, more}, {robot9.id, robot9}};
  std::vector<std::string> said;
  for (const LogLine& line : ChangesBetween(before, after)) said.push_back(line.text());
  EXPECT_THAT(said,
              ::testing::ElementsAre(
                  "event=audit tokens=changed object=robot7 grant=000000000007 by=token "
                  "rights=\"campus:write yard:read\" expires=never was=robot7 rights_before=*:read "
                  "secret=another",
                  "event=audit tokens=removed object=robot8 grant=000000000008 by=token "
                  "rights=*:read expires=never",
                  "event=audit tokens=added object=robot9 grant=000000000009 by=token "
                  "rights=*:read expires=2027-01-15T08:00:00Z"));
}

TEST_F(GrantTableTest, ABrokenOrAbsentFileLeavesWhatHeld) {
  STRATA_ASSERT_OK(WriteTokenFile(path_, {robot7_}));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto table, GrantTable::Open(path_, absl::ZeroDuration()));
  std::ofstream(path_) << "{\"version\": 1, \"gra";
  EXPECT_TRUE(table->Current()->by_id.contains("000000000007"));
  std::filesystem::remove(path_);
  EXPECT_TRUE(table->Current()->by_id.contains("000000000007"));
  STRATA_ASSERT_OK(WriteTokenFile(path_, {}));
  EXPECT_TRUE(table->Current()->by_id.empty());
}

TEST_F(GrantTableTest, SaysForHowLongItsFileCannotBeRead) {
  STRATA_ASSERT_OK(WriteTokenFile(path_, {robot7_}));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto table, GrantTable::Open(path_, absl::ZeroDuration()));
  EXPECT_EQ(table->Unread(), absl::ZeroDuration());
  const std::filesystem::path away = dir_.path() / "away";
  std::filesystem::rename(path_, away);
  const absl::Duration first = table->Unread();
  EXPECT_GE(first, absl::ZeroDuration());
  absl::SleepFor(absl::Milliseconds(2));
  EXPECT_GT(table->Unread(), first);
  EXPECT_TRUE(table->Current()->by_id.contains("000000000007"));
  std::filesystem::rename(away, path_);
  EXPECT_EQ(table->Unread(), absl::ZeroDuration());
}

// A file whose mode was wrong for a while is the same file afterwards.
TEST_F(GrantTableTest, TriesAgainWhatLooksTheSame) {
  STRATA_ASSERT_OK(WriteTokenFile(path_, {robot7_}));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto table, GrantTable::Open(path_, absl::ZeroDuration()));
  STRATA_ASSERT_OK(WriteTokenFile(path_, {robot8_}));
  rlimit files{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &files), 0);
  const rlimit none{0, files.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &none), 0);
  EXPECT_GE(table->Unread(), absl::ZeroDuration());
  EXPECT_TRUE(table->Current()->by_id.contains("000000000007"));
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &files), 0);
  EXPECT_TRUE(table->Current()->by_id.contains("000000000008"));
}

TEST_F(GrantTableTest, LooksAtMostOnceInAnInterval) {
  STRATA_ASSERT_OK(WriteTokenFile(path_, {robot7_}));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto table, GrantTable::Open(path_, absl::Hours(1)));
  const auto before = table->Current();
  STRATA_ASSERT_OK(WriteTokenFile(path_, {}));
  EXPECT_EQ(table->Current(), before);
}

}  // namespace
}  // namespace strata::server
