#include "client/cli/terminal/screen.h"

#include <algorithm>
#include <cstdlib>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <unistd.h>

namespace strata::cli {
namespace {

TEST(ScreenTest, APipeIsNoTerminalAndHasColourOnlyOnDemand) {
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  EXPECT_FALSE(ScreenOf(ends[1], "auto").terminal());
  EXPECT_FALSE(ScreenOf(ends[1], "auto").colour);
  EXPECT_FALSE(ScreenOf(ends[1], "never").colour);
  EXPECT_TRUE(ScreenOf(ends[1], "always").colour);
  close(ends[0]);
  close(ends[1]);
}

TEST(ScreenTest, PaintIsOnlyForScreensWithColour) {
  EXPECT_EQ(Painted("failed", Hue::kBad, {}), "failed");
  EXPECT_EQ(Painted("failed", Hue::kBad, {.columns = 80, .rows = 24, .colour = true}),
            "\x1b[31mfailed\x1b[0m");
  EXPECT_EQ(Painted("plain", Hue::kPlain, {.columns = 80, .rows = 24, .colour = true}), "plain");
}

TEST(ScreenTest, LettersOfSeveralBytesAreOneWide) {
  EXPECT_EQ(ShownWidth("m²"), 2U);
  EXPECT_EQ(ShownWidth("…"), 1U);
  EXPECT_EQ(ShownWidth(""), 0U);
}

TEST(FilledTest, WordsStayWholeAndGoOnBelowTheIndent) {
  EXPECT_EQ(Filled("one two three", 9, 2), "one two\n  three");
  EXPECT_EQ(Filled("one two three", 13, 2), "one two three");
  EXPECT_EQ(Filled("one two three", 0, 2), "one two three");
  EXPECT_EQ(Filled("unbreakable", 4, 2), "unbreakable");
  EXPECT_EQ(Filled("  in unbreakable words", 6, 2), "  in\n  unbreakable\n  words");
  EXPECT_EQ(Filled("four    ", 4, 0), "four    ");
}

TEST(FilledTest, HelpGoesOnBelowItsLastColumn) {
  EXPECT_EQ(FilledHelp("  --a FLOAT   Edge of a cell of the map\n\nEnd", 32),
            "  --a FLOAT   Edge of a cell of\n              the map\n\nEnd");
  EXPECT_EQ(FilledHelp("  --a FLOAT   Edge", 0), "  --a FLOAT   Edge");
}

// What holds of every filling: the same words in the same order, no line wider than it must be.
TEST(FilledTest, RandomTextsKeepTheirWords) {
  std::mt19937 random(7);
  const auto below = [&random](unsigned most) { return static_cast<std::size_t>(random() % most); };
  for (int round = 0; round < 2000; ++round) {
    std::vector<std::string> words;
    std::string text;
    const std::size_t count = 1 + below(12);
    for (std::size_t i = 0; i < count; ++i) {
      words.emplace_back(1 + below(9), 'a');
      const std::size_t blanks = i == 0 ? 0 : 1 + below(3);
      text += std::string(blanks, ' ') + words.back();
    }
    const std::size_t columns = 1 + below(30);
    const std::size_t indent = below(8);
    const std::string filled = Filled(text, columns, indent);
    std::istringstream again(filled);
    std::vector<std::string> found;
    for (std::string word; again >> word;) found.push_back(word);
    ASSERT_EQ(found, words) << filled;
    std::istringstream lines(filled);
    for (std::string line; std::getline(lines, line);) {
      const bool one_word = line.find(' ', line.find_first_not_of(' ')) == std::string::npos;
      ASSERT_TRUE(line.size() <= columns || one_word) << columns << "\n" << filled;
    }
  }
}

}  // namespace
}  // namespace strata::cli
