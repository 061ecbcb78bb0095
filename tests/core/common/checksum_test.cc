#include "core/common/checksum.h"

#include <cstdint>
#include <random>
#include <set>
#include <string>

#include "absl/strings/string_view.h"
#include <gtest/gtest.h>

namespace strata {
namespace {

std::string RandomBytes(std::size_t count) {
  std::mt19937 random(9);
  std::string bytes(count, '\0');
  for (char& byte : bytes) byte = static_cast<char>(random());
  return bytes;
}

std::string DigestOf(absl::string_view bytes) {
  ContentHasher hasher;
  hasher.Add(bytes);
  return hasher.HexDigest();
}

// Published values of XXH3 of nothing: the stored format depends on them.
TEST(ChecksumTest, IsXxh3) {
  EXPECT_EQ(Checksum64(""), 0x2D06800538D394C2U);
  EXPECT_EQ(DigestOf(""), "99aa06d3014798d86001c324468d497f");
}

TEST(ChecksumTest, EveryFlippedBitShows) {
  std::string bytes = RandomBytes(300);
  std::set<std::uint64_t> sums = {Checksum64(bytes)};
  for (std::size_t bit = 0; bit < bytes.size() * 8; ++bit) {
    bytes[bit / 8] = static_cast<char>(bytes[bit / 8] ^ (1 << (bit % 8)));
    EXPECT_TRUE(sums.insert(Checksum64(bytes)).second) << bit;
    bytes[bit / 8] = static_cast<char>(bytes[bit / 8] ^ (1 << (bit % 8)));
  }
}

TEST(ContentHasherTest, SplittingDoesNotMatter) {
  const std::string bytes = RandomBytes(5000);
  const std::string whole = DigestOf(bytes);
  EXPECT_EQ(whole.size(), 32U);
  for (const std::size_t piece : {1, 7, 240, 1024, 4999}) {
    ContentHasher hasher;
    for (std::size_t i = 0; i < bytes.size(); i += piece) {
      hasher.Add(absl::string_view(bytes).substr(i, piece));
    }
    EXPECT_EQ(hasher.HexDigest(), whole) << piece;
  }
}

TEST(ContentHasherTest, DigestMayBeReadOnTheWay) {
  ContentHasher hasher;
  hasher.Add("ab");
  EXPECT_EQ(hasher.HexDigest(), DigestOf("ab"));
  EXPECT_EQ(hasher.HexDigest(), DigestOf("ab"));
  hasher.Add("c");
  EXPECT_EQ(hasher.HexDigest(), DigestOf("abc"));
  EXPECT_NE(DigestOf("abc"), DigestOf("ab"));
}

}  // namespace
}  // namespace strata
