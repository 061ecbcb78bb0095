// Worlds drawn for tests and the demo, with robots that drive through them. Metres, z up.
#ifndef STRATA_TESTS_SUPPORT_SIMULATOR_WORLDS_H_
#define STRATA_TESTS_SUPPORT_SIMULATOR_WORLDS_H_

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "tests/support/simulator/scene.h"

namespace strata::testing {

// What things are in the worlds that robots drive through: labels of their solids.
enum WorldClass : std::uint16_t { kGround = 1, kWall, kWindow, kStairs, kVegetation, kPole };
std::string ToString(WorldClass world_class);

struct Robot {
  std::string name;
  std::vector<Eigen::Vector3d> waypoints;  // for Drive()
};

struct World {
  Scene scene;  // built
  std::vector<Robot> robots;
  std::vector<Robot> loops;                       // robots that come back to where they started
  std::map<std::string, Eigen::Vector3d> places;  // exact points on surfaces
};

// A deck of 12 × 4 m along x over a road along y, with ramps of slope 0.2 up to it on both sides;
// houses, walls and posts around. Ground is z = 0, and the deck's top `clearance_m + 0.4`.
//   robots: "over" drives up, across and down along y = 0; "under" drives along x = 0 beneath.
//   loops: "eight" drives a figure of eight of 170 m, over the deck and under it.
//   places: "west", "east" at the ramps' feet, "south", "north" on the road, "deck" and "under" at
//   x = y = 0.
struct BridgeOptions {
  bool parapets = true;      // 0.9 m high walls along both edges of deck and ramps
  double clearance_m = 3.0;  // between road and deck
};
World BridgeWorld(const BridgeOptions& options = {});

// Two storeys of 40 × 24 m with columns, walls with windows around them, and a ramp between. Floors
// are z = 0 and 3.2, the upper one on a slab of `slab_m`.
//   robots: "visitor" goes round below, up the ramp and round above.
//   loops: "loop" goes round below, up, round above and down to its start, 230 m.
//   places: "below" and "above" at the same x, y; "ramp_foot", "ramp_head".
World CarParkWorld(double slab_m = 0.3);

// Four rooms around (0, 0), some 14 × 11 m together and 2.8 m high, with a ceiling; walls between
// and around them are `wall_m` thick, with a door in each inner one and cupboards, boxes and
// columns that stand free; sizes, doors and things by the seed.
//   robots: "round" goes through all of them, and through the first two once more.
//   places: "crossing", where the middles of the inner walls along x and y cross; "room0" to
//   "room3", counterclockwise from the one with the least x and y.
World RoomsWorld(double wall_m = 0.1, std::uint64_t seed = 1);

// Rolling terrain of 300 × 300 m with houses and trees.
//   robots: "north_loop" and "south_loop", each some 500 m, sharing the street in the middle.
//   places: "start" and "far".
World CampusWorld(std::uint64_t seed = 1);

// That terrain: z above (x, y).
double CampusHeight(double x, double y);

// Such terrain over `area` with as many houses and trees beside the ways of `robots`, built.
World PlantCampus(std::vector<Robot> robots,
                  const Eigen::AlignedBox2d& area,
                  int houses,
                  int trees,
                  std::uint64_t seed);

// The same terrain with other houses and trees.
//   robots: "loop", 300 m round and 10 m of the way once more; shape and place by the seed.
//   places: "start" and "far".
World CampusLoopWorld(std::uint64_t seed = 1);

// Districts of 300 × 300 m of such terrain, five a row, each with streets 60 m apart: as large as
// wanted, and everywhere alike.
//   robots: "robot0", "robot1", … drive all streets of a district along x, then all along y, then
//   those along x again: 6.9 km. Neighbours share the street between them.
World CityWorld(int districts, std::uint64_t seed = 1);

// A building of two wings with rows of windows and two flights of stairs, on a level lawn with
// bushes, trees and lamp posts; size, shape and what stands around it by the seed.
//   robots: "round" drives round it, some 200 m.
//   places: "start", and "door" at the head of the stairs.
World BuildingWorld(std::uint64_t seed = 1);

// A yard of 48 × 28 m around (5, 0) with a wall of 4 m around it, three sheds and four posts; its
// ground is z = 0. Small, and well determined from anywhere in it: for tests of single steps.
Scene YardScene();

}  // namespace strata::testing

#endif  // STRATA_TESTS_SUPPORT_SIMULATOR_WORLDS_H_
