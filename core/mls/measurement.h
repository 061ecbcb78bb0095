// From the points of a scan to quantised measurements: the first half of map creation (thesis
// 6.5.2). Used by build.h; the definitions here decide the bytes of every map.
#ifndef STRATA_CORE_MLS_MEASUREMENT_H_
#define STRATA_CORE_MLS_MEASUREMENT_H_

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/cloud/point_cloud.h"
#include "core/cloud/sensor_model.h"
#include "core/geometry/pose.h"
#include "core/mls/mls_parameters.h"

namespace strata {

// SigmaCode(model.SigmaAt(√r²)) for every float r² ≥ 0 up to (10⁶ m)², exactly, without logarithm
// or root: bins of 1/32 octave, each with at most one step of the code inside.
class RangeSigmaTable {
 public:
  explicit RangeSigmaTable(const SensorModel& model);

  std::uint8_t Code(float squared_range) const {
    const std::uint32_t bits = std::bit_cast<std::uint32_t>(squared_range) >> kBinShift;
    const Bin& bin = bins_[bits < kFirstBin ? 0 : bits - kFirstBin];
    return static_cast<std::uint8_t>(bin.code + (squared_range >= bin.step ? 1 : 0));
  }
  const SensorModel& model() const { return model_; }

 private:
  static constexpr int kBinShift = 18;  // keeps exponent and 5 bits of mantissa
  static constexpr std::uint32_t kFirstBin = (127 - 40) << 5;  // r² = 2⁻⁴⁰ m²
  static constexpr std::size_t kBins = (40 + 41) << 5;         // to r² = 2⁴¹ m²
  struct Bin {
    float step;          // the code goes up by one from here
    std::uint32_t code;  // below the step
  };
  static std::size_t BinOf(float squared_range);

  SensorModel model_;
  std::array<Bin, kBins> bins_;
};

// The key of a measurement sorts by tile, by cell in the tile, by height and, at one height, by
// falling σ, so that the last of an interval is the one a vertical patch keeps:
//   63…56 tile x + 128, 55…48 tile y + 128   relative to MeasurementSet::base_tile
//   47…32 CellInTile
//   31…8  height in ticks + 2²³
//    7…0  255 − σ code
struct Measurement {
  std::uint64_t key;
};
// The same with its point's index, for columns that follow it.
struct IndexedMeasurement {
  std::uint64_t key;
  std::uint32_t point;
};

inline std::uint32_t CellOfKey(std::uint64_t key) { return static_cast<std::uint32_t>(key >> 32); }
inline std::int32_t ZOfKey(std::uint64_t key) {
  return static_cast<std::int32_t>((key >> 8) & 0xFFFFFF) - (1 << 23);
}
inline std::uint8_t SigmaCodeOfKey(std::uint64_t key) {
  return static_cast<std::uint8_t>(255 - (key & 0xFF));
}

// Why points did not become measurements.
struct DroppedPoints {
  std::uint64_t not_finite = 0;    // NaN (no return) or infinite
  std::uint64_t out_of_range = 0;  // nearer than min_range_m or farther than max_range_m
  std::uint64_t outside_map = 0;   // beyond ±kMaxZTicks or ±kMaxCellIndex

  std::uint64_t total() const { return not_finite + out_of_range + outside_map; }
  friend bool operator==(const DroppedPoints&, const DroppedPoints&) = default;
};

// The affine map from a point, relative to the sensor, to (cells, cells, ticks) relative to a base
// cell and a base height. The base is the tile corner below the sensor, so floats stay small
// wherever on Earth the map lies; it depends on the pose and the two origins only, not on points.
//   d = p − sensor_origin;  r² = d·d;  u = A d + t   in float, sums from left to right
//   cell = base_cell + ⌊u.xy⌋,  height = base_z + ⌊u.z⌋  (t.z holds the half tick that rounds)
struct ScanFrame {
  ScanFrame(const PointCloud& cloud, const Pose& T_map_scan, const MlsParameters& parameters);

  float sensor[3];
  float A[3][3];
  float t[3];
  std::int64_t base_x, base_y;  // cells, multiples of kTileCells
  std::int64_t base_z;          // ticks
};

// Quantises `count` points from `points` on. `out` gets one measurement a kept point, in order.
struct QuantizedBlock {
  static constexpr std::size_t kSize = 512;
  std::array<std::int32_t, kSize> x, y;  // cell relative to the frame's base
  std::array<std::int32_t, kSize> z;     // ticks, absolute
  std::array<float, kSize> squared_range;
  std::array<std::int32_t, kSize> kept;  // 1 or 0
  bool all_near;                         // every kept cell is within ±2¹⁵ of the base
};
void Quantize(const Eigen::Vector3f* points,
              std::size_t count,
              const ScanFrame& frame,
              const SensorModel& sensor,
              QuantizedBlock& block,
              DroppedPoints& dropped);

}  // namespace strata

#endif  // STRATA_CORE_MLS_MEASUREMENT_H_
