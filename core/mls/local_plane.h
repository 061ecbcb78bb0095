// A plane through the tops of neighbouring patches: the ground a patch is part of. What annotation
// and planning judge slope and roughness by (thesis 6.4.2, 6.5.4).
#ifndef STRATA_CORE_MLS_LOCAL_PLANE_H_
#define STRATA_CORE_MLS_LOCAL_PLANE_H_

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <optional>

#include <Eigen/Core>

#include "core/mls/surface_tile.h"

namespace strata {

// How many standard deviations are put down to noise: a difference counts only beyond this many σ.
inline constexpr double kNoiseGate = 3.0;

// A surface as fits and step checks read it.
struct HeightSample {
  float z_m = 0.0F;
  float bottom_m = 0.0F;
  float variance_m2 = 0.0F;
  // 1 / (σ² + (cell/20)²): a fused σ tends to 0, but a cell's height is never known better than
  // what the ground does inside the cell. 0 of an underside, which is no ground.
  float weight = 0.0F;

  bool underside() const { return weight == 0.0F; }
};

// A deck whose underside is at most so far below a surface may be what the surface goes on with:
// where its top was not seen, that is unknown ground and no drop to what lies below the deck [m].
inline constexpr float kMaxDeckM = 1.0F;
// Sparse beams leave cells of a deck without a hit, over what was seen from below: gaps between
// rings. What along an axis ends on both sides within so little is taken for such cells [m], and
// what is measured in it at least so far down [m] for what others saw: from above, nobody sees the
// bottom of what is deeper than it is wide.
inline constexpr double kMaxUnseenDeckM = 0.2;
inline constexpr float kLeastUnseenDropM = 0.25F;
// The farthest cell that DeckGoesOn() asks for, along an axis.
inline constexpr int kMaxUnseenDeckCells = 4;

HeightSample SampleOf(const Surface& surface, double cell_size_m);

// True if a deck of height z_m goes on at a cell in which no beam hit it: nothing was measured
// from kLeastUnseenDropM below that height up to kMaxDeckM above it there, and along an axis tops
// of the deck (within 45° of its height) end what is like it, on both sides, within
// kMaxUnseenDeckM. `column(dx, dy)`: the surfaces of the cell so far away, a range of HeightSample;
// undersides do not count.
template <typename ColumnAt>
bool DeckGoesOn(float z_m, double cell_size_m, const ColumnAt& column) {
  enum class Met : std::uint8_t { kNothing, kTop, kBody };
  const auto meet = [&](int dx, int dy) {
    const auto reach = static_cast<float>((std::abs(dx) + std::abs(dy)) * cell_size_m);
    Met met = Met::kNothing;
    for (const HeightSample& sample : column(dx, dy)) {
      if (sample.underside()) continue;
      if (std::abs(sample.z_m - z_m) <= reach) return Met::kTop;
      if (sample.z_m > z_m - kLeastUnseenDropM && sample.bottom_m <= z_m + kMaxDeckM) {
        met = Met::kBody;
      }
    }
    return met;
  };
  const int limit =
      std::min(kMaxUnseenDeckCells, static_cast<int>(kMaxUnseenDeckM / cell_size_m + 1e-6));
  const auto run = [&](int dx, int dy) {  // of cells without a top
    for (int n = 1; n <= limit; ++n) {
      const Met met = meet(n * dx, n * dy);
      if (met != Met::kNothing) return met == Met::kTop ? n - 1 : limit;
    }
    return limit;
  };
  return meet(0, 0) == Met::kNothing &&
         (run(1, 0) + run(-1, 0) < limit || run(0, 1) + run(0, -1) < limit);
}

// z = height + gradient · (x, y), in the coordinates given to LocalPlaneFit.
struct LocalPlane {
  double height_m = 0.0;  // at (0, 0)
  Eigen::Vector2d gradient = Eigen::Vector2d::Zero();
  double gradient_sigma = 0.0;  // σ of the gradient in its own direction, by the σ of the heights
  double residual_m = 0.0;      // root of the weighted mean squared residual, n/(n − 3)-corrected
  double noise_m = 0.0;  // the residual that the σ of the heights explain, together with the
                         // unknown place of a measurement in its cell: cell·|gradient|/√12
  int count = 0;         // samples

  double slope_rad() const;
  // Upward unit normal.
  Eigen::Vector3d Normal() const;
  // What is left of the residual beyond noise [m]: √max(0, residual² − q·noise²), where
  // q = 1 + kNoiseGate·√(2/(n − 3)) bounds the chance spread of a variance of n − 3 degrees of
  // freedom.
  double roughness_m() const;
  // True if the slope is steeper than `tan_limit` beyond kNoiseGate · gradient_sigma.
  bool SteeperThan(double tan_limit) const;
};

// Weighted least squares over cells at whole offsets (dx, dy) from the one judged. A plain value,
// no allocation.
class LocalPlaneFit {
 public:
  explicit LocalPlaneFit(double cell_size_m) : cell_size_m_(cell_size_m) {}

  // `dx`, `dy` in cells; `dz_m` is the height of the sample above a reference of the caller's
  // choice, the same for all.
  void Add(double dx, double dy, double dz_m, const HeightSample& sample) {
    const double w = sample.weight;
    const double wx = w * dx;
    const double wy = w * dy;
    const double wz = w * dz_m;
    ++count_;
    w_ += w;
    wx_ += wx;
    wy_ += wy;
    wz_ += wz;
    wxx_ += wx * dx;
    wxy_ += wx * dy;
    wyy_ += wy * dy;
    wxz_ += wx * dz_m;
    wyz_ += wy * dz_m;
    wzz_ += wz * dz_m;
    wv_ += w * sample.variance_m2;
  }

  // nullopt with fewer than four samples or when they lie nearly on a line (smaller variance of
  // their places below about 0.1 cell²).
  std::optional<LocalPlane> Solve() const;

 private:
  double cell_size_m_;
  int count_ = 0;
  double w_ = 0, wx_ = 0, wy_ = 0, wz_ = 0;
  double wxx_ = 0, wxy_ = 0, wyy_ = 0, wxz_ = 0, wyz_ = 0, wzz_ = 0, wv_ = 0;
};

}  // namespace strata

#endif  // STRATA_CORE_MLS_LOCAL_PLANE_H_
