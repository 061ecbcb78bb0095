#include "client/cli/terminal/spelling.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace strata::cli {
namespace {

class SpellingTest : public ::testing::Test {
 protected:
  using Words = std::vector<std::string>;

  SpellingTest() {
    root_.add_option("--server", server_);
    CLI::App* map = root_.add_subcommand("map");
    map->add_subcommand("list");
    map->add_subcommand("delete");
    root_.add_subcommand("tile")->add_subcommand("get");
    root_.add_subcommand("plan");
  }
  Words Of(const Words& words) const { return Spelled(root_, words); }

  CLI::App root_{"", "strata"};
  std::string server_;
};

TEST_F(SpellingTest, HabitsBecomeCommands) {
  EXPECT_EQ(Of({"ls"}), Words({"map", "list"}));
  EXPECT_EQ(Of({"map", "ls"}), Words({"map", "list"}));
  EXPECT_EQ(Of({"map", "rm", "m"}), Words({"map", "delete", "m"}));
  EXPECT_EQ(Of({"version"}), Words({"--version"}));
  EXPECT_EQ(Of({"help"}), Words({"--help"}));
  EXPECT_EQ(Of({"help", "map", "list"}), Words({"map", "list", "--help"}));
  EXPECT_EQ(Of({"map", "help"}), Words({"map", "--help"}));
  EXPECT_EQ(Of({"help", "map", "ls"}), Words({"map", "list", "--help"}));
}

TEST_F(SpellingTest, OptionsBeforeThemAreSteppedOver) {
  EXPECT_EQ(Of({"--server", "ls", "map", "ls"}), Words({"--server", "ls", "map", "list"}));
  EXPECT_EQ(Of({"--server=x", "ls"}), Words({"--server=x", "map", "list"}));
  EXPECT_EQ(Of({"map", "--server", "x", "ls"}), Words({"map", "--server", "x", "list"}));
}

TEST_F(SpellingTest, WhatIsSomethingElseStays) {
  EXPECT_EQ(Of({}), Words({}));
  EXPECT_EQ(Of({"--help"}), Words({"--help"}));
  EXPECT_EQ(Of({"plan", "ls"}), Words({"plan", "ls"}));  // a map may be called so
  EXPECT_EQ(Of({"tile", "ls"}), Words({"tile", "ls"}));  // tiles have no list here
  EXPECT_EQ(Of({"map", "list", "ls"}), Words({"map", "list", "ls"}));
  EXPECT_EQ(Of({"--server"}), Words({"--server"}));
  EXPECT_EQ(Of({"map"}), Words({"map"}));
}

}  // namespace
}  // namespace strata::cli
