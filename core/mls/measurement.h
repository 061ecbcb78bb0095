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

// SigmaCode(model.SigmaAt(√r²)) for every float r² from (1 µm)² to (10⁶ m)², exactly, without
// logarithm or root: bins of 1/32 octave, each with at most one step of the code inside.
class RangeSigmaTable {
 public:
  // Nearer than this (r², as bits of a float) the code is that of this r².
  static constexpr std::uint32_t kFirstBits = std::uint32_t{127 - 40} << 23;  // 2⁻⁴⁰ m²

  explicit RangeSigmaTable(const SensorModel& model);

  // `bits` are the bits of a float r² in [2⁻⁴⁰, 2⁴¹).
  std::uint32_t Code(std::uint32_t bits) const {
    return (bins_[(bits - kFirstBits) >> kBinShift] + (bits & kBelowBin)) >> kBinShift;
  }
  const SensorModel& model() const { return model_; }

 private:
  static constexpr int kBinShift = 18;  // a bin has the same exponent and 5 bits of mantissa
  static constexpr std::uint32_t kBelowBin = (1U << kBinShift) - 1;
  static constexpr std::size_t kBins = (40 + 41) << 5;

  SensorModel model_;
  // The code at the bin's start · 2¹⁸, plus what makes the low bits of r² carry into it from the
  // step on.
  std::array<std::uint32_t, kBins> bins_;
};

// The key of a measurement sorts by tile, by cell in the tile, by height and, at one height, by
// falling σ, so that the last of an interval is the one a vertical patch keeps:
//   63…56 tile x + 128, 55…48 tile y + 128   relative to the tile of the frame's base
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
  std::uint64_t out_of_range = 0;  // see SensorModel::Takes()
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

// A block of quantised points, one array a quantity.
struct QuantizedBlock {
  static constexpr std::size_t kSize = 512;
  std::array<std::int32_t, kSize> x, y;            // cell relative to the frame's base
  std::array<std::uint32_t, kSize> cell;           // CellOfKey within the window of x and y
  std::array<std::uint32_t, kSize> height;         // low half of the key for σ code 0
  std::array<std::uint32_t, kSize> squared_range;  // for RangeSigmaTable::Code
  std::array<std::uint32_t, kSize> kept;  // 1 or 0; the rest of a dropped point is arbitrary
  bool all_near;  // every kept cell is within the window around the base, [-2¹⁵, 2¹⁵)
};

// Quantises `count` ≤ QuantizedBlock::kSize points and counts those it drops.
void Quantize(const Eigen::Vector3f* points,
              std::size_t count,
              const ScanFrame& frame,
              const SensorModel& sensor,
              QuantizedBlock& block,
              DroppedPoints& dropped);

}  // namespace strata

#endif  // STRATA_CORE_MLS_MEASUREMENT_H_
