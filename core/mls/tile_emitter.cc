#include "core/mls/tile_emitter.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

#include "core/mls/patch.h"

namespace strata {
namespace {

// Sorts the measurements of one cell by height. Few as they mostly are, counting for each how many
// are lower costs less than the mispredicted branches of a general sort.
template <typename Item>
void SortByHeight(Item* begin, Item* end) {
  constexpr std::size_t kFew = 12;
  const auto n = static_cast<std::size_t>(end - begin);
  if (n > kFew) {
    std::sort(begin, end, [](const Item& a, const Item& b) { return a.key < b.key; });
    return;
  }
  std::array<Item, kFew> copy;
  std::array<std::uint32_t, kFew> rank{};
  for (std::size_t i = 0; i < n; ++i) {
    copy[i] = begin[i];
    for (std::size_t j = 0; j < i; ++j) {
      const std::uint32_t lower = copy[i].key < copy[j].key ? 1 : 0;
      rank[j] += lower;
      rank[i] += 1 - lower;
    }
  }
  for (std::size_t i = 0; i < n; ++i) begin[rank[i]] = copy[i];
}

// Turns the sorted measurements of one tile into its patches and layers.
template <typename Item>
class TileEmitter {
 public:
  TileEmitter(const PointCloud& cloud, const MlsParameters& parameters, EmitScratch& scratch)
      : cloud_(cloud),
        gap_(static_cast<std::uint32_t>(parameters.gap_ticks())),
        thickness_(static_cast<std::uint32_t>(parameters.thickness_ticks())),
        bound_(MaxWeightSum(parameters.thickness_ticks())),
        scratch_(scratch) {
    for (int code = 0; code < 256; ++code) {
      weight_[255 - code] = WeightOfCode(static_cast<std::uint8_t>(code));
    }
  }

  // `starts` are the places in `items` where a cell begins, and one behind the last.
  void Emit(Item* items, std::span<const std::uint32_t> starts, MlsTile& tile) {
    tile_ = &tile;
    const std::size_t most = starts.back() - starts.front();
    if (scratch_.patches.size() < most) scratch_.patches.resize(most);
    next_ = scratch_.patches.data();
    for (std::size_t cell = 0; cell + 1 < starts.size(); ++cell) {
      EmitCell(items + starts[cell], items + starts[cell + 1]);
    }
    tile.patches.assign(scratch_.patches.data(), next_);
    tile.colour.shrink_to_fit();
    tile.votes.shrink_to_fit();
    tile.IndexRows();
  }

 private:
  // Height and σ code of some measurements, and their sums with heights relative to the first;
  // sums are modulo 2⁶⁴ until the interval proves horizontal.
  struct Sums {
    std::uint32_t lowest, highest;  // low halves of keys
    std::uint64_t w, wz = 0, wzz = 0;
    std::uint32_t span() const { return (highest >> 8) - (lowest >> 8); }
  };

  static std::uint32_t Low(const Item& item) { return static_cast<std::uint32_t>(item.key); }

  Sums Sum(const Item* begin, const Item* end) const {
    const std::uint32_t first = Low(*begin);
    Sums sums{.lowest = first, .highest = first, .w = weight_[first & 0xFF]};
    for (const Item* item = begin + 1; item != end; ++item) {
      const std::uint32_t low = Low(*item);
      sums.lowest = std::min(sums.lowest, low);
      sums.highest = std::max(sums.highest, low);
      const std::uint64_t w = weight_[low & 0xFF];
      const std::uint64_t z = std::uint64_t{low >> 8} - (first >> 8);
      sums.w += w;
      sums.wz += w * z;
      sums.wzz += w * z * z;
    }
    const std::uint64_t shift = (first >> 8) - (sums.lowest >> 8);
    sums.wzz += 2 * shift * sums.wz + shift * shift * sums.w;
    sums.wz += shift * sums.w;
    return sums;
  }

  void EmitCell(Item* begin, Item* end) {
    const Sums sums = Sum(begin, end);
    if (sums.span() < gap_) {
      EmitInterval(begin, end, sums);
      return;
    }
    SortByHeight(begin, end);
    while (begin != end) {
      Item* stop = begin + 1;
      while (stop != end && (Low(*stop) >> 8) - (Low(*(stop - 1)) >> 8) < gap_) ++stop;
      EmitInterval(begin, stop, Sum(begin, stop));
      begin = stop;
    }
  }

  // [begin, end) are the measurements of one interval in any order.
  void EmitInterval(const Item* begin, const Item* end, const Sums& sums) {
    const bool horizontal = sums.span() <= thickness_;
    const bool full = sums.w >= bound_;
    const std::uint64_t sums_kept = horizontal && !full ? ~std::uint64_t{0} : 0;
    const std::uint64_t w = horizontal ? std::min(sums.w, bound_) : 0;
    const auto count = static_cast<std::size_t>(end - begin);
    if constexpr (std::is_same_v<Item, IndexedMeasurement>) EmitLayers(begin, end);
    StorePatch({.sum_wzz = sums.wzz & sums_kept,
                .sum_wz = sums.wz & sums_kept,
                .sum_w = w,
                .count = static_cast<std::uint32_t>(std::min<std::size_t>(count, Patch::kMaxCount)),
                .z_min = ZOfKey(sums.lowest),
                .z_max = ZOfKey(sums.highest),
                .cell = static_cast<std::uint16_t>(CellOfKey(begin->key)),
                .top_sigma_code = SigmaCodeOfKey(sums.highest)},
               *next_++);
  }

  void EmitLayers(const Item* begin, const Item* end) {
    if (!cloud_.colour.empty()) EmitColour(begin, end);
    if (!cloud_.label.empty()) EmitVotes(begin, end);
  }

  void EmitColour(const Item* begin, const Item* end) {
    ColourSum sum;
    for (const Item* item = begin; item != end; ++item) {
      const Colour& colour = cloud_.colour[item->point];
      sum.r += colour.r;
      sum.g += colour.g;
      sum.b += colour.b;
    }
    sum.count = static_cast<std::uint64_t>(end - begin);
    tile_->colour.push_back(sum);
  }

  void EmitVotes(const Item* begin, const Item* end) {
    std::vector<std::uint16_t>& labels = scratch_.labels;
    labels.clear();
    for (const Item* item = begin; item != end; ++item) {
      if (cloud_.label[item->point] != 0) labels.push_back(cloud_.label[item->point]);
    }
    std::sort(labels.begin(), labels.end());
    const auto patch = static_cast<std::uint32_t>(next_ - scratch_.patches.data());
    for (std::size_t i = 0; i < labels.size(); ++i) {
      if (i == 0 || labels[i] != labels[i - 1]) tile_->votes.push_back({patch, labels[i], 0});
      ++tile_->votes.back().count;
    }
  }

  const PointCloud& cloud_;
  const std::uint32_t gap_;
  const std::uint32_t thickness_;
  const std::uint64_t bound_;
  std::array<std::uint32_t, 256> weight_;  // by 255 − σ code, as keys have it
  EmitScratch& scratch_;
  MlsTile* tile_ = nullptr;
  Patch* next_ = nullptr;
};

// Finds where cells begin in sorted items, without a branch; `starts` gets n entries at most and
// one behind the last.
template <typename Item>
std::size_t FindCells(std::span<const Item> items, std::uint32_t* starts) {
  std::size_t count = 0;
  std::uint32_t cell = ~CellOfKey(items.front().key);
  for (std::size_t i = 0; i < items.size(); ++i) {
    const std::uint32_t next = CellOfKey(items[i].key);
    starts[count] = static_cast<std::uint32_t>(i);
    count += next != cell ? 1 : 0;
    cell = next;
  }
  starts[count] = static_cast<std::uint32_t>(items.size());
  return count;
}

}  // namespace

template <typename Item>
void EmitTiles(std::span<Item> items,
               TileKey corner,
               const PointCloud& cloud,
               const MlsParameters& parameters,
               EmitScratch& scratch,
               std::vector<MlsTile>& tiles) {
  if (items.empty()) return;
  TileEmitter<Item> emitter(cloud, parameters, scratch);
  if (scratch.starts.size() <= items.size()) scratch.starts.resize(items.size() + 1);
  std::uint32_t* const starts = scratch.starts.data();
  const std::size_t cells = FindCells(std::span<const Item>(items), starts);
  for (std::size_t begin = 0; begin < cells;) {
    const std::uint64_t tile = items[starts[begin]].key >> 48;
    std::size_t end = begin + 1;
    while (end < cells && items[starts[end]].key >> 48 == tile) ++end;
    tiles.emplace_back().key = {.level = 0,
                                .x = corner.x + static_cast<std::int32_t>(tile >> 8),
                                .y = corner.y + static_cast<std::int32_t>(tile & 0xFF)};
    emitter.Emit(items.data(), {starts + begin, starts + end + 1}, tiles.back());
    begin = end;
  }
}

template void EmitTiles(std::span<Measurement>,
                        TileKey,
                        const PointCloud&,
                        const MlsParameters&,
                        EmitScratch&,
                        std::vector<MlsTile>&);
template void EmitTiles(std::span<IndexedMeasurement>,
                        TileKey,
                        const PointCloud&,
                        const MlsParameters&,
                        EmitScratch&,
                        std::vector<MlsTile>&);

}  // namespace strata
