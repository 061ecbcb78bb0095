#include "core/mls/build.h"

#include <algorithm>
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
#include "core/mls/cell_sort.h"
#include "core/mls/measurement.h"
#include "core/mls/tile_emitter.h"
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
  CellSortScratch sort;
  EmitScratch emit;

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
                       CellSortScratch& sort) {
  std::uint32_t* const low_count = sort.low_count.data();
  std::uint8_t* const tile_seen = sort.tile_seen.data();
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t kept = block.kept[i];
    items[n] = MakeItem<Item>(block, i, table, first_point);
    low_count[block.cell[i] & CellSortScratch::kLowMask] += kept;
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
                          CellSortScratch& sort) {
  for (std::size_t i = 0; i < count; ++i) {
    if (block.kept[i] == 0) continue;
    const auto item = MakeItem<Item>(block, i, table, first_point);
    const std::int32_t window_x = (block.x[i] + kHalfWindow) >> 16;
    const std::int32_t window_y = (block.y[i] + kHalfWindow) >> 16;
    if (window_x == 0 && window_y == 0) {
      ++sort.low_count[block.cell[i] & CellSortScratch::kLowMask];
      sort.tile_seen[block.cell[i] >> 16] = 1;
      items[n++] = item;
    } else {
      far.push_back({window_x, window_y, item});
    }
  }
  return n;
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
            ? AppendNear(buffers.block, count, first, table, items, n, buffers.sort)
            : AppendSomeFar(buffers.block, count, first, table, items, n, own.far, buffers.sort);
  }
  return n;
}

TileKey WindowCorner(const ScanFrame& frame, std::int64_t window_x, std::int64_t window_y) {
  const std::int64_t x = frame.base_x - kHalfWindow + window_x * kWindowCells;
  const std::int64_t y = frame.base_y - kHalfWindow + window_y * kWindowCells;
  return {.level = 0,
          .x = static_cast<std::int32_t>(x >> kTileShift),
          .y = static_cast<std::int32_t>(y >> kTileShift)};
}

// Appends the tiles of the other windows, then puts all in order.
template <typename Item>
void MakeFarTiles(const PointCloud& cloud,
                  const ScanFrame& frame,
                  const MlsParameters& parameters,
                  Buffers& buffers,
                  std::vector<MlsTile>& tiles) {
  ItemBuffers<Item>& own = buffers.Of<Item>();
  const auto key_of = [](const FarItem<Item>& f) {
    return std::tuple(f.window_x, f.window_y, f.item.key);
  };
  std::sort(own.far.begin(), own.far.end(), [&](const auto& a, const auto& b) {
    return key_of(a) < key_of(b);
  });
  Item* const items = AtLeast(own.items, own.far.size());
  for (auto begin = own.far.cbegin(); begin != own.far.cend();) {
    const TileKey corner = WindowCorner(frame, begin->window_x, begin->window_y);
    const auto end = std::find_if(begin, own.far.cend(), [begin](const FarItem<Item>& f) {
      return f.window_x != begin->window_x || f.window_y != begin->window_y;
    });
    Item* const last =
        std::transform(begin, end, items, [](const FarItem<Item>& f) { return f.item; });
    EmitTiles(std::span<Item>(items, last), corner, cloud, parameters, buffers.emit, tiles);
    begin = end;
  }
  std::sort(
      tiles.begin(), tiles.end(), [](const MlsTile& a, const MlsTile& b) { return a.key < b.key; });
}

template <typename Item>
std::vector<MlsTile> MakeTiles(const PointCloud& cloud,
                               const ScanFrame& frame,
                               const MlsParameters& parameters,
                               std::size_t near_count,
                               Buffers& buffers) {
  std::vector<MlsTile> tiles;
  ItemBuffers<Item>& own = buffers.Of<Item>();
  Item* const other = AtLeast(own.sorted, near_count);
  const std::span<Item> near(own.items.data(), near_count);
  tiles.reserve(SortByCell(near, other, buffers.sort));
  EmitTiles(near, WindowCorner(frame, 0, 0), cloud, parameters, buffers.emit, tiles);
  if (!own.far.empty()) MakeFarTiles<Item>(cloud, frame, parameters, buffers, tiles);
  return tiles;
}

absl::Status CheckInputs(const PointCloud& cloud,
                         const Pose& T_map_scan,
                         const SensorModel& sensor,
                         const MlsParameters& parameters) {
  STRATA_RETURN_IF_ERROR(ValidateMlsParameters(parameters));
  STRATA_RETURN_IF_ERROR(ValidateSensorModel(sensor));
  STRATA_RETURN_IF_ERROR(ValidatePose(T_map_scan));
  STRATA_RETURN_IF_ERROR(CheckColumns(cloud));
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
    result.map.tiles = MakeTiles<Item>(cloud, frame, parameters, near_count, buffers);
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
