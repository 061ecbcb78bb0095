// Squares of ground, for validation: what stands in one place looks alike from scan to scan, so
// points of one place must not be on both sides.
#ifndef STRATA_CORE_CLASSIFICATION_REGIONS_H_
#define STRATA_CORE_CLASSIFICATION_REGIONS_H_

#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/cloud/point_cloud.h"

namespace strata {

// Which square of `edge_m` > 0 every place (x, y) [m] lies in; numbered from 0 as they come.
std::vector<std::size_t> RegionsOf(std::span<const Eigen::Vector2d> places, double edge_m);

// The finite points and labels of `clouds`, each cloud cut into one for each square that it has
// points in; squares are those of the clouds' common frame, by their origins.
struct RegionClouds {
  std::vector<PointCloud> clouds;
  std::vector<std::size_t> regions;  // of `clouds`, as RegionsOf()
};
RegionClouds CutIntoRegions(const std::vector<PointCloud>& clouds, double edge_m);

}  // namespace strata

#endif  // STRATA_CORE_CLASSIFICATION_REGIONS_H_
