// Where a plane has surface and where rays cross it, in squares of the plane.
// Internal to core/planes, not installed.
#ifndef STRATA_CORE_PLANES_MODELS_PLANE_RASTER_H_
#define STRATA_CORE_PLANES_MODELS_PLANE_RASTER_H_

#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include <Eigen/Core>

#include "core/common/hash_map.h"
#include "core/geometry/primitives.h"

namespace strata {

// Coordinates in a plane: p = origin + u axis_u + v axis_v; axis_u × axis_v is its normal.
struct PlaneFrame {
  Eigen::Vector3d origin, axis_u, axis_v;

  Eigen::Vector2d Flat(const Eigen::Vector3d& p) const {
    return {axis_u.dot(p - origin), axis_v.dot(p - origin)};
  }
  Eigen::Vector3d Lift(const Eigen::Vector2d& p) const {
    return origin + p.x() * axis_u + p.y() * axis_v;
  }
};

// `near` projected onto the plane is the origin. In an upright plane axis_u is level, in a level
// one it is x.
PlaneFrame FrameOf(const Plane& plane, const Eigen::Vector3d& near);

// The frame turned as little as possible into a plane that is nearly its own.
PlaneFrame TurnedInto(const Plane& plane, const PlaneFrame& frame);

// Squares in blocks, so that memory grows with the surface. Not thread-safe.
class PlaneRaster {
 public:
  PlaneRaster(double square_m, double look_square_m)
      : square_m_(square_m), look_square_m_(look_square_m) {}

  void AddHit(const Eigen::Vector2d& at) { AddHits(at, 1); }
  void AddHits(const Eigen::Vector2d& at, std::uint32_t hits);
  void AddLook(const Eigen::Vector2d& at);

  std::size_t bytes() const {
    return blocks_.size() * (sizeof(Block) + kIndexBytes) + looks_.size() * kIndexBytes;
  }
  // A point a square, the mean of what fell into it, in the order of their places. Deep inside of
  // surface every third square of every third row: as far apart they bound the same α-shapes, with
  // a ninth of the points. REQUIRES: radius ≥ 3.5 squares.
  std::vector<Eigen::Vector2d> Outline() const;
  // Each square with hits: their mean place and number.
  void ForEachSquare(
      absl::FunctionRef<void(const Eigen::Vector2d& at, std::uint32_t hits)> body) const;
  // In the square that the point is in and those up to `reach` squares beside it.
  std::uint64_t HitsAround(const Eigen::Vector2d& at, std::int32_t reach) const;
  // Forgets the hits of squares by their middles.
  void DropHits(absl::FunctionRef<bool(const Eigen::Vector2d& middle)> which);
  // Whether a ray crossed the square that the point is in.
  bool HasLook(const Eigen::Vector2d& at) const;
  double look_square_m() const { return look_square_m_; }
  // Centres of squares with hits within `reach_m` of the line through `at` along unit `along`, as
  // lengths along it; unordered.
  std::vector<double> HitsAlong(const Eigen::Vector2d& at,
                                const Eigen::Vector2d& along,
                                double reach_m) const;

 private:
  static constexpr int kBlock = 16;
  static constexpr std::size_t kIndexBytes = 64;  // of a block, about
  struct Square {
    float u = 0.0F, v = 0.0F;  // sums, relative to the square's corner
    std::uint32_t hits = 0;
  };
  using Block = std::array<Square, kBlock * kBlock>;

  // Block, and bit in it.
  std::pair<std::uint64_t, std::size_t> LookPlaceOf(const Eigen::Vector2d& at) const;
  Square& At(std::int32_t i, std::int32_t j);
  const Square* Find(std::int32_t i, std::int32_t j) const;
  bool IsDeep(std::int32_t i, std::int32_t j) const;

  double square_m_, look_square_m_;
  HashMap<std::uint64_t, std::size_t> index_;  // of blocks
  std::vector<std::uint64_t> keys_;
  std::vector<Block> blocks_;
  HashMap<std::uint64_t, std::bitset<kBlock * kBlock>> looks_;  // blocks of look squares
};

}  // namespace strata

#endif  // STRATA_CORE_PLANES_MODELS_PLANE_RASTER_H_
