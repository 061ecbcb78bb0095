#include "core/planes/models/doubled_planes.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/planes/models/plane_raster.h"
#include "core/planes/moments.h"

namespace strata {
namespace {

constexpr double kParallelCosine = 0.99;  // 8°
constexpr double kDoubledShare = 0.5;     // of a plane's points
// Squares around a place that are looked at: as few as hold enough points to tell.
constexpr std::array<std::int32_t, 4> kReaches = {0, 1, 2, 4};
constexpr double kEnoughHits = 8.0;

bool MayBelong(const FacedPlane& small, const FacedPlane& large) {
  const double cosine = small.seen.plane.normal.dot(large.seen.plane.normal);
  if (std::abs(cosine) < kParallelCosine || !small.seen.box.intersects(large.seen.box))
    return false;
  const bool same_side = (small.facing < 0) == ((large.facing < 0) != (cosine < 0.0));
  return same_side && AreAlike(small.colour, large.colour) &&
         RmsDistance(small.moments, large.seen.plane) <= large.band_m;
}

std::int32_t ReachOf(const PlaneRaster& raster) {
  for (const std::int32_t reach : kReaches) {
    double sum = 0.0, squares = 0.0;
    raster.ForEachSquare([&](const Eigen::Vector2d& at, std::uint32_t) {
      sum += static_cast<double>(raster.HitsAround(at, reach));
      squares += 1.0;
    });
    if (sum >= kEnoughHits * squares) return reach;
  }
  return kReaches.back();
}

double SharedPart(const FacedPlane& small, std::int32_t reach, const FacedPlane& large) {
  double shared = 0.0, all = 0.0;
  small.seen.raster.ForEachSquare([&](const Eigen::Vector2d& at, std::uint32_t hits) {
    const Eigen::Vector2d there = large.seen.frame.Flat(small.seen.frame.Lift(at));
    all += hits;
    const std::uint64_t others = large.seen.raster.HitsAround(there, reach);
    if (2 * others >= small.seen.raster.HitsAround(at, reach)) shared += hits;
  });
  return all > 0.0 ? shared / all : 0.0;
}

}  // namespace

std::vector<std::size_t> OwnersOf(std::span<const FacedPlane> planes) {
  std::vector<std::size_t> owners;
  for (std::size_t m = 0; m < planes.size(); ++m) {
    owners.push_back(m);
    std::int32_t reach = -1;  // found when it is needed
    double most = kDoubledShare;
    for (std::size_t large = 0; large < m; ++large) {
      if (owners[large] != large || !MayBelong(planes[m], planes[large])) continue;
      if (reach < 0) reach = ReachOf(planes[m].seen.raster);
      const double share = SharedPart(planes[m], reach, planes[large]);
      if (share < most) continue;
      most = share;
      owners[m] = large;
    }
  }
  return owners;
}

void AddSeen(const FacedPlane& other, FacedPlane& plane) {
  other.seen.raster.ForEachSquare([&](const Eigen::Vector2d& at, std::uint32_t hits) {
    plane.seen.raster.AddHits(plane.seen.frame.Flat(other.seen.frame.Lift(at)), hits);
  });
  plane.seen.box.extend(other.seen.box);
  const bool turned = other.seen.plane.normal.dot(plane.seen.plane.normal) < 0.0;
  plane.facing += turned ? -other.facing : other.facing;
  plane.moments += other.moments;
}

}  // namespace strata
