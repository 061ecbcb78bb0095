#include "core/common/log_line.h"

#include <sstream>
#include <string>

#include <gtest/gtest.h>

namespace strata {
namespace {

TEST(LogLineTest, PlainValuesStandAsTheyAre) {
  const LogLine line = LogLine("call").Add("map", "campus-2_a.b").Add("n", -3).Add("s", 0.5);
  EXPECT_EQ(line.text(), "event=call map=campus-2_a.b n=-3 s=0.5");
  std::ostringstream out;
  out << line;
  EXPECT_EQ(out.str(), line.text());
}

TEST(LogLineTest, WhatCouldBeTakenForMoreIsQuoted) {
  const auto value = [](absl::string_view text) { return LogLine("x").Add("v", text).text(); };
  EXPECT_EQ(value(""), "event=x v=\"\"");
  EXPECT_EQ(value("a b"), "event=x v=\"a b\"");
  EXPECT_EQ(value("a=b"), "event=x v=\"a=b\"");
  EXPECT_EQ(value("say \"no\""), "event=x v=\"say \\\"no\\\"\"");
  EXPECT_EQ(value("back\\slash"), "event=x v=\"back\\\\slash\"");
}

TEST(LogLineTest, ALineStaysALineWhateverAClientSends) {
  const std::string hostile = "a\nI1234 event=forged\r\x1b[2J" + std::string(1, '\0') + "\xff";
  const std::string text = LogLine("x").Add("peer", hostile).text();
  for (const char c : text) EXPECT_TRUE(c >= 0x20 && c < 0x7f) << static_cast<int>(c);
}

}  // namespace
}  // namespace strata
