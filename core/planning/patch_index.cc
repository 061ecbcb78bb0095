#include "core/planning/patch_index.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

namespace strata {

PatchIndex::PatchIndex(const std::vector<std::uint8_t>& counts) : sheets_(kBlocks, 0) {
  for (std::uint32_t block = 0; block < kBlocks; ++block) {
    std::uint32_t levels = 1;
    for (std::uint32_t level = 0; level < levels; ++level) {
      std::uint64_t sheet = 0;
      for (std::uint32_t i = 0; i < 64; ++i) {
        const std::uint32_t count = counts[CellOnFirstSheet(block * 64 + i)];
        levels = std::max(levels, count);
        if (count > level) sheet |= std::uint64_t{1} << i;
      }
      if (level == 0) {
        sheets_[block] = sheet;
      } else {
        sheets_.push_back(sheet);
        upper_blocks_.push_back(static_cast<std::uint16_t>(block));
      }
    }
  }
  sheets_.shrink_to_fit();
  upper_blocks_.shrink_to_fit();
  NumberSheets();
}

std::optional<PatchIndex> PatchIndex::OfSheets(std::vector<std::uint64_t> sheets,
                                               std::vector<std::uint16_t> upper_blocks) {
  if (sheets.size() != kBlocks + upper_blocks.size()) return std::nullopt;
  if (!std::is_sorted(upper_blocks.begin(), upper_blocks.end())) return std::nullopt;
  if (!upper_blocks.empty() && upper_blocks.back() >= kBlocks) return std::nullopt;
  PatchIndex index;
  index.sheets_ = std::move(sheets);
  index.upper_blocks_ = std::move(upper_blocks);
  if (!index.NumberSheets()) return std::nullopt;
  return index;
}

bool PatchIndex::NumberSheets() {
  upper_begin_.clear();
  if (!one_sheet()) {
    upper_begin_.reserve(kBlocks + 1);
    for (std::uint32_t block = 0; block <= kBlocks; ++block) {
      const auto begin = std::lower_bound(upper_blocks_.begin(), upper_blocks_.end(), block);
      upper_begin_.push_back(static_cast<std::uint32_t>(begin - upper_blocks_.begin()));
    }
  }
  first_.assign(sheets_.size(), 0);
  size_ = 0;
  bool consistent = true;
  for (std::uint32_t block = 0; block < kBlocks; ++block) {
    std::uint64_t below = ~std::uint64_t{0};
    for (std::uint32_t sheet = block; sheet != kNone; sheet = SheetAbove(block, sheet)) {
      first_[sheet] = size_;
      size_ += static_cast<std::uint32_t>(std::popcount(sheets_[sheet]));
      // Whoever has a patch on a sheet has one on the sheet below; no upper sheet is empty.
      consistent =
          consistent && (sheets_[sheet] & ~below) == 0 && (sheet == block || sheets_[sheet] != 0);
      below = sheets_[sheet];
    }
  }
  return consistent;
}

std::uint32_t PatchIndex::SheetAbove(std::uint32_t block, std::uint32_t sheet) const {
  if (one_sheet()) return kNone;
  const std::uint32_t next = sheet < kBlocks ? kBlocks + upper_begin_[block] : sheet + 1;
  return next < kBlocks + upper_begin_[block + 1] ? next : kNone;
}

std::uint32_t PatchIndex::Place(std::uint16_t cell, std::uint32_t level) const {
  std::uint32_t place = FirstSheetPlace(cell);
  const std::uint32_t block = place / 64;
  if (level > 0) {
    if (one_sheet() || level > upper_begin_[block + 1] - upper_begin_[block]) return kNone;
    place = (kBlocks + upper_begin_[block] + level - 1) * 64 + place % 64;
  }
  return Has(place) ? place : kNone;
}

bool PatchIndex::HasAllAround(std::uint32_t place) const {
  constexpr std::uint64_t kAround = 0x070507;  // of place 9
  const std::uint32_t x = place % 8;
  const std::uint32_t y = place % 64 / 8;
  if (x == 0 || y == 0 || x == 7 || y == 7) return false;
  const std::uint64_t around = kAround << (place % 64 - 9);
  return (sheets_[OnFirstSheet(place) / 64] & around) == around;
}

std::uint32_t PatchIndex::LevelOf(std::uint32_t place) const {
  if (place < kBlocks * 64) return 0;
  const std::uint32_t upper = place / 64 - kBlocks;
  return 1 + upper - upper_begin_[upper_blocks_[upper]];
}

}  // namespace strata
