// Deleting as a person does it, on a terminal.
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/client/cli/run_strata.h"
#include "tests/client/cli/terminal/terminal_run.h"
#include "tests/support/temp_dir.h"

namespace strata::cli {
namespace {

using ::testing::HasSubstr;

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
