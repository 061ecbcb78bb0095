// Drawn worlds to be explored, with the tour that a person would drive.
#ifndef STRATA_TESTS_EXPERIMENTS_EXPLORING_EXPLORED_SITE_H_
#define STRATA_TESTS_EXPERIMENTS_EXPLORING_EXPLORED_SITE_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/strings/string_view.h"
#include <Eigen/Geometry>

#include "tests/support/simulator/worlds.h"

namespace strata::testing {

struct ExploredSite {
  struct Level {
    std::string name;
    double low_m = 0.0, high_m = 0.0;  // of its ground
  };
  std::string name;
  World world;
  Eigen::AlignedBox3d region;         // to be explored
  std::vector<Eigen::Vector3d> tour;  // waypoints for Drive()
  std::vector<Level> levels;          // lowest first
};

// "car_park", whose world is always the same, or "building", drawn.
ExploredSite SiteOf(absl::string_view name, std::uint64_t seed);

// [m], as Drive() drives it on level ground.
double LengthOf(const std::vector<Eigen::Vector3d>& way);

// Sensors `height_m` over all ground of a site, `spacing_m` apart, out of solids: what sees all
// that there is to be seen.
std::vector<Eigen::Vector3d> Everywhere(const ExploredSite& site,
                                        double spacing_m,
                                        double height_m);

}  // namespace strata::testing

#endif  // STRATA_TESTS_EXPERIMENTS_EXPLORING_EXPLORED_SITE_H_
