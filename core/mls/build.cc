#include "core/mls/build.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
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
  std::vector<std::uint32_t> tiles;
  std::vector<std::uint32_t> low_count, high_count;
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

std::uint32_t WindowKey(std::uint32_t x, std::uint32_t y) {
  return ((x & 0xFF00U) << 16) | (y << 8) | (x & 0xFFU);
}

template <typename Item>
Item MakeItem(const QuantizedBlock& block,
              std::size_t i,
              std::uint32_t x_in_window,
              std::uint32_t y_in_window,
              const RangeSigmaTable& table,
              std::size_t first_point) {
  const std::uint32_t low = (static_cast<std::uint32_t>(block.z[i] + (1 << 23)) << 8) |
                            (255U - table.Code(block.squared_range[i]));
  Item item;
  item.key = (std::uint64_t{WindowKey(x_in_window, y_in_window)} << 32) | low;
  if constexpr (std::is_same_v<Item, IndexedMeasurement>) {
    item.point = static_cast<std::uint32_t>(first_point + i);
  }
  return item;
}

// Appends the kept points of a block that lie in the central window to `items` from `n` on; counts
// the low digit of their cells and marks their tiles.
template <typename Item>
std::size_t AppendNear(const QuantizedBlock& block,
                       std::size_t count,
                       std::size_t first_point,
                       const RangeSigmaTable& table,
                       Item* items,
                       std::size_t n) {
  for (std::size_t i = 0; i < count; ++i) {
    const auto x = static_cast<std::uint32_t>(block.x[i] + kHalfWindow) & 0xFFFFU;
    const auto y = static_cast<std::uint32_t>(block.y[i] + kHalfWindow) & 0xFFFFU;
    items[n] = MakeItem<Item>(block, i, x, y, table, first_point);
    n += static_cast<std::size_t>(block.kept[i]);
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
                          std::vector<FarItem<Item>>& far) {
  for (std::size_t i = 0; i < count; ++i) {
    if (block.kept[i] == 0) continue;
    const std::int64_t x = std::int64_t{block.x[i]} + kHalfWindow;
    const std::int64_t y = std::int64_t{block.y[i]} + kHalfWindow;
    const auto item = MakeItem<Item>(block,
                                     i,
                                     static_cast<std::uint32_t>(x) & 0xFFFFU,
                                     static_cast<std::uint32_t>(y) & 0xFFFFU,
                                     table,
                                     first_point);
    const auto window_x = static_cast<std::int32_t>(x >> 16);
    const auto window_y = static_cast<std::int32_t>(y >> 16);
    if (window_x == 0 && window_y == 0) {
      items[n++] = item;
    } else {
      far.push_back({window_x, window_y, item});
    }
  }
  return n;
}

// One stable pass of a radix sort. `digit` maps an item to [0, digits).
template <typename Item, typename Digit>
void RadixPass(std::span<const Item> from,
               Item* to,
               std::size_t digits,
               std::vector<std::uint32_t>& counts,
               Digit digit) {
  std::uint32_t* const count = AtLeast(counts, digits);
  std::fill_n(count, digits, 0U);
  for (const Item& item : from) ++count[digit(item)];
  std::uint32_t total = 0;
  for (std::size_t d = 0; d < digits; ++d) total += std::exchange(count[d], total);
  for (const Item& item : from) to[count[digit(item)]++] = item;
}

// Sorts by cell, stable: first by the low 11 bits of the cell in its tile, then by the rest. Only
// tiles that occur take part in the second digit, so it is short whatever the extent. Returns the
// sorted items, in `items` or `other`.
template <typename Item>
std::span<Item> SortByCell(Item* items, Item* other, std::size_t n, Buffers& buffers) {
  const std::span<const Item> unsorted(items, n);
  for (const Item& item : unsorted) buffers.tile_seen[item.key >> 48] = 1;
  buffers.tiles.clear();
  for (std::size_t tile = 0; tile < buffers.tile_seen.size(); ++tile) {
    if (buffers.tile_seen[tile] == 0) continue;
    buffers.tile_seen[tile] = 0;
    buffers.tile_ordinal[tile] = static_cast<std::uint16_t>(buffers.tiles.size());
    buffers.tiles.push_back(static_cast<std::uint32_t>(tile));
  }
  const std::uint16_t* const ordinal = buffers.tile_ordinal.data();
  RadixPass(unsorted, other, 1 << 11, buffers.low_count, [](const Item& item) {
    return static_cast<std::uint32_t>(item.key >> 32) & 0x7FFU;
  });
  RadixPass(std::span<const Item>(other, n),
            items,
            buffers.tiles.size() << 5,
            buffers.high_count,
            [ordinal](const Item& item) {
              return (std::uint32_t{ordinal[item.key >> 48]} << 5) |
                     (static_cast<std::uint32_t>(item.key >> 43) & 0x1FU);
            });
  return {items, n};
}

// Turns the sorted measurements of one tile into its patches and layers.
template <typename Item>
class TileEmitter {
 public:
  TileEmitter(const PointCloud& cloud, const MlsParameters& parameters, Buffers& buffers)
      : cloud_(cloud),
        gap_(parameters.gap_ticks()),
        thickness_(parameters.thickness_ticks()),
        bound_(MaxWeightSum(parameters.thickness_ticks())),
        buffers_(buffers) {
    for (int code = 0; code < 256; ++code) {
      weight_[255 - code] = WeightOfCode(static_cast<std::uint8_t>(code));
    }
  }

  MlsTile Emit(const TileKey& key, std::span<Item> items) {
    MlsTile tile;
    tile.key = key;
    tile_ = &tile;
    Patch* const first = AtLeast(buffers_.patches, items.size());
    next_ = first;
    Item* const end = items.data() + items.size();
    for (Item* run = items.data(); run != end;) run = EmitCell(run, end);
    tile.patches.assign(first, next_);
    tile.colour.shrink_to_fit();
    tile.votes.shrink_to_fit();
    tile.IndexRows();
    return tile;
  }

 private:
  static std::uint32_t Low(const Item& item) { return static_cast<std::uint32_t>(item.key); }

  // The cell that starts at `run`; returns the start of the next.
  Item* EmitCell(Item* run, Item* end) {
    const std::uint32_t cell = CellOfKey(run->key);
    std::uint32_t lowest = Low(*run);
    std::uint32_t highest = lowest;
    Item* last = run + 1;
    for (; last != end && CellOfKey(last->key) == cell; ++last) {
      lowest = std::min(lowest, Low(*last));
      highest = std::max(highest, Low(*last));
    }
    if (static_cast<std::int32_t>((highest >> 8) - (lowest >> 8)) < gap_) {
      EmitInterval(run, last, lowest, highest);
      return last;
    }
    std::sort(run, last, [](const Item& a, const Item& b) { return a.key < b.key; });
    for (Item* begin = run; begin != last;) {
      Item* stop = begin + 1;
      while (stop != last &&
             static_cast<std::int32_t>((Low(*stop) >> 8) - (Low(*(stop - 1)) >> 8)) < gap_) {
        ++stop;
      }
      EmitInterval(begin, stop, Low(*begin), Low(*(stop - 1)));
      begin = stop;
    }
    return last;
  }

  // [begin, end) are the measurements of one interval in any order.
  void EmitInterval(const Item* begin,
                    const Item* end,
                    std::uint32_t lowest,
                    std::uint32_t highest) {
    Patch patch;
    patch.cell = static_cast<std::uint16_t>(CellOfKey(begin->key));
    patch.z_min = ZOfKey(lowest);
    patch.z_max = ZOfKey(highest);
    patch.top_sigma_code = SigmaCodeOfKey(highest);
    patch.count =
        std::min<std::uint64_t>(static_cast<std::uint64_t>(end - begin), Patch::kMaxCount);
    if (static_cast<std::int32_t>((highest >> 8) - (lowest >> 8)) <= thickness_) {
      AddSums(patch, begin, end, lowest >> 8);
    }
    if constexpr (std::is_same_v<Item, IndexedMeasurement>) EmitLayers(begin, end);
    *next_++ = patch;
  }

  void AddSums(Patch& patch, const Item* begin, const Item* end, std::uint32_t z_min) const {
    std::uint64_t sum_w = 0;
    std::uint64_t sum_wz = 0;
    std::uint64_t sum_wzz = 0;
    for (const Item* item = begin; item != end; ++item) {
      const std::uint64_t w = weight_[item->key & 0xFF];
      const std::uint64_t wz = w * ((Low(*item) >> 8) - z_min);
      sum_w += w;
      sum_wz += wz;
      sum_wzz += wz * ((Low(*item) >> 8) - z_min);
    }
    const bool full = sum_w >= bound_;
    patch.sum_w = full ? bound_ : sum_w;
    patch.sum_wz = full ? 0 : sum_wz;
    patch.sum_wzz = full ? 0 : sum_wzz;
  }

  void EmitLayers(const Item* begin, const Item* end) {
    if (!cloud_.colour.empty()) {
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
    if (cloud_.label.empty()) return;
    buffers_.labels.clear();
    for (const Item* item = begin; item != end; ++item) {
      if (cloud_.label[item->point] != 0) buffers_.labels.push_back(cloud_.label[item->point]);
    }
    std::sort(buffers_.labels.begin(), buffers_.labels.end());
    const auto patch = static_cast<std::uint32_t>(next_ - buffers_.patches.data());
    for (const std::uint16_t label : buffers_.labels) {
      std::vector<ClassVotes>& votes = tile_->votes;
      const bool same =
          !votes.empty() && votes.back().patch == patch && votes.back().class_id == label;
      if (!same) votes.push_back({patch, label, 0});
      ++votes.back().count;
    }
  }

  const PointCloud& cloud_;
  const std::int32_t gap_;
  const std::int32_t thickness_;
  const std::uint64_t bound_;
  std::array<std::uint32_t, 256> weight_;  // by 255 − σ code, as keys have it
  Buffers& buffers_;
  MlsTile* tile_ = nullptr;
  Patch* next_ = nullptr;
};

// Appends the tiles of one window, whose lowest tile is `corner`.
template <typename Item>
void EmitWindow(std::span<Item> sorted,
                TileKey corner,
                TileEmitter<Item>& emitter,
                std::vector<MlsTile>& tiles) {
  for (std::size_t begin = 0; begin < sorted.size();) {
    const std::uint64_t tile = sorted[begin].key >> 48;
    std::size_t end = begin + 1;
    while (end < sorted.size() && sorted[end].key >> 48 == tile) ++end;
    const TileKey key{.level = 0,
                      .x = corner.x + static_cast<std::int32_t>(tile >> 8),
                      .y = corner.y + static_cast<std::int32_t>(tile & 0xFF)};
    tiles.push_back(emitter.Emit(key, sorted.subspan(begin, end - begin)));
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
            ? AppendNear(buffers.block, count, first, table, items, n)
            : AppendSomeFar(buffers.block, count, first, table, items, n, own.far);
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
  EmitWindow(
      SortByCell(own.items.data(), other, near_count, buffers), corner(0, 0), emitter, tiles);
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
    EmitWindow(std::span<Item>(items, n), corner(window_x, window_y), emitter, tiles);
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
