#include "core/mls/build.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

#include "core/common/status.h"
#include "core/mls/patch.h"
#include "core/mls/tile_key.h"

namespace strata {

namespace {

// Cells are keyed relative to a window of 256 × 256 tiles around the frame's base. Points beyond it
// (more than 3.2 km away at 10 cm) belong to other windows and are keyed there.
constexpr std::int32_t kWindowCells = 1 << 16;
constexpr std::int32_t kHalfWindow = kWindowCells / 2;

// A window's 32-bit cell is sorted in two digits: the low kLowBits, and the rest.
constexpr int kLowBits = 11;
constexpr std::uint32_t kLowMask = (1U << kLowBits) - 1;

template <typename Item>
struct FarItem {
  std::int32_t window_x, window_y;
  Item item;
};

// Grows only: a vector that was longer keeps its length.
template <typename T>
T* AtLeast(std::vector<T>& buffer, std::size_t size) {
  if (buffer.size() < size) buffer.resize(size);
  return buffer.data();
}

template <typename Item>
struct ItemBuffers {
  std::vector<Item> items, sorted;
  std::vector<FarItem<Item>> far;
};

}  // namespace

struct MlsScratch::Buffers {
  std::optional<RangeSigmaTable> sigma_table;
  QuantizedBlock block;
  ItemBuffers<Measurement> plain;
  ItemBuffers<IndexedMeasurement> indexed;
  std::vector<std::uint8_t> tile_seen = std::vector<std::uint8_t>(1 << 16);  // all 0 between calls
  std::vector<std::uint16_t> tile_ordinal = std::vector<std::uint16_t>(1 << 16);
  std::vector<std::uint32_t> low_count = std::vector<std::uint32_t>(kLowMask + 1);  // likewise
  std::vector<std::uint32_t> high_count;
  std::vector<std::uint32_t> starts;
  std::vector<Patch> patches;
  std::vector<std::uint16_t> labels;

  template <typename Item>
  ItemBuffers<Item>& Of() {
    if constexpr (std::is_same_v<Item, Measurement>) return plain;
    if constexpr (std::is_same_v<Item, IndexedMeasurement>) return indexed;
  }
};

namespace {

using Buffers = MlsScratch::Buffers;

template <typename Item>
Item MakeItem(const QuantizedBlock& block,
              std::size_t i,
              const RangeSigmaTable& table,
              std::size_t first_point) {
  Item item;
  item.key =
      (std::uint64_t{block.cell[i]} << 32) | (block.height[i] - table.Code(block.squared_range[i]));
  if constexpr (std::is_same_v<Item, IndexedMeasurement>) {
    item.point = static_cast<std::uint32_t>(first_point + i);
  }
  return item;
}

// Appends the kept points of a block, all in the central window, to `items` from `n` on.
template <typename Item>
std::size_t AppendNear(const QuantizedBlock& block,
                       std::size_t count,
                       std::size_t first_point,
                       const RangeSigmaTable& table,
                       Item* items,
                       std::size_t n,
                       Buffers& buffers) {
  std::uint32_t* const low_count = buffers.low_count.data();
  std::uint8_t* const tile_seen = buffers.tile_seen.data();
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t kept = block.kept[i];
    items[n] = MakeItem<Item>(block, i, table, first_point);
    low_count[block.cell[i] & kLowMask] += kept;
    tile_seen[block.cell[i] >> 16] |= static_cast<std::uint8_t>(kept);
    n += kept;
  }
  return n;
}

template <typename Item>
std::size_t AppendSomeFar(const QuantizedBlock& block,
                          std::size_t count,
                          std::size_t first_point,
                          const RangeSigmaTable& table,
                          Item* items,
                          std::size_t n,
                          std::vector<FarItem<Item>>& far,
                          Buffers& buffers) {
  for (std::size_t i = 0; i < count; ++i) {
    if (block.kept[i] == 0) continue;
    const auto item = MakeItem<Item>(block, i, table, first_point);
    const std::int32_t window_x = (block.x[i] + kHalfWindow) >> 16;
    const std::int32_t window_y = (block.y[i] + kHalfWindow) >> 16;
    if (window_x == 0 && window_y == 0) {
      ++buffers.low_count[block.cell[i] & kLowMask];
      buffers.tile_seen[block.cell[i] >> 16] = 1;
      items[n++] = item;
    } else {
      far.push_back({window_x, window_y, item});
    }
  }
  return n;
}

// The tiles seen, in order; leaves their ordinals in buffers.tile_ordinal and clears the marks.
std::size_t NumberTiles(Buffers& buffers) {
  std::size_t count = 0;
  for (std::size_t row = 0; row < buffers.tile_seen.size(); row += sizeof(std::uint64_t)) {
    std::uint64_t eight = 0;
    std::memcpy(&eight, &buffers.tile_seen[row], sizeof(eight));
    if (eight == 0) continue;
    for (std::size_t tile = row; tile < row + sizeof(eight); ++tile) {
      if (buffers.tile_seen[tile] != 0) {
        buffers.tile_ordinal[tile] = static_cast<std::uint16_t>(count++);
      }
      buffers.tile_seen[tile] = 0;
    }
  }
  return count;
}

void CountsToOffsets(std::span<std::uint32_t> counts) {
  std::uint32_t total = 0;
  for (std::uint32_t& count : counts) total += std::exchange(count, total);
}

// Sorts `items` by cell, in two stable passes: by the low 11 bits of the cell in its tile, whose
// counts AppendNear left in buffers.low_count, then by the rest. Only tiles that occur take part in
// the second digit, so it is short whatever the extent. `other` is as long as `items`.
template <typename Item>
void SortByCell(std::span<Item> items, Item* other, Buffers& buffers) {
  const std::size_t high_digits = NumberTiles(buffers) << (16 - kLowBits);
  const std::uint16_t* const ordinal = buffers.tile_ordinal.data();
  const auto high_digit = [ordinal](const Item& item) {
    return (std::uint32_t{ordinal[item.key >> 48]} << (16 - kLowBits)) |
           (static_cast<std::uint32_t>(item.key >> (32 + kLowBits)) &
            ((1U << (16 - kLowBits)) - 1));
  };
  std::uint32_t* const low = buffers.low_count.data();
  std::uint32_t* const high = AtLeast(buffers.high_count, high_digits);
  std::fill_n(high, high_digits, 0U);
  CountsToOffsets(buffers.low_count);
  for (const Item& item : items) {
    other[low[(item.key >> 32) & kLowMask]++] = item;
    ++high[high_digit(item)];
  }
  CountsToOffsets({high, high_digits});
  for (std::size_t i = 0; i < items.size(); ++i) items[high[high_digit(other[i])]++] = other[i];
  std::fill(buffers.low_count.begin(), buffers.low_count.end(), 0U);
}

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
  TileEmitter(const PointCloud& cloud, const MlsParameters& parameters, Buffers& buffers)
      : cloud_(cloud),
        gap_(static_cast<std::uint32_t>(parameters.gap_ticks())),
        thickness_(static_cast<std::uint32_t>(parameters.thickness_ticks())),
        bound_(MaxWeightSum(parameters.thickness_ticks())),
        buffers_(buffers) {
    for (int code = 0; code < 256; ++code) {
      weight_[255 - code] = WeightOfCode(static_cast<std::uint8_t>(code));
    }
  }

  // `starts` are the places in `items` where a cell begins, and one behind the last.
  MlsTile Emit(const TileKey& key, Item* items, std::span<const std::uint32_t> starts) {
    MlsTile tile;
    tile.key = key;
    tile_ = &tile;
    Patch* const first = AtLeast(buffers_.patches, starts.back() - starts.front());
    next_ = first;
    for (std::size_t cell = 0; cell + 1 < starts.size(); ++cell) {
      EmitCell(items + starts[cell], items + starts[cell + 1]);
    }
    tile.patches.assign(first, next_);
    tile.colour.shrink_to_fit();
    tile.votes.shrink_to_fit();
    tile.IndexRows();
    return tile;
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
    std::vector<std::uint16_t>& labels = buffers_.labels;
    labels.clear();
    for (const Item* item = begin; item != end; ++item) {
      if (cloud_.label[item->point] != 0) labels.push_back(cloud_.label[item->point]);
    }
    std::sort(labels.begin(), labels.end());
    const auto patch = static_cast<std::uint32_t>(next_ - buffers_.patches.data());
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
  Buffers& buffers_;
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

// Appends the tiles of one window, whose lowest tile is `corner`. Items are sorted by cell.
template <typename Item>
void EmitWindow(std::span<Item> items,
                TileKey corner,
                TileEmitter<Item>& emitter,
                Buffers& buffers,
                std::vector<MlsTile>& tiles) {
  if (items.empty()) return;
  std::uint32_t* const starts = AtLeast(buffers.starts, items.size() + 1);
  const std::size_t cells = FindCells(std::span<const Item>(items), starts);
  for (std::size_t begin = 0; begin < cells;) {
    const std::uint64_t tile = items[starts[begin]].key >> 48;
    std::size_t end = begin + 1;
    while (end < cells && items[starts[end]].key >> 48 == tile) ++end;
    const TileKey key{.level = 0,
                      .x = corner.x + static_cast<std::int32_t>(tile >> 8),
                      .y = corner.y + static_cast<std::int32_t>(tile & 0xFF)};
    tiles.push_back(emitter.Emit(key, items.data(), {starts + begin, starts + end + 1}));
    begin = end;
  }
}

template <typename Item>
std::size_t CollectItems(const PointCloud& cloud,
                         const ScanFrame& frame,
                         Buffers& buffers,
                         DroppedPoints& dropped) {
  const RangeSigmaTable& table = *buffers.sigma_table;
  ItemBuffers<Item>& own = buffers.Of<Item>();
  Item* const items = AtLeast(own.items, cloud.size() + 1);  // one past: written, then not kept
  own.far.clear();
  std::size_t n = 0;
  for (std::size_t first = 0; first < cloud.size(); first += QuantizedBlock::kSize) {
    const std::size_t count = std::min(QuantizedBlock::kSize, cloud.size() - first);
    Quantize(&cloud.points[first], count, frame, table.model(), buffers.block, dropped);
    n = buffers.block.all_near
            ? AppendNear(buffers.block, count, first, table, items, n, buffers)
            : AppendSomeFar(buffers.block, count, first, table, items, n, own.far, buffers);
  }
  return n;
}

template <typename Item>
std::vector<MlsTile> EmitTiles(const PointCloud& cloud,
                               const ScanFrame& frame,
                               const MlsParameters& parameters,
                               std::size_t near_count,
                               Buffers& buffers) {
  std::vector<MlsTile> tiles;
  ItemBuffers<Item>& own = buffers.Of<Item>();
  TileEmitter<Item> emitter(cloud, parameters, buffers);
  const auto corner = [&frame](std::int64_t window_x, std::int64_t window_y) {
    return TileKey{.level = 0,
                   .x = static_cast<std::int32_t>(
                       (frame.base_x - kHalfWindow + window_x * kWindowCells) >> kTileShift),
                   .y = static_cast<std::int32_t>(
                       (frame.base_y - kHalfWindow + window_y * kWindowCells) >> kTileShift)};
  };
  Item* const other = AtLeast(own.sorted, near_count);
  const std::span<Item> near(own.items.data(), near_count);
  SortByCell(near, other, buffers);
  EmitWindow(near, corner(0, 0), emitter, buffers, tiles);
  if (own.far.empty()) return tiles;

  const auto key_of = [](const FarItem<Item>& f) {
    return std::tuple(f.window_x, f.window_y, f.item.key);
  };
  std::sort(own.far.begin(), own.far.end(), [&](const auto& a, const auto& b) {
    return key_of(a) < key_of(b);
  });
  for (std::size_t begin = 0; begin < own.far.size();) {
    const auto [window_x, window_y, ignored] = own.far[begin];
    std::size_t n = 0;
    Item* const items = AtLeast(own.items, own.far.size());
    for (; begin < own.far.size() && own.far[begin].window_x == window_x &&
           own.far[begin].window_y == window_y;
         ++begin) {
      items[n++] = own.far[begin].item;
    }
    EmitWindow(std::span<Item>(items, n), corner(window_x, window_y), emitter, buffers, tiles);
  }
  std::sort(
      tiles.begin(), tiles.end(), [](const MlsTile& a, const MlsTile& b) { return a.key < b.key; });
  return tiles;
}

absl::Status CheckColumn(const char* name, std::size_t length, std::size_t points) {
  if (length == 0 || length == points) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("cloud: ", name, " has ", length, " entries for ", points, " points"));
}

absl::Status CheckInputs(const PointCloud& cloud,
                         const Pose& T_map_scan,
                         const SensorModel& sensor,
                         const MlsParameters& parameters) {
  STRATA_RETURN_IF_ERROR(ValidateMlsParameters(parameters));
  STRATA_RETURN_IF_ERROR(ValidateSensorModel(sensor));
  STRATA_RETURN_IF_ERROR(ValidatePose(T_map_scan));
  STRATA_RETURN_IF_ERROR(CheckColumn("colour", cloud.colour.size(), cloud.size()));
  STRATA_RETURN_IF_ERROR(CheckColumn("label", cloud.label.size(), cloud.size()));
  if (cloud.size() >= std::numeric_limits<std::uint32_t>::max()) {
    return absl::InvalidArgumentError(
        absl::StrCat("cloud: ", cloud.size(), " points, at most 2^32 - 2"));
  }
  // The negated comparisons also catch NaN.
  if (!(cloud.origin.cwiseAbs().maxCoeff<Eigen::PropagateNaN>() <= 1e8)) {
    return absl::InvalidArgumentError("cloud: origin is not within ±1e8 m");
  }
  if (!(cloud.sensor_origin.cwiseAbs().maxCoeff<Eigen::PropagateNaN>() <= 1e6F)) {
    return absl::InvalidArgumentError("cloud: sensor origin is not within ±1e6 m");
  }
  return absl::OkStatus();
}

}  // namespace

MlsScratch::MlsScratch() : buffers_(std::make_unique<Buffers>()) {}
MlsScratch::~MlsScratch() = default;
MlsScratch::MlsScratch(MlsScratch&&) noexcept = default;
MlsScratch& MlsScratch::operator=(MlsScratch&&) noexcept = default;

absl::StatusOr<MlsBuildResult> BuildMlsMap(const PointCloud& cloud,
                                           const Pose& T_map_scan,
                                           const SensorModel& sensor,
                                           const MlsParameters& parameters,
                                           MlsScratch& scratch) {
  STRATA_RETURN_IF_ERROR(CheckInputs(cloud, T_map_scan, sensor, parameters));
  Buffers& buffers = scratch.buffers();
  if (!buffers.sigma_table.has_value() || buffers.sigma_table->model() != sensor) {
    buffers.sigma_table.emplace(sensor);
  }
  MlsBuildResult result;
  result.map.parameters = parameters;
  const ScanFrame frame(cloud, T_map_scan, parameters);
  const auto build = [&]<typename Item>() {
    const std::size_t near_count = CollectItems<Item>(cloud, frame, buffers, result.dropped);
    result.map.tiles = EmitTiles<Item>(cloud, frame, parameters, near_count, buffers);
    result.map.tiles.shrink_to_fit();
  };
  if (cloud.colour.empty() && cloud.label.empty()) {
    build.operator()<Measurement>();
  } else {
    build.operator()<IndexedMeasurement>();
  }
  return result;
}

absl::StatusOr<MlsBuildResult> BuildMlsMap(const PointCloud& cloud,
                                           const Pose& T_map_scan,
                                           const SensorModel& sensor,
                                           const MlsParameters& parameters) {
  MlsScratch scratch;
  return BuildMlsMap(cloud, T_map_scan, sensor, parameters, scratch);
}

}  // namespace strata
