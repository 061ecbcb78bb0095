#include "core/planes/models/plane_raster.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/geometry/primitives.h"

namespace strata {
namespace {

constexpr std::int32_t kDeep = 3;  // squares of surface on all sides

std::uint64_t KeyAt(std::int32_t i, std::int32_t j) {
  return static_cast<std::uint64_t>(static_cast<std::uint32_t>(i)) << 32 |
         static_cast<std::uint32_t>(j);
}

std::int32_t SquareOf(double at, double square_m) {
  return static_cast<std::int32_t>(std::floor(at / square_m));
}

std::int32_t FloorDivide(std::int32_t a, std::int32_t b) {
  return a >= 0 ? a / b : -((b - 1 - a) / b);
}

}  // namespace

PlaneFrame FrameOf(const Plane& plane, const Eigen::Vector3d& near) {
  PlaneFrame frame;
  frame.origin = near - SignedDistance(near, plane) * plane.normal;
  Eigen::Vector3d u = Eigen::Vector3d::UnitZ().cross(plane.normal);
  if (u.norm() < 0.5) u = Eigen::Vector3d::UnitX() - plane.normal.x() * plane.normal;
  frame.axis_u = u.normalized();
  frame.axis_v = plane.normal.cross(frame.axis_u);
  return frame;
}

PlaneFrame TurnedInto(const Plane& plane, const PlaneFrame& frame) {
  PlaneFrame out;
  out.origin = frame.origin - SignedDistance(frame.origin, plane) * plane.normal;
  const Eigen::Vector3d& u = frame.axis_u;
  out.axis_u = (u - u.dot(plane.normal) * plane.normal).normalized();
  out.axis_v = plane.normal.cross(out.axis_u);
  return out;
}

PlaneRaster::Square& PlaneRaster::At(std::int32_t i, std::int32_t j) {
  const std::int32_t bi = FloorDivide(i, kBlock), bj = FloorDivide(j, kBlock);
  const auto [found, is_new] = index_.try_emplace(KeyAt(bi, bj), blocks_.size());
  if (is_new) {
    blocks_.emplace_back();
    keys_.push_back(found->first);
  }
  return blocks_[found->second]
                [static_cast<std::size_t>((i - bi * kBlock) * kBlock + j - bj * kBlock)];
}

const PlaneRaster::Square* PlaneRaster::Find(std::int32_t i, std::int32_t j) const {
  const std::int32_t bi = FloorDivide(i, kBlock), bj = FloorDivide(j, kBlock);
  const auto found = index_.find(KeyAt(bi, bj));
  if (found == index_.end()) return nullptr;
  return &blocks_[found->second]
                 [static_cast<std::size_t>((i - bi * kBlock) * kBlock + j - bj * kBlock)];
}

void PlaneRaster::AddHits(const Eigen::Vector2d& at, std::uint32_t hits) {
  const std::int32_t i = SquareOf(at.x(), square_m_), j = SquareOf(at.y(), square_m_);
  Square& square = At(i, j);
  square.u += static_cast<float>(hits * (at.x() - i * square_m_));
  square.v += static_cast<float>(hits * (at.y() - j * square_m_));
  square.hits += hits;
}

void PlaneRaster::ForEachSquare(
    absl::FunctionRef<void(const Eigen::Vector2d& at, std::uint32_t hits)> body) const {
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    const auto bi = static_cast<std::int32_t>(keys_[b] >> 32);
    const auto bj = static_cast<std::int32_t>(keys_[b] & 0xFFFFFFFFU);
    for (std::int32_t k = 0; k < kBlock * kBlock; ++k) {
      const Square& square = blocks_[b][static_cast<std::size_t>(k)];
      if (square.hits == 0) continue;
      const Eigen::Vector2d corner(bi * kBlock + k / kBlock, bj * kBlock + k % kBlock);
      body(square_m_ * corner + Eigen::Vector2d(square.u, square.v) / square.hits, square.hits);
    }
  }
}

std::uint64_t PlaneRaster::HitsAround(const Eigen::Vector2d& at, std::int32_t reach) const {
  const std::int32_t i = SquareOf(at.x(), square_m_), j = SquareOf(at.y(), square_m_);
  std::uint64_t hits = 0;
  for (std::int32_t a = -reach; a <= reach; ++a) {
    for (std::int32_t b = -reach; b <= reach; ++b) {
      const Square* square = Find(i + a, j + b);
      if (square != nullptr) hits += square->hits;
    }
  }
  return hits;
}

void PlaneRaster::DropHits(absl::FunctionRef<bool(const Eigen::Vector2d& middle)> which) {
  std::vector<Square*> dropped;
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    const auto bi = static_cast<std::int32_t>(keys_[b] >> 32);
    const auto bj = static_cast<std::int32_t>(keys_[b] & 0xFFFFFFFFU);
    for (std::int32_t k = 0; k < kBlock * kBlock; ++k) {
      Square& square = blocks_[b][static_cast<std::size_t>(k)];
      const Eigen::Vector2d at(bi * kBlock + k / kBlock + 0.5, bj * kBlock + k % kBlock + 0.5);
      if (square.hits > 0 && which(square_m_ * at)) dropped.push_back(&square);
    }
  }
  for (Square* const square : dropped) *square = Square();
}

std::pair<std::uint64_t, std::size_t> PlaneRaster::LookPlaceOf(const Eigen::Vector2d& at) const {
  const std::int32_t i = SquareOf(at.x(), look_square_m_), j = SquareOf(at.y(), look_square_m_);
  const std::int32_t bi = FloorDivide(i, kBlock), bj = FloorDivide(j, kBlock);
  return {KeyAt(bi, bj), static_cast<std::size_t>((i - bi * kBlock) * kBlock + j - bj * kBlock)};
}

void PlaneRaster::AddLook(const Eigen::Vector2d& at) {
  const auto [block, bit] = LookPlaceOf(at);
  looks_[block].set(bit);
}

bool PlaneRaster::HasLook(const Eigen::Vector2d& at) const {
  const auto [block, bit] = LookPlaceOf(at);
  const auto found = looks_.find(block);
  return found != looks_.end() && found->second.test(bit);
}

bool PlaneRaster::IsDeep(std::int32_t i, std::int32_t j) const {
  for (std::int32_t a = -kDeep; a <= kDeep; ++a) {
    for (std::int32_t b = -kDeep; b <= kDeep; ++b) {
      const Square* square = Find(i + a, j + b);
      if (square == nullptr || square->hits == 0) return false;
    }
  }
  return true;
}

std::vector<Eigen::Vector2d> PlaneRaster::Outline() const {
  std::vector<std::size_t> order(keys_.size());
  std::iota(order.begin(), order.end(), 0U);
  std::sort(order.begin(), order.end(), [this](std::size_t a, std::size_t b) {
    return keys_[a] < keys_[b];
  });
  std::vector<Eigen::Vector2d> points;
  for (const std::size_t b : order) {
    const auto bi = static_cast<std::int32_t>(keys_[b] >> 32);
    const auto bj = static_cast<std::int32_t>(keys_[b] & 0xFFFFFFFFU);
    for (std::int32_t k = 0; k < kBlock * kBlock; ++k) {
      const Square& square = blocks_[b][static_cast<std::size_t>(k)];
      if (square.hits == 0) continue;
      const std::int32_t i = bi * kBlock + k / kBlock, j = bj * kBlock + k % kBlock;
      if ((i % kDeep != 0 || j % kDeep != 0) && IsDeep(i, j)) continue;
      points.emplace_back(i * square_m_ + square.u / static_cast<double>(square.hits),
                          j * square_m_ + square.v / static_cast<double>(square.hits));
    }
  }
  return points;
}

std::vector<double> PlaneRaster::HitsAlong(const Eigen::Vector2d& at,
                                           const Eigen::Vector2d& along,
                                           double reach_m) const {
  const Eigen::Vector2d across(-along.y(), along.x());
  const double block_reach = reach_m + square_m_ * kBlock;  // of a block's centre
  std::vector<double> places;
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    const auto bi = static_cast<std::int32_t>(keys_[b] >> 32);
    const auto bj = static_cast<std::int32_t>(keys_[b] & 0xFFFFFFFFU);
    const Eigen::Vector2d corner = square_m_ * kBlock * Eigen::Vector2d(bi, bj);
    const Eigen::Vector2d centre = corner.array() + square_m_ * kBlock / 2.0;
    if (std::abs(across.dot(centre - at)) > block_reach) continue;
    for (int k = 0; k < kBlock * kBlock; ++k) {
      if (blocks_[b][static_cast<std::size_t>(k)].hits == 0) continue;
      const Eigen::Vector2d p =
          corner + square_m_ * Eigen::Vector2d(k / kBlock + 0.5, k % kBlock + 0.5);
      if (std::abs(across.dot(p - at)) <= reach_m) places.push_back(along.dot(p - at));
    }
  }
  return places;
}

}  // namespace strata
