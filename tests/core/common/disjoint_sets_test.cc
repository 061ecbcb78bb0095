#include "core/common/disjoint_sets.h"

#include <algorithm>
#include <cstddef>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace strata {
namespace {

// Beside labels that are written over at every join.
TEST(DisjointSetsTest, AreWhatJoinsSay) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    std::vector<std::size_t> labels(50);
    for (std::size_t i = 0; i < labels.size(); ++i) labels[i] = i;
    DisjointSets sets;
    for (int join = 0; join < 40; ++join) {
      const std::size_t a = random() % labels.size();
      const std::size_t b = random() % labels.size();
      EXPECT_EQ(sets.Join(a, b), labels[a] != labels[b]);
      const auto [low, high] = std::minmax({labels[a], labels[b]});
      std::replace(labels.begin(), labels.end(), std::size_t{high}, std::size_t{low});
    }
    for (std::size_t a = 0; a < labels.size(); ++a) {
      EXPECT_EQ(sets.Root(a), labels[a]);
      for (std::size_t b = 0; b < labels.size(); ++b) {
        EXPECT_EQ(sets.AreJoined(a, b), labels[a] == labels[b]);
      }
    }
    sets.clear();
    EXPECT_FALSE(sets.AreJoined(0, 1));
  }
}

}  // namespace
}  // namespace strata
