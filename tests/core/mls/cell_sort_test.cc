// The sort of map creation against std::stable_sort.
#include "core/mls/cell_sort.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <random>
#include <set>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include "core/mls/measurement.h"

namespace strata {
namespace {

IndexedMeasurement MakeItem(std::uint64_t key, std::uint32_t index, IndexedMeasurement) {
  return {key, index};
}
Measurement MakeItem(std::uint64_t key, std::uint32_t, Measurement) { return {key}; }

bool Same(const Measurement& a, const Measurement& b) { return a.key == b.key; }
bool Same(const IndexedMeasurement& a, const IndexedMeasurement& b) {
  return a.key == b.key && a.point == b.point;
}

// As whoever makes the items counts them.
template <typename Item>
std::size_t Sort(std::vector<Item>& items, CellSortScratch& scratch) {
  for (const Item& item : items) {
    ++scratch.low_count[CellOfKey(item.key) & CellSortScratch::kLowMask];
    scratch.tile_seen[item.key >> 48] = 1;
  }
  std::vector<Item> other(items.size());
  return SortByCell(std::span<Item>(items), other.data(), scratch);
}

template <typename Item>
class CellSortTest : public ::testing::Test {
 protected:
  // Sorts, and compares with the oracle; heights are left as they came.
  void Check(std::vector<Item> items) {
    std::vector<Item> expected = items;
    std::stable_sort(expected.begin(), expected.end(), [](const Item& a, const Item& b) {
      return CellOfKey(a.key) < CellOfKey(b.key);
    });
    std::set<std::uint64_t> tiles;
    for (const Item& item : items) tiles.insert(item.key >> 48);
    EXPECT_EQ(Sort(items, scratch_), tiles.size());
    EXPECT_TRUE(
        std::equal(items.begin(), items.end(), expected.begin(), [](const Item& a, const Item& b) {
          return Same(a, b);
        }));
    const auto zero = [](auto count) { return count == 0; };
    EXPECT_TRUE(std::all_of(scratch_.low_count.begin(), scratch_.low_count.end(), zero));
    EXPECT_TRUE(std::all_of(scratch_.tile_seen.begin(), scratch_.tile_seen.end(), zero));
  }
  // Keys with bits of `mask` drawn at random, the others those of `base`.
  std::vector<Item> Draw(std::size_t count, std::uint64_t mask, std::uint64_t base) {
    std::vector<Item> items;
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint64_t key = (random_() & mask) | (base & ~mask);
      items.push_back(MakeItem(key, static_cast<std::uint32_t>(i), Item()));
    }
    return items;
  }

  CellSortScratch scratch_;  // one for all sorts of a test: nothing of one may show in the next
  std::mt19937_64 random_{20261121};
};

using Items = ::testing::Types<Measurement, IndexedMeasurement>;
TYPED_TEST_SUITE(CellSortTest, Items);

TYPED_TEST(CellSortTest, IsTheStableSortByCell) {
  SCOPED_TRACE("seed 20261121");
  for (const std::size_t count : {0, 1, 2, 3, 63, 1000, 100'000}) {
    SCOPED_TRACE(count);
    this->Check(this->Draw(count, ~std::uint64_t{0}, 0));                    // everywhere
    this->Check(this->Draw(count, 0x0303'0F0F'0000'FFFF, 0x7F7F << 16));     // few tiles and cells
    this->Check(this->Draw(count, 0x0000'0000'FFFF'FFFF, ~0ULL));            // one cell, the last
    this->Check(this->Draw(count, 0x0000'FFFF'0000'00FF, 0x8080ULL << 48));  // one tile
    this->Check(this->Draw(count, 0xFFFF'0000'0000'0000, 0));                // every tile's corner
  }
}

TYPED_TEST(CellSortTest, SortedAndReversedItems) {
  std::vector<TypeParam> items;
  for (std::uint32_t i = 0; i < 5000; ++i) {
    items.push_back(MakeItem(std::uint64_t{i / 3} << 37, i, TypeParam()));
  }
  this->Check(items);
  std::reverse(items.begin(), items.end());
  this->Check(items);
}

}  // namespace
}  // namespace strata
