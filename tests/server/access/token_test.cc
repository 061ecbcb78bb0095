#include "server/access/token.h"

#include <set>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/status_matchers.h"

namespace strata::server {
namespace {

TEST(TokenTest, EveryTokenIsAnotherAndReadsAsItWasWritten) {
  std::set<std::string> secrets;
  std::set<std::string> ids;
  constexpr int kTokens = 1000;
  for (int i = 0; i < kTokens; ++i) {
    STRATA_ASSERT_OK_AND_ASSIGN(const Token token, NewToken());
    const auto read = ParseToken(token.ToString());
    ASSERT_TRUE(read.has_value()) << token.ToString();
    EXPECT_EQ(read->id, token.id);
    EXPECT_EQ(read->secret, token.secret);
    secrets.insert(token.secret);
    ids.insert(token.id);
  }
  EXPECT_EQ(secrets.size(), kTokens);
  EXPECT_EQ(ids.size(), kTokens);
}

TEST(TokenTest, WhatCannotBeATokenIsNone) {
  STRATA_ASSERT_OK_AND_ASSIGN(const Token token, NewToken());
  const std::string good = token.ToString();
  EXPECT_FALSE(ParseToken("").has_value());
  EXPECT_FALSE(ParseToken("strata_").has_value());
  EXPECT_FALSE(ParseToken(good.substr(1)).has_value());
  EXPECT_FALSE(ParseToken(good + "A").has_value());
  EXPECT_FALSE(ParseToken(good.substr(0, good.size() - 1)).has_value());
  for (std::size_t i = 0; i < good.size(); ++i) {
    for (const char bad : {'\0', '\n', '=', '*', '\x80'}) {
      std::string text = good;
      text[i] = bad;
      EXPECT_FALSE(ParseToken(text).has_value()) << i;
    }
  }
}

TEST(TokenTest, TheHashIsSha256) {
  // FIPS 180-2, appendix B.1.
  EXPECT_EQ(SecretHash("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_TRUE(SecretMatches("abc", SecretHash("abc")));
  EXPECT_FALSE(SecretMatches("abd", SecretHash("abc")));
  EXPECT_FALSE(SecretMatches("abc", ""));
  EXPECT_FALSE(SecretMatches("abc", SecretHash("abc").substr(0, 32)));
}

}  // namespace
}  // namespace strata::server
