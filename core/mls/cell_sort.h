// Sorts measurements by tile and cell. The middle step of build.h.
#ifndef STRATA_CORE_MLS_CELL_SORT_H_
#define STRATA_CORE_MLS_CELL_SORT_H_

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace strata {

// What a sort has to know of its items beforehand, and its working memory. Whoever makes the items
// counts each: a count along the way costs nothing, a pass of its own does.
struct CellSortScratch {
  // CellOfKey is sorted in two digits: the low kLowBits, and the rest.
  static constexpr int kLowBits = 11;
  static constexpr std::uint32_t kLowMask = (1U << kLowBits) - 1;

  // Both are all 0 between sorts.
  std::vector<std::uint32_t> low_count = std::vector<std::uint32_t>(kLowMask + 1);
  std::vector<std::uint8_t> tile_seen = std::vector<std::uint8_t>(1 << 16);

  std::vector<std::uint16_t> tile_ordinal = std::vector<std::uint16_t>(1 << 16);
  std::vector<std::uint32_t> high_count;
};

// Sorts `items`, each counted in low_count and tile_seen, by CellOfKey, stably, with `other` of the
// same length as working memory. Returns the number of tiles. Item is Measurement or
// IndexedMeasurement.
template <typename Item>
std::size_t SortByCell(std::span<Item> items, Item* other, CellSortScratch& scratch);

}  // namespace strata

#endif  // STRATA_CORE_MLS_CELL_SORT_H_
