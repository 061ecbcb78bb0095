#include "client/cli/terminal/usage.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace strata::cli {
namespace {

TEST(NearestTest, FindsWhatWasMeantAndNothingFarOff) {
  const std::vector<std::string> options = {"--from", "--to", "--cell-size", "--max-step"};
  EXPECT_EQ(Nearest("--form", options), "--from");
  EXPECT_EQ(Nearest("--cellsize", options), "--cell-size");
  EXPECT_EQ(Nearest("--cell-sise", options), "--cell-size");
  EXPECT_EQ(Nearest("--tp", options), "--to");
  EXPECT_EQ(Nearest("--verbose", options), "");
  EXPECT_EQ(Nearest("", options), "");
  EXPECT_EQ(Nearest("x", {}), "");
}

class UsageMessageTest : public ::testing::Test {
 protected:
  UsageMessageTest() {
    root_.fallthrough();
    root_.require_subcommand(1);
    root_.add_option("--output", output_);
    CLI::App* map = root_.add_subcommand("map");
    map->require_subcommand(1);
    CLI::App* create = map->add_subcommand("create");
    create->add_option("NAME", name_)->required();
    create->add_option_group("where")->add_option("--cell-size", cell_size_);
    map->add_subcommand("list");
  }
  std::string MessageFor(const std::string& line) {
    try {
      root_.parse(line);
    } catch (const CLI::ParseError& error) {
      return UsageMessage(root_, error);
    }
    return "parsed";
  }

  CLI::App root_{"", "strata"};
  std::string output_, name_;
  double cell_size_ = 0.0;
};

TEST_F(UsageMessageTest, NamesTheNearestOption) {
  EXPECT_EQ(MessageFor("map create m --cell-sise 0.1"),
            "error: 'strata map create' has no option --cell-sise; did you mean --cell-size?\n"
            "Run 'strata map create --help' for what it takes and an example.");
  EXPECT_EQ(MessageFor("map create m --ouptut=json").find("--ouptut; did you mean --output?"), 41U);
  EXPECT_EQ(MessageFor("map create --cellsize").find("--cellsize; did you mean --cell-size?"), 41U);
}

TEST_F(UsageMessageTest, NamesTheNearestCommandOrAllOfThem) {
  EXPECT_EQ(MessageFor("mpa list"),
            "error: 'strata' has no command mpa; did you mean map?\n"
            "Run 'strata --help' for what it takes and an example.");
  EXPECT_EQ(MessageFor("map fly"),
            "error: 'strata map' has no command fly; one of these is needed: create, list\n"
            "Run 'strata map --help' for what it takes and an example.");
  EXPECT_EQ(MessageFor("create x"),
            "error: 'strata' has no command create; did you mean map create?\n"
            "Run 'strata --help' for what it takes and an example.");
  EXPECT_EQ(MessageFor("map"),
            "error: after 'strata map' one of these is needed: create, list\n"
            "Run 'strata map --help' for what it takes and an example.");
}

TEST_F(UsageMessageTest, NamesAWordTooManyAndElseWhatTheParserSays) {
  EXPECT_EQ(MessageFor("map list extra"),
            "error: 'strata map list' does not expect the word 'extra'\n"
            "Run 'strata map list --help' for what it takes and an example.");
  EXPECT_EQ(MessageFor("map create"),
            "error: NAME is required\n"
            "Run 'strata map create --help' for what it takes and an example.");
}

}  // namespace
}  // namespace strata::cli
