#include "core/mls/measurement.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>

#include "core/mls/patch.h"
#include "core/mls/tile_key.h"

namespace strata {
namespace {

std::int32_t ClampToInt32(std::int64_t value) {
  return static_cast<std::int32_t>(std::clamp<std::int64_t>(
      value, std::numeric_limits<std::int32_t>::min(), std::numeric_limits<std::int32_t>::max()));
}

std::int64_t TileCornerBelow(double cells) {
  return static_cast<std::int64_t>(std::floor(cells / kTileCells)) * kTileCells;
}

// The smallest float r² whose σ code is at least `code`; infinity when there is none.
float FirstSquaredRange(const SensorModel& model, std::uint8_t code) {
  const auto reached = [&](float squared_range) {
    return SigmaCode(model.SigmaAt(std::sqrt(double{squared_range}))) >= code;
  };
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const double range_m =
      std::max(0.0, (SigmaCodeBoundary(code) - model.sigma_m) / model.sigma_per_metre);
  if (!(range_m <= 1e6)) return kInfinity;
  float squared_range = static_cast<float>(range_m * range_m);
  while (!reached(squared_range)) squared_range = std::nextafter(squared_range, kInfinity);
  while (squared_range > 0.0F && reached(std::nextafter(squared_range, 0.0F))) {
    squared_range = std::nextafter(squared_range, 0.0F);
  }
  return squared_range;
}

// Four points side by side. The vector extension of g++ and clang is the same arithmetic on every
// machine.
using Float4 [[gnu::vector_size(16)]] = float;
using Int4 [[gnu::vector_size(16)]] = std::int32_t;  // of a comparison: 0 or −1 (all bits)
using Uint4 [[gnu::vector_size(16)]] = std::uint32_t;

Int4 Bits(Float4 v) { return std::bit_cast<Int4>(v); }
Float4 Where(Int4 mask, Float4 v) { return std::bit_cast<Float4>(mask & Bits(v)); }
Int4 Select(Int4 mask, Int4 a, Int4 b) { return (mask & a) | (~mask & b); }

Int4 Floor(Float4 v) {
  const Int4 truncated = __builtin_convertvector(v, Int4);
  return truncated + (__builtin_convertvector(truncated, Float4) > v);
}

template <typename Vector, typename Array>
void Store(Array& array, std::size_t i, Vector v) {
  std::memcpy(&array[i], &v, sizeof(v));
}

struct Points4 {
  Float4 x, y, z;
};

Points4 Load(const float* p) {
  Float4 a, b, c;  // x y z x | y z x y | z x y z
  std::memcpy(&a, p, sizeof(a));
  std::memcpy(&b, p + 4, sizeof(b));
  std::memcpy(&c, p + 8, sizeof(c));
  const Float4 x01_y23 = __builtin_shufflevector(a, b, 0, 3, 4, 7);
  return {
      .x = __builtin_shufflevector(__builtin_shufflevector(a, b, 0, 3, 6, 6), c, 0, 1, 2, 5),
      .y = __builtin_shufflevector(__builtin_shufflevector(a, x01_y23, 1, 6, 7, 7), c, 0, 1, 2, 6),
      .z = __builtin_shufflevector(__builtin_shufflevector(a, b, 2, 5, 5, 5), c, 0, 1, 4, 7)};
}

struct Bounds {
  explicit Bounds(const ScanFrame& frame)
      : x_low(ClampToInt32(-std::int64_t{kMaxCellIndex} - frame.base_x)),
        x_high(ClampToInt32(std::int64_t{kMaxCellIndex} - 1 - frame.base_x)),
        y_low(ClampToInt32(-std::int64_t{kMaxCellIndex} - frame.base_y)),
        y_high(ClampToInt32(std::int64_t{kMaxCellIndex} - 1 - frame.base_y)),
        z_low(ClampToInt32(-std::int64_t{kMaxZTicks} - frame.base_z)),
        z_high(ClampToInt32(std::int64_t{kMaxZTicks} - frame.base_z)) {}

  Int4 Contain(Int4 x, Int4 y, Int4 z) const {
    return (x >= x_low) & (x <= x_high) & (y >= y_low) & (y <= y_high) & (z >= z_low) &
           (z <= z_high);
  }

  std::int32_t x_low, x_high, y_low, y_high, z_low, z_high;
};

// Per lane, how many points passed each test (negative: sums of masks), and where they lie.
struct Tally {
  Int4 finite = {0, 0, 0, 0};
  Int4 in_range = {0, 0, 0, 0};
  Int4 kept = {0, 0, 0, 0};
  Int4 spread = {0, 0, 0, 0};
};

std::size_t Total(Int4 masks) {
  return static_cast<std::size_t>(-(masks[0] + masks[1] + masks[2] + masks[3]));
}

}  // namespace

RangeSigmaTable::RangeSigmaTable(const SensorModel& model) : model_(model) {
  const double first_range_m = std::sqrt(double{std::bit_cast<float>(kFirstBits)});
  std::uint32_t code = SigmaCode(model.SigmaAt(first_range_m));
  std::size_t filled = 0;
  for (std::uint32_t next = code + 1; next < 256; ++next) {
    const float step = FirstSquaredRange(model, static_cast<std::uint8_t>(next));
    if (step == std::numeric_limits<float>::infinity()) break;
    const std::uint32_t bits = std::bit_cast<std::uint32_t>(step) - kFirstBits;
    while (filled < bits >> kBinShift) bins_[filled++] = code << kBinShift;
    bins_[filled++] = (code << kBinShift) + (kBelowBin + 1 - (bits & kBelowBin));
    code = next;
  }
  while (filled < kBins) bins_[filled++] = code << kBinShift;
}

ScanFrame::ScanFrame(const PointCloud& cloud,
                     const Pose& T_map_scan,
                     const MlsParameters& parameters) {
  const double cell = parameters.cell_size_m;
  const Eigen::Vector3d p_map = T_map_scan * (cloud.origin + cloud.sensor_origin.cast<double>());
  const Eigen::Vector3d scale(1.0 / cell, 1.0 / cell, kTicksPerMetre);
  const double x = p_map.x() / cell;
  const double y = p_map.y() / cell;
  const double z = p_map.z() * kTicksPerMetre;
  base_x = TileCornerBelow(x);
  base_y = TileCornerBelow(y);
  base_z = static_cast<std::int64_t>(std::floor(z));
  t[0] = static_cast<float>(x - static_cast<double>(base_x));
  t[1] = static_cast<float>(y - static_cast<double>(base_y));
  t[2] = static_cast<float>(z - static_cast<double>(base_z) + 0.5);
  for (int row = 0; row < 3; ++row) {
    sensor[row] = cloud.sensor_origin[row];
    for (int column = 0; column < 3; ++column) {
      A[row][column] = static_cast<float>(T_map_scan.linear()(row, column) * scale[row]);
    }
  }
}

void Quantize(const Eigen::Vector3f* points,
              std::size_t count,
              const ScanFrame& frame,
              const SensorModel& sensor,
              QuantizedBlock& block,
              DroppedPoints& dropped) {
  // Points come from memory that no cache holds, and the processor itself does not fetch ahead over
  // the end of a page.
  constexpr std::size_t kFloatsAhead = 1024;
  constexpr float kLargest = std::numeric_limits<float>::max();
  constexpr Float4 kTickBound = {0x1p30F, 0x1p30F, 0x1p30F, 0x1p30F};  // still an int
  // As SensorModel::Takes(): range 0 is no return.
  const float near2 = std::max(static_cast<float>(sensor.min_range_m * sensor.min_range_m),
                               std::numeric_limits<float>::min());
  const auto far2 = static_cast<float>(sensor.max_range_m * sensor.max_range_m);
  const Bounds bounds(frame);
  const ScanFrame f = frame;  // a copy that the stores below cannot alias
  const std::uint32_t z_bias = static_cast<std::uint32_t>(f.base_z) + (1U << 23);
  Tally tally;
  const auto quantize4 = [&](const float* p, std::size_t i) {
    const Points4 points4 = Load(p);
    Float4 dx = points4.x - f.sensor[0];
    Float4 dy = points4.y - f.sensor[1];
    Float4 dz = points4.z - f.sensor[2];
    const Float4 r2 = dx * dx + dy * dy + dz * dz;
    const Int4 finite = r2 <= kLargest;
    const Int4 in_range = (r2 >= near2) & (r2 <= far2) & finite;
    dx = Where(in_range, dx);  // so that the conversions below are defined
    dy = Where(in_range, dy);
    dz = Where(in_range, dz);
    const Int4 x = Floor(f.A[0][0] * dx + f.A[0][1] * dy + f.A[0][2] * dz + f.t[0]);
    const Int4 y = Floor(f.A[1][0] * dx + f.A[1][1] * dy + f.A[1][2] * dz + f.t[1]);
    Float4 uz = f.A[2][0] * dx + f.A[2][1] * dy + f.A[2][2] * dz + f.t[2];
    uz = uz < kTickBound ? uz : kTickBound;
    uz = uz > -kTickBound ? uz : -kTickBound;
    const Int4 z = Floor(uz);
    const Int4 kept = in_range & bounds.Contain(x, y, z);
    const Int4 bits = Bits(Where(in_range, r2));
    constexpr auto kFirst = static_cast<std::int32_t>(RangeSigmaTable::kFirstBits);
    const Int4 first = {kFirst, kFirst, kFirst, kFirst};
    // Unsigned from here: dropped points may wrap.
    const Uint4 x_window = std::bit_cast<Uint4>(x) + 32768U;
    const Uint4 y_window = std::bit_cast<Uint4>(y) + 32768U;
    Store(block.x, i, x);
    Store(block.y, i, y);
    Store(block.cell,
          i,
          ((x_window & 0xFF00U) << 16) | ((y_window & 0xFFFFU) << 8) | (x_window & 0xFFU));
    Store(block.height, i, ((std::bit_cast<Uint4>(z) + z_bias) << 8) | 0xFFU);
    Store(block.squared_range, i, Select(bits > first, bits, first));
    Store(block.kept, i, kept & 1);
    tally.finite += finite;
    tally.in_range += in_range;
    tally.kept += kept;
    tally.spread |= kept & std::bit_cast<Int4>(x_window | y_window);
  };
  const std::size_t whole = count & ~std::size_t{3};
  const float* const p = points->data();
  for (std::size_t i = 0; i < whole; i += 4) {
    __builtin_prefetch(p + 3 * i + kFloatsAhead);
    quantize4(p + 3 * i, i);
  }
  if (whole != count) {
    std::array<float, 12> rest;
    rest.fill(std::numeric_limits<float>::quiet_NaN());
    std::copy(p + 3 * whole, p + 3 * count, rest.begin());
    quantize4(rest.data(), whole);
  }
  const Int4 far = (tally.spread >> 16) != 0;
  block.all_near = Total(far) == 0;
  dropped.not_finite += count - Total(tally.finite);
  dropped.out_of_range += Total(tally.finite) - Total(tally.in_range);
  dropped.outside_map += Total(tally.in_range) - Total(tally.kept);
}

}  // namespace strata
