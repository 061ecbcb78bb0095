#include "core/classification/regions.h"

#include <cmath>
#include <map>
#include <utility>

namespace strata {

std::vector<std::size_t> RegionsOf(std::span<const Eigen::Vector2d> places, double edge_m) {
  std::map<std::pair<double, double>, std::size_t> numbers;
  std::vector<std::size_t> regions;
  regions.reserve(places.size());
  for (const Eigen::Vector2d& place : places) {
    const std::pair<double, double> square(std::floor(place.x() / edge_m),
                                           std::floor(place.y() / edge_m));
    regions.push_back(numbers.try_emplace(square, numbers.size()).first->second);
  }
  return regions;
}

RegionClouds CutIntoRegions(const std::vector<PointCloud>& clouds, double edge_m) {
  std::vector<Eigen::Vector2d> places;
  for (const PointCloud& cloud : clouds) {
    for (const Eigen::Vector3f& point : cloud.points) {
      if (!point.allFinite()) continue;
      places.emplace_back((cloud.origin + point.cast<double>()).head<2>());
    }
  }
  const std::vector<std::size_t> regions = RegionsOf(places, edge_m);
  RegionClouds cut;
  std::size_t next = 0;
  for (const PointCloud& cloud : clouds) {
    std::map<std::size_t, std::size_t> part_of;  // by region, for this cloud
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      if (!cloud.points[i].allFinite()) continue;
      const std::size_t region = regions[next++];
      const auto [part, added] = part_of.try_emplace(region, cut.clouds.size());
      if (added) {
        cut.clouds.emplace_back();
        cut.clouds.back().origin = cloud.origin;
        cut.clouds.back().sensor_origin = cloud.sensor_origin;
        cut.regions.push_back(region);
      }
      PointCloud& to = cut.clouds[part->second];
      to.points.push_back(cloud.points[i]);
      if (!cloud.label.empty()) to.label.push_back(cloud.label[i]);
    }
  }
  return cut;
}

}  // namespace strata
