#include "client/cli/terminal/confirm.h"

#include <sstream>
#include <string>

#include "absl/status/status.h"
#include <gtest/gtest.h>

namespace strata::cli {
namespace {

absl::Status Answer(const std::string& text, std::string* asked = nullptr) {
  std::istringstream answers(text);
  std::ostringstream talk;
  const absl::Status status = Ask("delete map campus?", answers, talk);
  if (asked != nullptr) *asked = talk.str();
  return status;
}

TEST(ConfirmTest, OnlyYesIsYes) {
  for (const char* yes : {"y\n", "Y\n", " yes \n", "YES"}) EXPECT_TRUE(Answer(yes).ok()) << yes;
  for (const char* no : {"", "\n", "n\n", "no\n", "yesterday\n", "\ny\n"}) {
    EXPECT_TRUE(absl::IsCancelled(Answer(no))) << no;
  }
}

TEST(ConfirmTest, AsksWhatItIsGivenAndNamesTheWayAround) {
  std::string asked;
  const absl::Status status = Answer("n\n", &asked);
  EXPECT_EQ(asked, "delete map campus? [y/N] ");
  EXPECT_NE(status.message().find("--yes"), std::string::npos) << status.message();
}

}  // namespace
}  // namespace strata::cli
