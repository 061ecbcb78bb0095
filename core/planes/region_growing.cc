#include "core/planes/region_growing.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "core/planes/extraction.h"
#include "core/planes/moments.h"
#include "core/planes/planar_cells.h"

namespace strata {
namespace {

// A cell may spread so much more about the region's plane than about its own.
constexpr double kSpreadGate = 1.5;

std::vector<std::uint32_t> SeedOrder(std::span<const PlanarCell> cells) {
  std::vector<std::uint32_t> order(cells.size());
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(), [cells](std::uint32_t a, std::uint32_t b) {
    if (cells[a].level != cells[b].level) return cells[a].level > cells[b].level;
    return cells[a].rms_m < cells[b].rms_m;
  });
  return order;
}

class RegionGrower {
 public:
  RegionGrower(std::span<const PlanarCell> cells,
               const std::vector<std::vector<std::uint32_t>>& touching,
               const PlaneExtractionOptions& options)
      : cells_(cells),
        options_(options),
        min_cosine_(std::cos(options.max_angle_rad)),
        touching_(touching),
        taken_(cells.size(), false) {}

  std::vector<PlanarRegion> Run() {
    std::vector<PlanarRegion> regions;
    const std::vector<std::uint32_t> order = SeedOrder(cells_);
    for (int pass = 0; pass < 2; ++pass) {  // the second for what regions of the first left again
      for (const std::uint32_t seed : order) {
        if (taken_[seed]) continue;
        PlanarRegion region = Grow(seed);
        DropWhatDoesNotFit(region);
        std::sort(region.cells.begin(), region.cells.end());
        regions.push_back(std::move(region));
      }
    }
    return regions;
  }

 private:
  bool Fits(const PlanarCell& cell, const Plane& plane) const {
    const double limit =
        std::min(kSpreadGate * std::max(cell.rms_m, options_.sensor.sigma_m), options_.max_rms_m);
    return std::abs(cell.normal.dot(plane.normal)) >= min_cosine_ &&
           RmsDistance(cell.moments, plane) <= std::max(limit, cell.rms_m);
  }

  PlanarRegion Grow(std::uint32_t seed) {
    PlanarRegion region;
    region.cells = {seed};
    region.moments = cells_[seed].moments;
    region.fit = FitMoments(region.moments);
    taken_[seed] = true;
    for (std::size_t next = 0; next < region.cells.size(); ++next) {
      for (const std::uint32_t i : touching_[region.cells[next]]) {
        if (taken_[i] || !Fits(cells_[i], region.fit.plane)) continue;
        taken_[i] = true;
        region.cells.push_back(i);
        region.moments += cells_[i].moments;
        region.fit = FitMoments(region.moments);
      }
    }
    return region;
  }

  // Cells that joined while the plane was still another one are free again.
  void DropWhatDoesNotFit(PlanarRegion& region) {
    const auto kept =
        std::stable_partition(region.cells.begin(), region.cells.end(), [&](std::uint32_t i) {
          return Fits(cells_[i], region.fit.plane);
        });
    if (kept == region.cells.end() || kept == region.cells.begin()) return;
    for (auto it = kept; it != region.cells.end(); ++it) taken_[*it] = false;
    region.cells.erase(kept, region.cells.end());
    region.moments.setZero();
    for (const std::uint32_t i : region.cells) region.moments += cells_[i].moments;
    region.fit = FitMoments(region.moments);
  }

  std::span<const PlanarCell> cells_;
  const PlaneExtractionOptions& options_;
  double min_cosine_;
  const std::vector<std::vector<std::uint32_t>>& touching_;
  std::vector<bool> taken_;
};

}  // namespace

std::vector<PlanarRegion> GrowRegions(std::span<const PlanarCell> cells,
                                      const std::vector<std::vector<std::uint32_t>>& touching,
                                      const PlaneExtractionOptions& options) {
  return RegionGrower(cells, touching, options).Run();
}

}  // namespace strata
