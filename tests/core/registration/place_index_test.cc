#include "core/registration/place_index.h"

#include <algorithm>
#include <cstdint>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/common/random.h"

namespace strata {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

PlaceDescriptor RandomPlace(std::uint64_t seed) {
  SplitMix64 random(seed);
  PlaceDescriptor place;
  for (auto& v : place.spectrum)
    v = static_cast<std::int8_t>(static_cast<int>(random.Below(41)) - 20);
  return place;
}

// The same place turned by `shift` directions, with noise.
PlaceDescriptor Revisited(const PlaceDescriptor& place, int shift, std::uint64_t seed) {
  SplitMix64 random(seed);
  PlaceDescriptor other;
  for (int w = 0; w < PlaceDescriptor::kWaves; ++w) {
    for (int d = 0; d < PlaceDescriptor::kDirections; ++d) {
      const int to = (d + shift) % PlaceDescriptor::kDirections;
      other.spectrum[w * PlaceDescriptor::kDirections + to] =
          static_cast<std::int8_t>(place.spectrum[w * PlaceDescriptor::kDirections + d] +
                                   static_cast<int>(random.Below(17)) - 8);
    }
  }
  return other;
}

std::vector<std::uint64_t> Numbers(const std::vector<PlaceIndex::Neighbour>& neighbours) {
  std::vector<std::uint64_t> numbers;
  for (const auto& n : neighbours) numbers.push_back(n.number);
  return numbers;
}

constexpr auto kNone = [](std::uint64_t) { return false; };

TEST(PlaceIndexTest, FindsTheRevisitedPlaceAmongThousands) {
  PlaceIndex index;
  for (std::uint64_t i = 0; i < 2000; ++i) index.Add(i, RandomPlace(i));
  for (std::uint64_t i = 0; i < 2000; i += 211) {
    const auto found = index.Nearest(Revisited(RandomPlace(i), 23, i + 1), 3, kNone);
    ASSERT_EQ(found.size(), 3U);
    EXPECT_EQ(found[0].number, i);
    EXPECT_LT(found[0].similarity.distance, 0.3);
    EXPECT_GT(found[1].similarity.distance, 0.5);
  }
}

TEST(PlaceIndexTest, AnswersAreThoseOfComparingAll) {
  PlaceIndex index;
  for (std::uint64_t i = 0; i < 40; ++i) index.Add(i, RandomPlace(i));
  const PlaceDescriptor wanted = Revisited(RandomPlace(7), 5, 1);
  std::vector<std::pair<double, std::uint64_t>> all;
  for (std::uint64_t i = 0; i < 40; ++i) {
    all.emplace_back(ComparePlaces(RandomPlace(i), wanted).distance, i);
  }
  std::sort(all.begin(), all.end());
  const auto found = index.Nearest(wanted, 12, kNone);
  ASSERT_EQ(found.size(), 12U);
  for (std::size_t i = 0; i < found.size(); ++i) EXPECT_EQ(found[i].number, all[i].second);
}

TEST(PlaceIndexTest, RemovedReplacedAndExcludedPlacesAreNotFound) {
  PlaceIndex index;
  for (std::uint64_t i = 1; i <= 3; ++i) index.Add(i, RandomPlace(i));
  EXPECT_THAT(Numbers(index.Nearest(RandomPlace(1), 1, kNone)), ElementsAre(1));
  const auto not_one = [](std::uint64_t n) { return n == 1; };
  EXPECT_NE(index.Nearest(RandomPlace(1), 1, not_one)[0].number, 1U);
  EXPECT_EQ(*index.Find(1), RandomPlace(1));
  EXPECT_TRUE(index.Remove(1));
  EXPECT_FALSE(index.Remove(1));
  EXPECT_EQ(index.Find(1), nullptr);
  EXPECT_EQ(*index.Find(3), RandomPlace(3));
  EXPECT_EQ(index.size(), 2U);
  EXPECT_THAT(Numbers(index.Nearest(RandomPlace(3), 1, kNone)), ElementsAre(3));
  index.Add(3, RandomPlace(9));
  EXPECT_EQ(index.size(), 2U);
  EXPECT_THAT(Numbers(index.Nearest(RandomPlace(9), 1, kNone)), ElementsAre(3));
}

TEST(PlaceIndexTest, OrderOfAddingDoesNotMatter) {
  PlaceIndex forth;
  PlaceIndex back;
  for (std::uint64_t i = 0; i < 100; ++i) forth.Add(i, RandomPlace(i / 2));  // pairs alike: ties
  back.Add(1000, RandomPlace(1000));
  for (std::uint64_t i = 100; i-- > 0;) back.Add(i, RandomPlace(i / 2));
  back.Remove(1000);
  EXPECT_EQ(Numbers(forth.Nearest(RandomPlace(4), 20, kNone)),
            Numbers(back.Nearest(RandomPlace(4), 20, kNone)));
}

TEST(PlaceIndexTest, EmptyPlacesAreNearToNothing) {
  PlaceIndex index;
  EXPECT_THAT(index.Nearest(RandomPlace(1), 5, kNone), IsEmpty());
  index.Add(1, PlaceDescriptor());
  EXPECT_THAT(index.Nearest(RandomPlace(1), 5, kNone), IsEmpty());
  index.Add(2, RandomPlace(2));
  EXPECT_THAT(index.Nearest(PlaceDescriptor(), 5, kNone), IsEmpty());
  EXPECT_THAT(index.Nearest(RandomPlace(2), 0, kNone), IsEmpty());
}

}  // namespace
}  // namespace strata
