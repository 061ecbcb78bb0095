#include "tests/experiments/exploring/explored_site.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Geometry>

#include "tests/support/simulator/scene.h"

namespace strata::testing {
namespace {

using Eigen::Vector3d;

constexpr double kBelowM = 0.5;
constexpr double kAboveM = 2.0;  // the highest ground

ExploredSite CarPark() {
  ExploredSite site;
  site.name = "car_park";
  site.world = CarParkWorld();
  site.tour = site.world.robots.front().waypoints;
  site.region = {Vector3d(-20.0, -12.0, -kBelowM), Vector3d(20.0, 12.0, 3.2 + kAboveM)};
  site.levels = {{"below", -0.5, 0.4}, {"ramp", 0.4, 2.8}, {"above", 2.8, 4.0}};
  return site;
}

// The lawn around it, a little farther than the tour leads.
ExploredSite Building(std::uint64_t seed) {
  constexpr double kMarginM = 4.0;
  ExploredSite site;
  site.name = "building";
  site.world = BuildingWorld(seed);
  site.tour = site.world.robots.front().waypoints;
  for (const Vector3d& corner : site.tour) site.region.extend(corner);
  site.region.min() -= Vector3d(kMarginM, kMarginM, kBelowM);
  site.region.max() += Vector3d(kMarginM, kMarginM, kAboveM);
  site.levels = {{"lawn", -0.5, 0.4}};
  return site;
}

bool IsInside(const Solid& solid, const Vector3d& p) {
  return solid.box.contains(p) &&
         std::all_of(solid.faces.begin(), solid.faces.end(), [&](const Solid::Face& face) {
           return face.normal.dot(p) <= face.offset;
         });
}

}  // namespace

ExploredSite SiteOf(absl::string_view name, std::uint64_t seed) {
  return name == "building" ? Building(seed) : CarPark();
}

double LengthOf(const std::vector<Vector3d>& way) {
  double length = 0.0;
  for (std::size_t i = 1; i < way.size(); ++i) {
    length += (way[i] - way[i - 1]).head<2>().norm();
  }
  return length;
}

std::vector<Vector3d> Everywhere(const ExploredSite& site, double spacing_m, double height_m) {
  const Scene& scene = site.world.scene;
  std::vector<Vector3d> places;
  for (double x = site.region.min().x(); x <= site.region.max().x(); x += spacing_m) {
    for (double y = site.region.min().y(); y <= site.region.max().y(); y += spacing_m) {
      for (const ExploredSite::Level& level : site.levels) {
        const std::optional<double> ground = scene.GroundBelow(x, y, level.high_m);
        if (!ground.has_value() || *ground < level.low_m) continue;
        const Vector3d place(x, y, *ground + height_m);
        if (std::none_of(scene.solids().begin(), scene.solids().end(), [&](const Solid& solid) {
              return IsInside(solid, place);
            })) {
          places.push_back(place);
        }
      }
    }
  }
  return places;
}

}  // namespace strata::testing
