// Which cells of a tile have patches, and the numbers of those.
#ifndef STRATA_CORE_PLANNING_PATCH_INDEX_H_
#define STRATA_CORE_PLANNING_PATCH_INDEX_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/mls/tile_key.h"
#include "core/planning/ground/ground_window.h"

namespace strata {

// A tile has 32 × 32 blocks of 8 × 8 cells. The lowest patches of a block's cells are its first
// *sheet*, those above them its second, and so on. A *place* is 64 · sheet + cell in the block. A
// sheet takes 12 bytes: which of its places have a patch, and the number of the first. Numbers
// follow the blocks, in a block its sheets, so that what a search touches together lies together.
class PatchIndex {
 public:
  static constexpr std::uint32_t kBlocks = 1024;
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;

  PatchIndex() : sheets_(kBlocks, 0), first_(kBlocks, 0) {}  // no patches
  // From the number of patches in each cell (by CellInTile).
  explicit PatchIndex(const std::vector<std::uint8_t>& counts);
  // From sheets() and upper_blocks(); none if they contradict each other.
  static std::optional<PatchIndex> OfSheets(std::vector<std::uint64_t> sheets,
                                            std::vector<std::uint16_t> upper_blocks);

  std::uint32_t size() const { return size_; }
  // The places of each sheet; the first sheets of all blocks come first.
  const std::vector<std::uint64_t>& sheets() const { return sheets_; }
  // Blocks of the other sheets, rising.
  const std::vector<std::uint16_t>& upper_blocks() const { return upper_blocks_; }
  bool one_sheet() const { return upper_blocks_.empty(); }
  std::uint32_t places() const { return static_cast<std::uint32_t>(sheets_.size()) * 64; }

  bool Has(std::uint32_t place) const {
    return place / 64 < sheets_.size() && (sheets_[place / 64] >> (place % 64) & 1U) != 0;
  }
  // True if a place of a first sheet has a patch, and its block no other sheet.
  bool HasOne(std::uint32_t place) const {
    const std::uint32_t block = place / 64;
    return (sheets_[block] >> (place % 64) & 1U) != 0 &&
           (one_sheet() || upper_begin_[block] == upper_begin_[block + 1]);
  }
  // REQUIRES: place < places(). Of a place without a patch: the number of the next.
  [[gnu::always_inline]] std::uint32_t Number(std::uint32_t place) const {
    const std::uint64_t before = sheets_[place / 64] & ((std::uint64_t{1} << (place % 64)) - 1);
    return first_[place / 64] + CountBits(before);
  }
  // REQUIRES: place < places().
  std::uint16_t CellOf(std::uint32_t place) const { return CellOnFirstSheet(OnFirstSheet(place)); }
  // The place of the same cell on its block's first sheet.
  std::uint32_t OnFirstSheet(std::uint32_t place) const {
    return place < kBlocks * 64 ? place : upper_blocks_[place / 64 - kBlocks] * 64U + place % 64;
  }
  // The patch of a cell on the sheet `level`; kNone if there is none.
  std::uint32_t Place(std::uint16_t cell, std::uint32_t level) const;
  std::uint32_t LevelOf(std::uint32_t place) const;
  // True if the cells around a place, of the same block, all have patches; false for those of a
  // block's rim.
  bool HasAllAround(std::uint32_t place) const;
  // Numbers of a block's patches are [FirstOf(block), FirstOf(block + 1)).
  std::uint32_t FirstOf(std::uint32_t block) const {
    return block < kBlocks ? first_[block] : size_;
  }

  // Calls visit(place, number) for all, by number.
  template <typename Visit>
  void ForEach(const Visit& visit) const {
    std::uint32_t number = 0;
    for (std::uint32_t block = 0; block < kBlocks; ++block) {
      for (std::uint32_t sheet = block; sheet != kNone; sheet = SheetAbove(block, sheet)) {
        for (std::uint64_t left = sheets_[sheet]; left != 0; left &= left - 1) {
          visit(sheet * 64 + static_cast<std::uint32_t>(__builtin_ctzll(left)), number++);
        }
      }
    }
  }

  // From a place of a first sheet to that beside it. REQUIRES: that is in the tile.
  static std::uint32_t Beside(std::uint32_t place, int direction) {
    return place + kBeside[place % 64][direction];
  }
  static std::uint32_t FirstSheetPlace(std::uint16_t cell) {
    const std::uint32_t x = cell & (kTileCells - 1);
    const std::uint32_t y = cell >> kTileShift;
    return (y / 8 * 32 + x / 8) * 64 + y % 8 * 8 + x % 8;
  }
  static std::uint16_t CellOnFirstSheet(std::uint32_t place) {
    const std::uint32_t block = place / 64;
    const std::uint32_t x = block % 32 * 8 + place % 8;
    const std::uint32_t y = block / 32 * 8 + place / 8 % 8;
    return static_cast<std::uint16_t>(y << kTileShift | x);
  }

  std::size_t memory_bytes() const {
    return sheets_.capacity() * sizeof(std::uint64_t) + first_.capacity() * sizeof(std::uint32_t) +
           upper_blocks_.capacity() * sizeof(std::uint16_t) +
           upper_begin_.capacity() * sizeof(std::uint32_t);
  }

  friend bool operator==(const PatchIndex&, const PatchIndex&) = default;

 private:
  // Processors that this is built for need not have an instruction for it.
  static std::uint32_t CountBits(std::uint64_t v) {
    v -= v >> 1 & 0x5555555555555555U;
    v = (v & 0x3333333333333333U) + (v >> 2 & 0x3333333333333333U);
    v = (v + (v >> 4)) & 0x0F0F0F0F0F0F0F0FU;
    return static_cast<std::uint32_t>(v * 0x0101010101010101U >> 56);
  }

  using Steps = std::array<std::array<std::int16_t, 8>, 64>;
  static constexpr Steps MakeBeside() {
    Steps steps{};
    for (int place = 0; place < 64; ++place) {
      for (int k = 0; k < 8; ++k) {
        const int x = place % 8 + kStepX[k] + 8;
        const int y = place / 8 + kStepY[k] + 8;
        const int to = ((y / 8 - 1) * 32 + x / 8 - 1) * 64 + y % 8 * 8 + x % 8;
        steps[place][k] = static_cast<std::int16_t>(to - place);
      }
    }
    return steps;
  }
  static const Steps kBeside;

  // The next sheet of the block; kNone after the last.
  std::uint32_t SheetAbove(std::uint32_t block, std::uint32_t sheet) const;
  // False if sheets contradict each other.
  bool NumberSheets();

  std::vector<std::uint64_t> sheets_;
  std::vector<std::uint32_t> first_;         // number, of each sheet
  std::vector<std::uint16_t> upper_blocks_;  // block, of each sheet after the first kBlocks
  std::vector<std::uint32_t> upper_begin_;   // of blocks in upper_blocks_; empty if that is
  std::uint32_t size_ = 0;
};

inline constexpr PatchIndex::Steps PatchIndex::kBeside = PatchIndex::MakeBeside();

}  // namespace strata

#endif  // STRATA_CORE_PLANNING_PATCH_INDEX_H_
