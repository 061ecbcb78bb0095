#include "core/mls/measurement.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
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
float FirstSquaredRange(const SensorModel& model, int code, double sigma_m) {
  const auto reached = [&](float squared_range) {
    const double range_m = std::sqrt(static_cast<double>(squared_range));
    return SigmaCode(model.SigmaAt(range_m)) >= code;
  };
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const double range_m = std::max(0.0, (sigma_m - model.sigma_m) / model.sigma_per_metre);
  if (!(range_m <= 1e6)) return kInfinity;
  float squared_range = static_cast<float>(range_m * range_m);
  while (!reached(squared_range)) squared_range = std::nextafter(squared_range, kInfinity);
  while (squared_range > 0.0F && reached(std::nextafter(squared_range, 0.0F))) {
    squared_range = std::nextafter(squared_range, 0.0F);
  }
  return squared_range;
}

}  // namespace

std::size_t RangeSigmaTable::BinOf(float squared_range) {
  const std::uint32_t bits = std::bit_cast<std::uint32_t>(squared_range) >> kBinShift;
  return bits < kFirstBin ? 0 : bits - kFirstBin;
}

RangeSigmaTable::RangeSigmaTable(const SensorModel& model) : model_(model) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  std::uint32_t code = SigmaCode(model.SigmaAt(0.0));
  std::size_t filled = 0;
  for (int next = static_cast<int>(code) + 1; next < 256; ++next) {
    const float step =
        FirstSquaredRange(model, next, SigmaCodeBoundary(static_cast<std::uint8_t>(next)));
    if (step == kInfinity) break;
    const std::size_t bin = BinOf(step);
    while (filled < bin) bins_[filled++] = {kInfinity, code};
    bins_[filled++] = {step, code};
    code = static_cast<std::uint32_t>(next);
  }
  while (filled < kBins) bins_[filled++] = {kInfinity, code};
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
  const ScanFrame f = frame;  // a copy the stores below cannot alias
  const auto near2 = static_cast<float>(sensor.min_range_m * sensor.min_range_m);
  const auto far2 = static_cast<float>(sensor.max_range_m * sensor.max_range_m);
  const std::int32_t x_low = ClampToInt32(-std::int64_t{kMaxCellIndex} - f.base_x);
  const std::int32_t x_high = ClampToInt32(std::int64_t{kMaxCellIndex} - 1 - f.base_x);
  const std::int32_t y_low = ClampToInt32(-std::int64_t{kMaxCellIndex} - f.base_y);
  const std::int32_t y_high = ClampToInt32(std::int64_t{kMaxCellIndex} - 1 - f.base_y);
  const std::int32_t z_low = ClampToInt32(-std::int64_t{kMaxZTicks} - f.base_z);
  const std::int32_t z_high = ClampToInt32(std::int64_t{kMaxZTicks} - f.base_z);
  const auto base_z = static_cast<std::uint32_t>(f.base_z);
  constexpr float kLargest = std::numeric_limits<float>::max();
  constexpr float kTickBound = 1 << 30;  // beyond every bound above, and an int

  std::int32_t finite_count = 0;
  std::int32_t in_range_count = 0;
  std::int32_t kept_count = 0;
  std::uint32_t spread = 0;
  const float* p = points->data();
  for (std::size_t i = 0; i < count; ++i) {
    float dx = p[3 * i] - f.sensor[0];
    float dy = p[3 * i + 1] - f.sensor[1];
    float dz = p[3 * i + 2] - f.sensor[2];
    const float r2 = dx * dx + dy * dy + dz * dz;
    const std::int32_t finite = r2 <= kLargest ? 1 : 0;
    const std::int32_t in_range = (r2 >= near2 ? 1 : 0) & (r2 <= far2 ? 1 : 0) & finite;
    dx = in_range != 0 ? dx : 0.0F;
    dy = in_range != 0 ? dy : 0.0F;
    dz = in_range != 0 ? dz : 0.0F;
    const float ux = f.A[0][0] * dx + f.A[0][1] * dy + f.A[0][2] * dz + f.t[0];
    const float uy = f.A[1][0] * dx + f.A[1][1] * dy + f.A[1][2] * dz + f.t[1];
    float uz = f.A[2][0] * dx + f.A[2][1] * dy + f.A[2][2] * dz + f.t[2];
    uz = uz < kTickBound ? uz : kTickBound;
    uz = uz > -kTickBound ? uz : -kTickBound;
    // Truncation, one less where it went up, is the floor.
    std::int32_t x = static_cast<std::int32_t>(ux);
    std::int32_t y = static_cast<std::int32_t>(uy);
    std::int32_t z = static_cast<std::int32_t>(uz);
    x -= static_cast<float>(x) > ux ? 1 : 0;
    y -= static_cast<float>(y) > uy ? 1 : 0;
    z -= static_cast<float>(z) > uz ? 1 : 0;
    const std::int32_t inside = (x >= x_low ? 1 : 0) & (x <= x_high ? 1 : 0) &
                                (y >= y_low ? 1 : 0) & (y <= y_high ? 1 : 0) &
                                (z >= z_low ? 1 : 0) & (z <= z_high ? 1 : 0);
    const std::int32_t kept = in_range & inside;
    const std::uint32_t mask = 0U - static_cast<std::uint32_t>(kept);
    spread |= mask &
              ((static_cast<std::uint32_t>(x) + 32768U) | (static_cast<std::uint32_t>(y) + 32768U));
    block.x[i] = x;
    block.y[i] = y;
    block.z[i] = static_cast<std::int32_t>(static_cast<std::uint32_t>(z) + base_z);
    block.squared_range[i] = r2;
    block.kept[i] = kept;
    finite_count += finite;
    in_range_count += in_range;
    kept_count += kept;
  }
  block.all_near = spread < 65536U;
  dropped.not_finite += count - static_cast<std::size_t>(finite_count);
  dropped.out_of_range += static_cast<std::size_t>(finite_count - in_range_count);
  dropped.outside_map += static_cast<std::size_t>(in_range_count - kept_count);
}

}  // namespace strata
