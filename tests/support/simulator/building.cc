#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include <Eigen/Geometry>

#include "tests/support/simulator/simulator.h"
#include "tests/support/simulator/walls.h"
#include "tests/support/simulator/worlds.h"

namespace strata::testing {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Footprint = Eigen::AlignedBox2d;

constexpr double kStoreyM = 3.2;
constexpr double kRouteM = 8.0;  // from the building

// What all walls of one building share.
struct Style {
  int storeys = 2;
  double window_m = 1.4;
  double pitch_m = 3.0;
  double pane_depth_m = 0.2;
};

Style RandomStyle(Random& random) {
  return {.storeys = random.Uniform(0, 1) < 0.5 ? 2 : 3,
          .window_m = random.Uniform(1.1, 1.9),
          .pitch_m = random.Uniform(2.7, 3.6),
          .pane_depth_m = random.Uniform(0.15, 0.3)};
}

std::vector<Opening> WindowRow(const Style& style, double from, double to, double floor) {
  const int count = static_cast<int>((to - from - 1.0) / style.pitch_m);
  const double first = 0.5 * (from + to) - 0.5 * count * style.pitch_m;
  std::vector<Opening> row;
  for (int i = 0; i < count; ++i) {
    const double middle = first + (i + 0.5) * style.pitch_m;
    row.push_back(
        {middle - 0.5 * style.window_m, middle + 0.5 * style.window_m, floor + 0.9, floor + 2.4});
  }
  return row;
}

// Four walls around `wing`, storey on storey.
void AddWing(Scene& scene, const Style& style, const Footprint& wing) {
  constexpr double kThickness = 0.4;
  for (const bool along_y : {false, true}) {
    const int along = along_y ? 1 : 0;
    for (const bool upper : {false, true}) {
      const Vector2d& corner = upper ? wing.max() : wing.min();
      const Wall wall{.along_y = along_y,
                      .from = wing.min()[along],
                      .to = wing.max()[along],
                      .face = corner[1 - along],
                      .inwards = upper ? -1.0 : 1.0,
                      .label = kWall,
                      .pane_label = kWindow};
      for (int storey = 0; storey < style.storeys; ++storey) {
        const double floor = storey * kStoreyM;
        AddWall(scene,
                wall,
                floor,
                floor + kStoreyM,
                kThickness,
                WindowRow(style, wall.from, wall.to, floor),
                style.pane_depth_m);
      }
    }
  }
}

// Steps up to a landing at the wall y = `face`, from the south; returns the middle of the landing.
Vector3d AddStairs(Scene& scene, double x, double face, double width) {
  constexpr int kSteps = 5;
  constexpr double kRise = 0.16;
  constexpr double kTread = 0.32;
  constexpr double kLanding = 1.4;
  const double top = kSteps * kRise;
  for (int step = 1; step <= kSteps; ++step) {
    const double reach = kLanding + (kSteps - step) * kTread;
    scene.Add(Labelled(
        Box({x - 0.5 * width, face - reach, 0.0}, {x + 0.5 * width, face, step * kRise}), kStairs));
  }
  return {x, face - 0.5 * kLanding, top};
}

// Leaves and twigs: small boxes that lie anyhow within an ellipsoid.
void AddFoliage(Scene& scene, const Vector3d& centre, const Vector3d& radii, Random& random) {
  const double volume = radii.prod();
  const int leaves = static_cast<int>(std::clamp(60.0 * volume, 30.0, 250.0));
  for (int i = 0; i < leaves; ++i) {
    Vector3d offset;
    do {
      for (double& v : offset) v = random.Uniform(-1.0, 1.0);
    } while (offset.squaredNorm() > 1.0);
    Eigen::Isometry3d T_world_leaf = Eigen::Isometry3d::Identity();
    T_world_leaf.translation() = centre + radii.cwiseProduct(offset);
    T_world_leaf.linear() =
        Eigen::Quaterniond(
            Eigen::Vector4d(
                random.Gaussian(), random.Gaussian(), random.Gaussian(), random.Gaussian())
                .normalized())
            .toRotationMatrix();
    const Vector3d size(random.Uniform(0.1, 0.4), random.Uniform(0.1, 0.4), 0.03);
    scene.Add(Labelled(OrientedBox(T_world_leaf, size), kVegetation));
  }
}

void AddLeafyTree(Scene& scene, const Vector2d& foot, Random& random) {
  const double height = random.Uniform(4.5, 8.0);
  const double radius = random.Uniform(1.2, 2.0);
  scene.Add(Labelled(Post(foot.x(), foot.y(), 0.0, 0.7 * height, 0.12), kVegetation));
  AddFoliage(scene,
             {foot.x(), foot.y(), height - radius},
             {radius, radius, random.Uniform(0.8, 1.2) * radius},
             random);
}

void AddBush(Scene& scene, const Vector2d& foot, Random& random) {
  const double height = random.Uniform(0.8, 2.0);
  AddFoliage(scene,
             {foot.x(), foot.y(), 0.5 * height},
             {random.Uniform(0.6, 1.4), random.Uniform(0.6, 1.4), 0.5 * height},
             random);
}

// A place `distance` metres outside `box`, `share` of the way round it.
Vector2d Round(const Footprint& box, double distance, double share) {
  const Vector2d size = box.sizes() + Vector2d::Constant(2.0 * distance);
  double way = share * 2.0 * size.sum();
  Vector2d place = box.min() - Vector2d::Constant(distance);
  if (way < size.x()) return place + Vector2d(way, 0.0);
  way -= size.x();
  if (way < size.y()) return place + Vector2d(size.x(), way);
  way -= size.y();
  if (way < size.x()) return place + Vector2d(size.x() - way, size.y());
  return place + Vector2d(0.0, size.y() - (way - size.x()));
}

// `count` places around the building, `near` to `far` metres from it, evenly but for some chance.
template <typename Add>
void PlantRound(
    const Footprint& building, int count, double near, double far, Random& random, Add add) {
  for (int i = 0; i < count; ++i) {
    add(Round(building, random.Uniform(near, far), (i + random.Uniform(0.1, 0.9)) / count));
  }
}

}  // namespace

World BuildingWorld(std::uint64_t seed) {
  Random random(seed);
  const Style style = RandomStyle(random);
  const double length = random.Uniform(22.0, 30.0);
  const double width = random.Uniform(9.0, 12.0);
  const Footprint main(Vector2d(0.0, 0.0), Vector2d(length, width));
  const double side = random.Uniform(9.0, 11.0);
  const double from = random.Uniform(0.0, 1.0) < 0.5 ? 0.0 : length - side;
  const Footprint wing(Vector2d(from, width - 1.0),
                       Vector2d(from + side, width + random.Uniform(9.0, 14.0)));
  const Footprint building = main.merged(wing);

  World world;
  Scene& scene = world.scene;
  scene.Add(Labelled(Box({-60.0, -60.0, -1.0}, {90.0, 90.0, 0.0}), kGround));
  AddWing(scene, style, main);
  AddWing(scene, style, wing);
  const Vector3d door = AddStairs(scene, random.Uniform(0.3, 0.4) * length, 0.0, 4.0);
  AddStairs(scene, random.Uniform(0.65, 0.75) * length, 0.0, random.Uniform(2.0, 3.0));
  PlantRound(building, 12, kRouteM + 4.5, kRouteM + 12.0, random, [&](const Vector2d& foot) {
    AddLeafyTree(scene, foot, random);
  });
  PlantRound(building, 14, kRouteM + 3.0, kRouteM + 8.0, random, [&](const Vector2d& foot) {
    AddBush(scene, foot, random);
  });
  PlantRound(building, 14, kRouteM - 3.5, kRouteM - 2.0, random, [&](const Vector2d& foot) {
    scene.Add(Labelled(Post(foot.x(), foot.y(), 0.0, random.Uniform(4.0, 6.0), 0.09), kPole));
  });
  scene.Build();
  Robot robot{"round", {}};
  for (const Vector2d& corner : {Vector2d(building.min().x(), building.min().y()),
                                 Vector2d(building.max().x(), building.min().y()),
                                 Vector2d(building.max().x(), building.max().y()),
                                 Vector2d(building.min().x(), building.max().y()),
                                 Vector2d(building.min().x(), building.min().y())}) {
    const Vector2d out = (corner - building.center()).cwiseSign() * kRouteM;
    robot.waypoints.emplace_back(corner.x() + out.x(), corner.y() + out.y(), 0.0);
  }
  world.robots = {robot};
  world.places = {{"start", robot.waypoints[0]}, {"door", door}};
  return world;
}

}  // namespace strata::testing
