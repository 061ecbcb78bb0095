#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "tests/support/simulator/simulator.h"
#include "tests/support/simulator/walls.h"
#include "tests/support/simulator/worlds.h"

namespace strata::testing {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Floor = Eigen::AlignedBox2d;

constexpr double kHeightM = 2.8;
constexpr double kHalfDoorM = 0.55;
constexpr double kLintelM = 2.1;

Opening DoorAt(double middle) {
  return {.from = middle - kHalfDoorM, .to = middle + kHalfDoorM, .sill = 0.0, .lintel = kLintelM};
}

// The middle of the door between two rooms: in the wall from the crossing outwards.
double DoorPlace(double end, Random& random) { return random.Uniform(0.35, 0.65) * end; }

// What stands in a room, off its walls so that these are seen, and off the ways between doors.
void Furnish(Scene& scene, const Floor& room, const std::vector<Vector2d>& way, Random& random) {
  constexpr double kOffWallM = 0.3;
  constexpr double kOffWayM = 0.9;
  for (int made = 0, tried = 0; made < 4 && tried < 200; ++tried) {
    const Vector2d half(random.Uniform(0.15, 0.5), random.Uniform(0.15, 0.5));
    Vector2d middle;
    for (int axis : {0, 1}) {
      const double off = half[axis] + kOffWallM;
      middle[axis] = random.Uniform(room.min()[axis] + off, room.max()[axis] - off);
    }
    const Floor kept(middle - half.array().matrix() - Vector2d::Constant(kOffWayM),
                     middle + half + Vector2d::Constant(kOffWayM));
    bool free = true;
    for (std::size_t i = 0; i + 1 < way.size(); ++i) {
      for (double share = 0.0; share <= 1.0; share += 0.02) {
        free = free && !kept.contains(way[i] + share * (way[i + 1] - way[i]));
      }
    }
    if (!free) continue;
    const double height = random.Uniform(0.4, 2.2);
    scene.Add(Labelled(Box({middle.x() - half.x(), middle.y() - half.y(), 0.0},
                           {middle.x() + half.x(), middle.y() + half.y(), height}),
                       kPole));
    ++made;
  }
}

}  // namespace

World RoomsWorld(double wall_m, std::uint64_t seed) {
  Random random(seed);
  const Floor inside(Vector2d(-random.Uniform(6.0, 8.0), -random.Uniform(5.0, 6.5)),
                     Vector2d(random.Uniform(6.0, 8.0), random.Uniform(5.0, 6.5)));
  const double half = 0.5 * wall_m;
  World world;
  Scene& scene = world.scene;
  const Vector2d out = Vector2d::Constant(wall_m);
  const Floor all(inside.min() - out, inside.max() + out);
  scene.Add(Labelled(Box({all.min().x(), all.min().y(), -0.3}, {all.max().x(), all.max().y(), 0.0}),
                     kGround));
  scene.Add(Labelled(
      Box({all.min().x(), all.min().y(), kHeightM}, {all.max().x(), all.max().y(), kHeightM + 0.3}),
      kWall));
  const Vector2d low(DoorPlace(inside.min().x(), random), DoorPlace(inside.min().y(), random));
  const Vector2d high(DoorPlace(inside.max().x(), random), DoorPlace(inside.max().y(), random));
  for (const bool along_y : {false, true}) {
    const int along = along_y ? 1 : 0;
    const auto wall = [&](double face, const std::vector<Opening>& doors) {
      AddWall(scene,
              {.along_y = along_y,
               .from = all.min()[along],
               .to = all.max()[along],
               .face = face,
               .label = kWall},
              0.0,
              kHeightM,
              wall_m,
              doors,
              0.0);
    };
    wall(all.min()[1 - along], {});
    wall(inside.max()[1 - along], {});
    wall(-half, {DoorAt(low[along]), DoorAt(high[along])});
  }
  // Doors in the order in which they are passed, and what each room's way leads through.
  const std::array<Vector2d, 4> doors = {Vector2d(0.0, low.y()),
                                         Vector2d(high.x(), 0.0),
                                         Vector2d(0.0, high.y()),
                                         Vector2d(low.x(), 0.0)};
  const std::array<Vector2d, 4> corners = {inside.min(),
                                           Vector2d(inside.max().x(), inside.min().y()),
                                           inside.max(),
                                           Vector2d(inside.min().x(), inside.max().y())};
  Robot robot{"round", {}};
  std::vector<Vector2d> round;
  for (std::size_t i = 0; i < 4; ++i) {
    const Vector2d& entry = doors[(i + 3) % 4];
    const Vector2d& exit = doors[i];
    const Vector2d middle = 0.5 * corners[i];
    // Straight through the doors, then to the middle.
    const Vector2d from =
        entry + Vector2d(corners[i].cwiseSign())
                    .cwiseProduct(entry.x() == 0.0 ? Vector2d(0.9, 0.0) : Vector2d(0.0, 0.9));
    const Vector2d to =
        exit + Vector2d(corners[i].cwiseSign())
                   .cwiseProduct(exit.x() == 0.0 ? Vector2d(0.9, 0.0) : Vector2d(0.0, 0.9));
    const std::vector<Vector2d> way = {entry, from, middle, to, exit};
    Floor room;
    room.extend(corners[i]);
    room.extend(half * corners[i].cwiseSign());
    Furnish(scene, room, way, random);
    round.insert(round.end(), {from, middle, to});
    world.places["room" + std::to_string(i)] = {middle.x(), middle.y(), 0.0};
  }
  scene.Build();
  round.insert(round.end(), round.begin(), round.begin() + 6);
  for (const Vector2d& at : round) robot.waypoints.emplace_back(at.x(), at.y(), 0.0);
  world.robots = {robot};
  world.places["crossing"] = {0.0, 0.0, 0.0};
  return world;
}

}  // namespace strata::testing
