#include "core/mls/cell_sort.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <utility>

#include "core/mls/measurement.h"

namespace strata {
namespace {

constexpr int kLowBits = CellSortScratch::kLowBits;
constexpr std::uint32_t kLowMask = CellSortScratch::kLowMask;
constexpr int kHighBitsInTile = 16 - kLowBits;

// The tiles seen, in order; leaves their ordinals in tile_ordinal and clears the marks.
std::size_t NumberTiles(CellSortScratch& scratch) {
  constexpr std::size_t kStride = 64;
  std::size_t count = 0;
  std::uint8_t* const seen = scratch.tile_seen.data();
  for (std::size_t row = 0; row < scratch.tile_seen.size(); row += kStride) {
    std::uint64_t words[kStride / sizeof(std::uint64_t)];
    std::memcpy(words, seen + row, kStride);
    std::uint64_t any = 0;
    for (const std::uint64_t word : words) any |= word;
    if (any == 0) continue;
    for (std::size_t tile = row; tile < row + kStride; ++tile) {
      if (std::exchange(seen[tile], std::uint8_t{0}) == 0) continue;
      scratch.tile_ordinal[tile] = static_cast<std::uint16_t>(count++);
    }
  }
  return count;
}

void CountsToOffsets(std::span<std::uint32_t> counts) {
  std::uint32_t total = 0;
  for (std::uint32_t& count : counts) total += std::exchange(count, total);
}

}  // namespace

// Only tiles that occur take part in the second digit, so it is short whatever the extent.
template <typename Item>
std::size_t SortByCell(std::span<Item> items, Item* other, CellSortScratch& scratch) {
  const std::size_t tiles = NumberTiles(scratch);
  const std::size_t high_digits = tiles << kHighBitsInTile;
  const std::uint16_t* const ordinal = scratch.tile_ordinal.data();
  const auto high_digit = [ordinal](const Item& item) {
    return (std::uint32_t{ordinal[item.key >> 48]} << kHighBitsInTile) |
           (static_cast<std::uint32_t>(item.key >> (32 + kLowBits)) &
            ((1U << kHighBitsInTile) - 1));
  };
  scratch.high_count.assign(high_digits, 0U);
  std::uint32_t* const low = scratch.low_count.data();
  std::uint32_t* const high = scratch.high_count.data();
  CountsToOffsets(scratch.low_count);
  for (const Item& item : items) {
    other[low[(item.key >> 32) & kLowMask]++] = item;
    ++high[high_digit(item)];
  }
  CountsToOffsets(scratch.high_count);
  for (std::size_t i = 0; i < items.size(); ++i) items[high[high_digit(other[i])]++] = other[i];
  std::fill(scratch.low_count.begin(), scratch.low_count.end(), 0U);
  return tiles;
}

template std::size_t SortByCell(std::span<Measurement>, Measurement*, CellSortScratch&);
template std::size_t SortByCell(std::span<IndexedMeasurement>,
                                IndexedMeasurement*,
                                CellSortScratch&);

}  // namespace strata
